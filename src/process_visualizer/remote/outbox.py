# SPDX-License-Identifier: BSD-3-Clause
"""The outbox of one viewer: never old data, and never much."""
from __future__ import annotations

from collections import deque
from typing import Callable, Deque, Dict, Iterator, NamedTuple, Optional, Tuple

from process_visualizer.remote.frames import PART_BYTES, message_frames

OLD_S = 0.3
"""A message that has waited longer is not sent any more, unless it has to arrive."""
_MOST_BYTES = 4 << 20
"""Of small messages that wait."""
Thinner = Callable[[int, bytes], bytes]


class _Waiting(NamedTuple):
    channel: int
    arrived_ns: int
    data: bytes
    since_s: float


class Outbox:
    """Decides what is sent next; times [s] are those of a clock that does not jump.

    First what has to arrive (answers, latched messages), then small messages in the order in which
    they came, then parts of large ones: of each topic only the last message, a part of each in
    turn.
    """

    def __init__(self) -> None:
        """It is empty."""
        self._urgent: Deque[bytes] = deque()
        self._small: Deque[_Waiting] = deque()
        self._small_bytes = 0
        self._large: Dict[int, _Waiting] = {}
        self._transfers: Dict[int, Iterator[bytes]] = {}  # in turn: the last one was sent last
        self._files: Deque[Tuple[int, Iterator[bytes]]] = deque()
        self._left_out: Dict[int, int] = {}

    def put_frame(self, frame: bytes) -> None:
        """Add a frame that has to arrive, before anything that waits."""
        self._urgent.append(frame)

    def put_kept(self, channel: int, arrived_ns: int, data: bytes) -> None:
        """Add a message that has to arrive, such as a latched one."""
        self._urgent.extend(message_frames(channel, arrived_ns, data))

    def put_file(self, channel: int, arrived_ns: int, data: bytes) -> None:
        """Add a file: it has to arrive, but everything else goes first."""
        self._files.append((channel, message_frames(channel, arrived_ns, data)))

    def put(self, channel: int, arrived_ns: int, data: bytes, now_s: float) -> None:
        """Add a message."""
        waiting = _Waiting(channel, arrived_ns, data, now_s)
        if len(data) > PART_BYTES:
            if channel in self._large:
                self._leave_out(channel)
            self._large[channel] = waiting
            return
        self._small.append(waiting)
        self._small_bytes += len(data)
        while self._small_bytes > _MOST_BYTES:
            self._leave_out(self._take_small().channel)

    def take_left_out(self) -> Dict[int, int]:
        """Return how many messages of each channel were not sent since the last call."""
        counts, self._left_out = self._left_out, {}
        return counts

    @property
    def transfers(self) -> int:
        """Return how many large messages are under way, or wait."""
        return len(self._transfers.keys() | self._large.keys())

    def next_frames(self, now_s: float, thinned: Thinner,
                    with_large: bool = True) -> Optional[bytes]:
        """Return what is to be sent now, or None if nothing waits.

        ``thinned`` makes a large message of a channel smaller, just before it is sent.
        """
        if self._urgent:
            return self._urgent.popleft()
        while self._small:
            it = self._take_small()
            if now_s - it.since_s <= OLD_S:
                return b''.join(message_frames(it.channel, it.arrived_ns, it.data))
            self._leave_out(it.channel)
        return self._next_part(thinned) if with_large else None

    def _next_part(self, thinned: Thinner) -> Optional[bytes]:
        for channel in [it for it in self._large if it not in self._transfers]:
            it = self._large.pop(channel)
            self._transfers[channel] = message_frames(channel, it.arrived_ns,
                                                      thinned(channel, it.data))
        if not self._transfers and self._files:
            self._transfers.update([self._files.popleft()])
        while self._transfers:
            channel = next(iter(self._transfers))
            parts = self._transfers.pop(channel)
            part = next(parts, None)
            if part is not None:
                self._transfers[channel] = parts
                return part
        return None if not self._large and not self._files else self._next_part(thinned)

    def _take_small(self) -> _Waiting:
        it = self._small.popleft()
        self._small_bytes -= len(it.data)
        return it

    def _leave_out(self, channel: int) -> None:
        self._left_out[channel] = self._left_out.get(channel, 0) + 1
