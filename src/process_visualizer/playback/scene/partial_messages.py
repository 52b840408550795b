# SPDX-License-Identifier: BSD-3-Clause
"""Earlier messages that hold beside the newest one: transforms, markers, joints, diagnostics."""
from __future__ import annotations

from typing import Dict, FrozenSet, Iterable, Iterator, List, Optional, Set, Tuple

import numpy as np

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.messages.message_layout import MessageDamaged
from process_visualizer.messages.message_parts import (
    CLEARS,
    Parts,
    PartsReader,
    expires,
    lasts,
    parts_reader,
)
from process_visualizer.playback.scene.message_loader import MessageLoader
from process_visualizer.playback.scene.scene import Scene

FARTHEST_NS = 3_000_000_000
"""How much older than the newest message transforms may be that hold beside it."""
MOST = 200  # messages that are looked at
ALWAYS = 20  # that are looked at even where all that is known of the source has been found
SAMPLES = 60
"""Messages of a source, half of them the first, that show whether it tells of joints by groups."""

Groups = Dict[FrozenSet[bytes], np.ndarray]
"""The positions (rising) of a source's messages, by the keys of which they tell."""


class PartialMessages:
    """The messages that together say what one message of a source does not say alone.

    Most publishers put all in one message; of these only a few messages are read. What such a
    source was seen to tell of is looked for among its last messages. The position
    of a joint holds however long ago it was told: a source that tells of its joints by groups is
    read whole, once.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader, scene: Scene) -> None:
        """Take the index and the loader of a recording, and what the newest messages are."""
        self._index = index
        self._loader = loader
        self._scene = scene
        self._readers: List[Optional[PartsReader]] = [
            parts_reader(connection) for connection in index.connections]
        self._known: Dict[int, Set[bytes]] = {}  # keys, by source
        self._groups: Dict[int, Groups] = {}  # of sources whose parts last

    def beside(self, positions: Iterable[int], time_ns: int) -> List[int]:
        """Return the positions of what holds at a bag time [ns] beside some newest messages."""
        return [earlier for position in positions if self._reader(position) is not None
                for earlier in self._beside(position, time_ns)]

    def replaced(self, position: int) -> List[int]:
        """Return the positions (rising) of the messages that restore what this one replaced."""
        if self._reader(position) is None:
            return []
        missing = self._keys(self._parts(position))
        walked: List[Tuple[int, Set[bytes]]] = []
        wanted: Set[int] = set()
        for earlier in self._earlier(position):
            walked.append((earlier, self._keys(self._parts(earlier))))
            if missing & walked[-1][1]:
                wanted.add(earlier)
            missing -= walked[-1][1]
            if not missing:
                break
        return self._with_later(walked[::-1], wanted)

    @staticmethod
    def _with_later(messages: Iterable[Tuple[int, Set[bytes]]], wanted: Set[int]) -> List[int]:
        """The wanted ones of some messages (rising), and those by which their parts are newer."""
        chosen: List[int] = []
        covered: Set[bytes] = set()
        for position, keys in messages:
            if position in wanted or covered & keys:
                chosen.append(position)
                covered |= keys
        return chosen

    def _beside(self, position: int, time_ns: int) -> Iterator[int]:
        parts = self._parts(position)
        found = self._keys(parts)
        known = self._known.setdefault(self._scene.source_of(position), set())
        looks_for_all = not known
        for count, earlier in enumerate(self._earlier(position)):
            if CLEARS in parts or (count >= ALWAYS and not looks_for_all and known <= found):
                break
            parts = self._parts(earlier)
            age_ns = time_ns - int(self._index.time_ns[earlier])
            if any(part.key not in found and part != CLEARS
                   and not 0 < part.lifetime_ns < age_ns for part in parts):
                yield earlier
            found |= self._keys(parts)
        known |= found

    def _earlier(self, position: int) -> Iterator[int]:
        """The positions of the messages of a source before one, the nearest first.

        Of a source that tells of lasting parts by groups, only the last one of each group.
        """
        groups = self._groups_of(position)
        if len(groups) > 1:
            counts = {keys: int(it.searchsorted(position)) for keys, it in groups.items()}
            yield from sorted((int(groups[keys][count - 1]) for keys, count in counts.items()
                               if count), reverse=True)
            return
        connection = self._index.connections[int(self._index.connection[position])]
        farthest_ns = int(self._index.time_ns[position]) - FARTHEST_NS if expires(connection) else 0
        for _ in range(MOST):
            replaced = self._scene.replaced(position)
            if replaced is None or self._index.time_ns[replaced] < farthest_ns:
                return
            position = replaced
            yield position

    def _groups_of(self, position: int) -> Groups:
        """The groups in which the source of a message tells of lasting parts; none of others."""
        source = self._scene.source_of(position)
        if source not in self._groups:
            self._groups[source] = {}
            if lasts(self._index.connections[int(self._index.connection[position])]):
                positions = self._scene.messages_of(source)
                spread = np.linspace(0, len(positions) - 1, SAMPLES // 2).astype(int)
                samples = np.union1d(positions[:SAMPLES // 2], positions[spread])
                if len(self._grouped(samples)) > 1:
                    self._groups[source] = self._grouped(positions)
        return self._groups[source]

    def _grouped(self, positions: np.ndarray) -> Groups:
        groups: Dict[FrozenSet[bytes], List[int]] = {}
        for position in positions.tolist():
            groups.setdefault(frozenset(self._keys(self._parts(position))), []).append(position)
        return {keys: np.array(it) for keys, it in groups.items()}

    def _parts(self, position: int) -> Parts:
        """The parts of a message; none of one that cannot be read: its receivers cannot either."""
        reader, message = self._reader(position), self._loader.load(position)
        if reader is None or message is None:
            return ()
        try:
            return reader(bytes(message.data))
        except MessageDamaged:
            return ()

    def _reader(self, position: int) -> Optional[PartsReader]:
        return self._readers[int(self._index.connection[position])]

    @staticmethod
    def _keys(parts: Parts) -> Set[bytes]:
        return {part.key for part in parts if part != CLEARS}
