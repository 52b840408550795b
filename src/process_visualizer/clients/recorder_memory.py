# SPDX-License-Identifier: BSD-3-Clause
"""The recorder's memory, read part by part."""
from __future__ import annotations

from typing import Any, Sequence, Tuple

import numpy as np

from process_visualizer.clients.service_connection import ServiceConnection
from process_visualizer.curves.live.recent_part import RecentPart
from process_visualizer.messages.connection import Connection
from process_visualizer.messages.installed_definitions import with_definition
from process_visualizer.ros_names import BAG_RECORDER
from process_visualizer.srv import ReadRecent

_TEXTS = 5  # that describe a connection
_LARGEST_BYTES = 1 << 16  # of a message that holds a few numbers


class RecorderMemory:
    """Reads each message once; needs no node of its own. Calls block."""

    def __init__(self, node: str = f'/{BAG_RECORDER}', timeout_s: float = 3.0,
                 largest_bytes: int = _LARGEST_BYTES) -> None:
        """Messages of more than ``largest_bytes`` are left out, such as images; 0: none are."""
        self._largest = largest_bytes
        self._service = ServiceConnection(f'{node}/read_recent', ReadRecent, timeout_s)
        self._next = 0
        self._connections: Tuple[Connection, ...] = ()

    def read(self, topics: Sequence[str]) -> Tuple[RecentPart, bool]:
        """Return messages of topics that have not been read yet, and whether there are more.

        Raises:
            ServiceUnreachable: the recorder does not answer.
        """
        answer = self._service.call(list(topics), self._next, self._largest,
                                    len(self._connections))
        known = () if answer.anew else self._connections
        self._connections = known + _connections(answer.connections)
        self._next = answer.next
        return _part(answer, self._connections), bool(answer.more)

    def restart(self) -> None:
        """Read everything from the beginning of the memory on."""
        self._next, self._connections = 0, ()

    def close(self) -> None:
        """Close the connection; the next call opens another one."""
        self._service.close()


def _connections(texts: Sequence[str]) -> Tuple[Connection, ...]:
    return tuple(with_definition(Connection(topic, kind, md5sum, definition, False, node))
                 for topic, kind, md5sum, definition, node in zip(*(texts[it::_TEXTS]
                                                                    for it in range(_TEXTS))))


def _part(answer: Any, connections: Tuple[Connection, ...]) -> RecentPart:
    end = np.cumsum(np.array(answer.sizes, np.int64))
    begin = np.concatenate((np.zeros(min(len(end), 1), np.int64), end[:-1]))
    return RecentPart(bool(answer.anew), connections, int(answer.now),
                      np.array(answer.numbers, np.int64), np.array(answer.times, np.int64),
                      begin, end, np.frombuffer(answer.records, np.uint8))
