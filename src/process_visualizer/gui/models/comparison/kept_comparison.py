# SPDX-License-Identifier: BSD-3-Clause
"""The part of a comparison that is kept over a restart: enough to make it again."""
from __future__ import annotations

from typing import Any, Dict, FrozenSet, Mapping, NamedTuple, Tuple

from process_visualizer.runs.alignment.anchors import Anchor

RunKey = Tuple[str, str]
"""A run: the path of its recording, and its name."""


class KeptComparison(NamedTuple):
    """A kept comparison: recordings that were read, good runs, and what the operator aligned."""

    recording: Tuple[str, ...] = ()
    added: Tuple[str, ...] = ()
    good: FrozenSet[RunKey] = frozenset()
    anchors: Mapping[RunKey, Tuple[Anchor, ...]] = {}
    is_compared: bool = False

    def without_recording(self) -> KeptComparison:
        """Return the same for a window in which no recording is open."""
        return self._replace(recording=(), added=(*self.recording, *self.added))

    def settings(self) -> Dict[str, Any]:
        """Return what ``kept_comparison`` needs, as numbers, texts, lists and dictionaries."""
        return {'recording': list(self.recording), 'added': list(self.added),
                'good': sorted(map(list, self.good)),
                'anchors': [[*key, [list(it) for it in anchors]]
                            for key, anchors in self.anchors.items()],
                'compared': self.is_compared}


def kept_comparison(settings: Mapping[str, Any]) -> KeptComparison:
    """Return what ``settings`` returned.

    Raises:
        KeyError, TypeError, ValueError: it is something else.
    """
    return KeptComparison(
        _texts(settings['recording']), _texts(settings['added']),
        frozenset((str(path), str(name)) for path, name in settings['good']),
        {(str(path), str(name)): tuple(Anchor(float(a), float(b)) for a, b in anchors)
         for path, name, anchors in settings['anchors']},
        bool(settings['compared']))


def _texts(values: Any) -> Tuple[str, ...]:
    if not isinstance(values, list):
        raise TypeError(f'{values!r} is no list')
    return tuple(str(value) for value in values)
