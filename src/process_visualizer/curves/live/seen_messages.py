# SPDX-License-Identifier: BSD-3-Clause
"""Messages seen so far, for whoever asks which frames there are."""
from __future__ import annotations

from collections import deque
from typing import Deque, Dict, List, NamedTuple, Tuple

import numpy as np

from process_visualizer.bags.bag_index import BagIndex, ChunkPlaces, Columns
from process_visualizer.curves.live.recent_part import RecentPart
from process_visualizer.messages.connection import Connection
from process_visualizer.ros_names import TF_MESSAGE

_MOST_MESSAGES = 100  # of each publisher of frames


class _Seen(NamedTuple):
    time_ns: int
    number: int
    data: bytes


class SeenMessages:
    """All connections, and the newest messages of those that tell of frames.

    It has what ``tool_on_tf`` asks of messages.
    """

    def __init__(self) -> None:
        self._connections: Tuple[Connection, ...] = ()
        self._kept: Dict[int, Deque[_Seen]] = {}
        self._in_order: List[_Seen] = []
        self.index = _index((), [])

    def add(self, part: RecentPart) -> None:
        """Take what has come."""
        if part.is_anew:
            self._kept.clear()
        self._connections = part.connections
        for number, connection in enumerate(part.connections):
            if connection.type == TF_MESSAGE:
                self._keep(part, number)

    def _keep(self, part: RecentPart, number: int) -> None:
        kept = self._kept.setdefault(number, deque(maxlen=_MOST_MESSAGES))
        for row in np.flatnonzero(part.numbers == number)[-_MOST_MESSAGES:].tolist():
            kept.append(_Seen(int(part.times_ns[row]), number, part.message(row)))

    def look(self) -> None:
        """Bring ``index`` up to date."""
        self._in_order = sorted(it for kept in self._kept.values() for it in kept)
        self.index = _index(self._connections, self._in_order)

    def message(self, position: int) -> memoryview:
        """Return the bytes of a message, by its position in the index."""
        return memoryview(self._in_order[position].data)


def _index(connections: Tuple[Connection, ...], messages: List[_Seen]) -> BagIndex:
    nothing = np.zeros(len(messages), np.int32)
    return BagIndex(connections, Columns(
        np.array([it.time_ns for it in messages], np.int64),
        np.array([it.number for it in messages], np.int32), nothing,
        np.arange(len(messages), dtype=np.int32)),
        ChunkPlaces(np.zeros(0, np.int32), np.zeros(0, np.int64)))
