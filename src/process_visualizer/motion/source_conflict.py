# SPDX-License-Identifier: BSD-3-Clause
"""Two nodes that publish different values of one quantity on the same topic."""
from __future__ import annotations

import math
from typing import Dict, NamedTuple, Sequence

_BESIDE_S = 1.0
"""Within which two nodes publish the same quantity."""
_MIN_IN_A_ROW = 5
_LATE_STEPS = 20.0
"""A node that passes on another's values may be so many of its steps late."""


class _Told(NamedTuple):
    values: Sequence[float]
    time_s: float
    step: float  # since the one before


class SourceConflict:
    """Notices that the values of several nodes contradict each other, as JointBoard does in C++.

    A forgotten simulator beside a driver is drawn in turn with it, and each message alone looks
    right. A node that only passes on what another says, some steps late, is no contradiction.
    """

    def __init__(self, equal: float) -> None:
        """``equal``: values that are no farther apart, in their unit, are the same."""
        self._equal = equal
        self._told: Dict[str, _Told] = {}
        self._in_a_row = 0

    def add(self, source: str, values: Sequence[float], now_s: float) -> str:
        """Take the values that a node has published; return the problem, '' without one.

        Args:
            source: the node's name.
            values: (n,), of the same n each time.
            now_s: of a clock that only advances.
        """
        before = self._told.get(source)
        step = 0.0 if before is None else math.dist(before.values, values)
        told = _Told(tuple(values), now_s, step)
        self._told = {name: it for name, it in self._told.items()
                      if now_s - it.time_s < _BESIDE_S and len(it.values) == len(values)}
        self._told[source] = told
        others = {name: math.dist(it.values, values) for name, it in self._told.items()
                  if name != source}
        apart = max((distance for name, distance in others.items() if distance > self._equal
                     + _LATE_STEPS * max(step, self._told[name].step)), default=0.0)
        if others:
            self._in_a_row = self._in_a_row + 1 if apart else 0
        if not others or self._in_a_row < _MIN_IN_A_ROW:
            return ''
        return (f'{len(self._told)} nodes publish on this topic, {", ".join(sorted(self._told))}, '
                f'and their values are {apart:.3g} apart; what is shown jumps between them. Stop '
                'all but one')
