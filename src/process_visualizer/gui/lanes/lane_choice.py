# SPDX-License-Identifier: BSD-3-Clause
"""The choice of lanes: the curves shown, their order, and the shared and folded lanes."""
from __future__ import annotations

from typing import Any, Dict, FrozenSet, Iterable, List, NamedTuple, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.curves.position_values import Key


class LaneChoice(NamedTuple):
    """The operator's choice of lanes; an immutable value.

    ``joined`` has pairs: a curve, and the curve that hosts it in its lane. A host is not hosted
    itself.
    """

    order: Tuple[Key, ...] = ()
    hidden: FrozenSet[Key] = frozenset()
    joined: FrozenSet[Tuple[Key, Key]] = frozenset()
    folded: FrozenSet[Key] = frozenset()

    def arranged(self, keys: Sequence[Key]) -> Tuple[Key, ...]:
        """Return curves in the chosen order; curves that were never arranged come last."""
        known = [key for key in self.order if key in keys]
        return tuple(known + [key for key in keys if key not in self.order])

    def shown(self, keys: Sequence[Key]) -> Tuple[Key, ...]:
        """Return the curves that are not hidden, in the chosen order."""
        return tuple(key for key in self.arranged(keys) if key not in self.hidden)

    def lanes(self, keys: Sequence[Key]) -> Tuple[Tuple[Key, ...], ...]:
        """Return curves by lane; a lane takes the place of its first curve in the order."""
        hosts = dict(self.joined)
        lanes: Dict[Key, List[Key]] = {}
        for key in self.arranged(keys):
            lanes.setdefault(hosts.get(key, key), []).append(key)
        return tuple(map(tuple, lanes.values()))

    def is_folded(self, lane: Iterable[Key]) -> bool:
        """Return whether a lane is folded, so that only its names and values are shown."""
        return not self.folded.isdisjoint(lane)

    def with_hidden(self, key: Key) -> LaneChoice:
        """Hide another curve."""
        return self._replace(hidden=self.hidden | {key})

    def with_folded(self, lane: Iterable[Key], is_folded: bool) -> LaneChoice:
        """Fold a lane, or unfold it."""
        return self._replace(folded=self.folded | set(lane) if is_folded
                             else self.folded.difference(lane))

    def with_joined(self, key: Key, other: Key) -> LaneChoice:
        """Draw all curves of the lane of ``key`` in the lane of ``other``."""
        hosts = dict(self.joined)
        old, new = hosts.get(key, key), hosts.get(other, other)
        moved = {it for it, host in hosts.items() if host == old} | {old}
        return self._joined({**hosts, **{it: new for it in moved}})

    def with_own_lane(self, key: Key) -> LaneChoice:
        """Draw a curve in a lane of its own."""
        hosts = dict(self.joined)
        hosts.pop(key, None)
        left = sorted(it for it, host in hosts.items() if host == key)
        return self._joined({**hosts, **{it: left[0] for it in left}})

    def rearranged(self, lanes: Sequence[Sequence[Key]], hidden: Set[Key],
                   folded: Set[Key]) -> LaneChoice:
        """Replace the choice for these curves; curves of other recordings stay unchanged."""
        keys = [key for lane in lanes for key in lane]
        hosts = {key: lane[0] for lane in lanes for key in lane}
        others = {key: hosts.get(host, host) for key, host in self.joined if key not in hosts}
        return LaneChoice((*keys, *(key for key in self.order if key not in hosts)),
                          frozenset(hidden | self.hidden.difference(keys)), frozenset(),
                          frozenset(folded | self.folded.difference(keys))
                          )._joined({**hosts, **others})

    def _joined(self, hosts: Dict[Key, Key]) -> LaneChoice:
        return self._replace(joined=frozenset((key, host) for key, host in hosts.items()
                                              if key != host))

    def settings(self) -> Dict[str, Any]:
        """Return the input of ``restored_choice``: texts, lists and a dictionary."""
        return {'order': list(self.order), 'hidden': sorted(self.hidden),
                'joined': sorted(self.joined), 'folded': sorted(self.folded)}


def restored_choice(settings: Any) -> LaneChoice:
    """Return the choice with these settings; earlier versions wrote pairs (curve, is shown)."""
    if isinstance(settings, list):
        settings = {'order': [key for key, _ in settings],
                    'hidden': [key for key, is_shown in settings if not is_shown]}
    return LaneChoice(
        tuple(map(_key, settings.get('order', ()))),
        frozenset(map(_key, settings.get('hidden', ()))),
        frozenset((_key(it), _key(host)) for it, host in settings.get('joined', ())),
        frozenset(map(_key, settings.get('folded', ()))))


def _key(parts: Sequence[Any]) -> Key:
    device, label, topic = map(str, parts)
    return device, label, topic


_MAX_CONFIGURATIONS = 50  # with a saved choice


class LaneChoices(QObject):
    """The choices of lanes for the current configuration and for others."""

    changed = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._choices: Dict[str, LaneChoice] = {}
        self._configuration = ''

    @property
    def choice(self) -> LaneChoice:
        """The choice for the current configuration."""
        return self._choices.get(self._configuration, LaneChoice())

    def set_configuration(self, path: str) -> None:
        """Switch to the choice for another configuration."""
        if path != self._configuration:
            self._configuration = path
            self.changed.emit()

    def choose(self, choice: LaneChoice) -> None:
        """Set the choice for the current configuration."""
        if choice != self.choice:
            self._choices.pop(self._configuration, None)
            self._choices[self._configuration] = choice
            self.changed.emit()

    def settings(self) -> Dict[str, Any]:
        """Return the input of ``restore``: texts, lists and dictionaries."""
        newest = list(self._choices.items())[-_MAX_CONFIGURATIONS:]
        return {path: choice.settings() for path, choice in newest if choice != LaneChoice()}

    def restore(self, settings: Dict[str, Any]) -> None:
        """Restore the choices of an earlier session."""
        self._choices = {path: restored_choice(rows) for path, rows in settings.items()}
        self.changed.emit()
