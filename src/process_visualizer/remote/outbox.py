# SPDX-License-Identifier: BSD-3-Clause
"""Decides what is sent next to a viewer, and what is dropped when the link is slow."""
from __future__ import annotations

from collections import deque
from typing import Callable, Deque, Dict, Iterator, NamedTuple, Optional, Tuple

from process_visualizer.remote.packets import PART_BYTES, message_packets

MAX_WAIT_S = 0.3
"""Maximum waiting time of a message that need not arrive; after that it is dropped."""
_SOON_S = 1.0
"""Time after a large message of a channel in which another one is expected."""
_MAX_WAITING_BYTES = 4 << 20
"""Maximum size of all small messages that wait."""
Thinner = Callable[[int, bytes], bytes]


class _Waiting(NamedTuple):
    channel: int
    arrived_ns: int
    data: bytes
    since_s: float
    is_kept: bool = False


class Outbox:
    """Decides what is sent next; times [s] come from a clock that does not jump.

    Data that must arrive (answers, latched messages) are sent first, then small messages in order
    of arrival, then parts of large ones: only the last message of each topic, one part of each in
    turn. A latched message that was thinned is sent again in full when nothing else waits. Memory
    does not grow with the published data: only the last latched message of each channel is kept.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self._urgent: Deque[bytes] = deque()
        self._kept: Dict[int, _Waiting] = {}
        self._small: Deque[_Waiting] = deque()
        self._small_bytes = 0
        self._large: Dict[int, _Waiting] = {}
        self._to_send_in_full: Dict[int, _Waiting] = {}  # latched, after their thinned copies
        self._large_s: Dict[int, float] = {}  # time of a channel's last large message
        self._transfers: Dict[int, Iterator[bytes]] = {}  # in order of their turns
        self._files: Deque[Tuple[int, Iterator[bytes]]] = deque()
        self._left_out: Dict[int, int] = {}

    def put_packet(self, packet: bytes) -> None:
        """Add a packet that must arrive, before everything else that waits."""
        self._urgent.append(packet)

    def put_kept(self, channel: int, arrived_ns: int, data: bytes) -> None:
        """Add a latched message, which must arrive unless its channel gets a newer one."""
        waiting = _Waiting(channel, arrived_ns, data, 0.0, True)
        is_large = len(data) > PART_BYTES
        self._to_send_in_full.pop(channel, None)
        for others in (self._kept, self._large):
            if others.pop(channel, None) is not None:
                self.count_dropped(channel)
        (self._large if is_large else self._kept)[channel] = waiting

    def put_file(self, channel: int, arrived_ns: int, read: Callable[[], bytes]) -> None:
        """Add a file, which must arrive, but after everything else; it is read in its turn."""
        self._files.append((channel, _file_packets(channel, arrived_ns, read)))

    @property
    def answers(self) -> int:
        """Return the number of packets and files that wait and must arrive."""
        return len(self._urgent) + len(self._files)

    def put(self, channel: int, arrived_ns: int, data: bytes, now_s: float) -> None:
        """Add a message."""
        waiting = _Waiting(channel, arrived_ns, data, now_s)
        if len(data) > PART_BYTES:
            if channel in self._large:
                self.count_dropped(channel)
            self._large[channel] = waiting
            self._large_s[channel] = now_s
            return
        self._small.append(waiting)
        self._small_bytes += len(data)
        while self._small_bytes > _MAX_WAITING_BYTES:
            self.count_dropped(self._take_small().channel)

    def take_left_out(self) -> Dict[int, int]:
        """Return the number of dropped messages by channel since the last call."""
        counts, self._left_out = self._left_out, {}
        return counts

    @property
    def transfers(self) -> int:
        """Return the number of large messages (in transfer, waiting, expected) on the link."""
        newest_s = max(self._large_s.values(), default=0.0)
        soon = {it for it, since_s in self._large_s.items() if newest_s - since_s < _SOON_S}
        return len(self._transfers.keys() | self._large.keys() | soon)

    def next_packets(self, now_s: float, thinned: Thinner,
                    with_large: bool = True) -> Optional[bytes]:
        """Return the bytes to send now, or None if nothing waits.

        ``thinned`` reduces a large message of a channel just before it is sent.
        """
        if self._urgent:
            return self._urgent.popleft()
        for channel in self._kept:
            if channel not in self._transfers:  # otherwise an older message would arrive after it
                it = self._kept.pop(channel)
                return b''.join(message_packets(it.channel, it.arrived_ns, it.data))
        while self._small:
            it = self._take_small()
            if now_s - it.since_s <= MAX_WAIT_S:
                return b''.join(message_packets(it.channel, it.arrived_ns, it.data))
            self.count_dropped(it.channel)
        return self._next_part(thinned) if with_large else None

    def _next_part(self, thinned: Thinner) -> Optional[bytes]:
        for channel in [name for name in self._large if name not in self._transfers]:
            message = self._large.pop(channel)
            data = thinned(channel, message.data)
            if message.is_kept and data is not message.data:
                self._to_send_in_full[channel] = message
            self._transfers[channel] = message_packets(channel, message.arrived_ns, data)
        if not self._transfers and self._to_send_in_full:
            channel, message = self._to_send_in_full.popitem()
            self._transfers[channel] = message_packets(channel, message.arrived_ns, message.data)
        elif not self._transfers and self._files:
            self._transfers.update([self._files.popleft()])
        while self._transfers:
            channel = next(iter(self._transfers))
            parts = self._transfers.pop(channel)
            part = next(parts, None)
            if part is not None:
                self._transfers[channel] = parts
                return part
        waits = self._large or self._to_send_in_full or self._files
        return self._next_part(thinned) if waits else None

    def _take_small(self) -> _Waiting:
        it = self._small.popleft()
        self._small_bytes -= len(it.data)
        return it

    def count_dropped(self, channel: int) -> None:
        """Count a dropped message of a channel."""
        self._left_out[channel] = self._left_out.get(channel, 0) + 1


def _file_packets(channel: int, arrived_ns: int, read: Callable[[], bytes]) -> Iterator[bytes]:
    yield from message_packets(channel, arrived_ns, read())
