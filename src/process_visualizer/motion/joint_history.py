# SPDX-License-Identifier: BSD-3-Clause
"""The positions of joints at times of the last seconds."""
from __future__ import annotations

from collections import deque
from typing import Deque, Dict, Mapping, NamedTuple, Optional

_STATES = 128


class _State(NamedTuple):
    time_s: float
    positions: Dict[str, float]


class JointHistory:
    """The last joint states, between which the positions are taken to change evenly."""

    def __init__(self) -> None:
        """Begin without positions."""
        self._states: Deque[_State] = deque(maxlen=_STATES)
        self._last: Dict[str, float] = {}

    def add(self, time_s: float, positions: Mapping[str, float]) -> None:
        """Take the positions [rad or m] of some joints by name; after a step back begin anew."""
        if self._states and time_s < self._states[-1].time_s:
            self._states.clear()
        self._last = {**self._last, **positions}
        self._states.append(_State(time_s, self._last))

    def at(self, time_s: float) -> Dict[str, float]:
        """Return the positions at a time; the last ones at 0, and the first or last beyond them."""
        later: Optional[_State] = None
        for state in reversed(self._states):
            if not time_s or time_s >= state.time_s:
                return state.positions if later is None else _between(state, later, time_s)
            later = state
        return {} if later is None else later.positions


def _between(before: _State, after: _State, time_s: float) -> Dict[str, float]:
    part = (time_s - before.time_s) / (after.time_s - before.time_s)
    return {name: position + part * (after.positions[name] - position)
            for name, position in before.positions.items()}
