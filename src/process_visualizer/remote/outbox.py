# SPDX-License-Identifier: BSD-3-Clause
"""The outbox of one viewer, which holds neither old data nor much data."""
from __future__ import annotations

import math
from collections import deque
from struct import Struct, error
from typing import Callable, Deque, Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.bagio.message_layout import MessageDamaged, read_text
from process_visualizer.remote.frames import PART_BYTES, message_frames

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

    def put_frame(self, frame: bytes) -> None:
        """Add a frame that must arrive, before everything else that waits."""
        self._urgent.append(frame)

    def put_kept(self, channel: int, arrived_ns: int, data: bytes) -> None:
        """Add a latched message, which must arrive unless its channel gets a newer one."""
        waiting = _Waiting(channel, arrived_ns, data, 0.0, True)
        is_large = len(data) > PART_BYTES
        self._to_send_in_full.pop(channel, None)
        for others in (self._kept, self._large):
            if others.pop(channel, None) is not None:
                self.leave_out(channel)
        (self._large if is_large else self._kept)[channel] = waiting

    def put_file(self, channel: int, arrived_ns: int, read: Callable[[], bytes]) -> None:
        """Add a file, which must arrive, but after everything else; it is read in its turn."""
        self._files.append((channel, _file_frames(channel, arrived_ns, read)))

    @property
    def answers(self) -> int:
        """Return the number of frames and files that wait and must arrive."""
        return len(self._urgent) + len(self._files)

    def put(self, channel: int, arrived_ns: int, data: bytes, now_s: float) -> None:
        """Add a message."""
        waiting = _Waiting(channel, arrived_ns, data, now_s)
        if len(data) > PART_BYTES:
            if channel in self._large:
                self.leave_out(channel)
            self._large[channel] = waiting
            self._large_s[channel] = now_s
            return
        self._small.append(waiting)
        self._small_bytes += len(data)
        while self._small_bytes > _MAX_WAITING_BYTES:
            self.leave_out(self._take_small().channel)

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

    def next_frames(self, now_s: float, thinned: Thinner,
                    with_large: bool = True) -> Optional[bytes]:
        """Return the bytes to send now, or None if nothing waits.

        ``thinned`` reduces a large message of a channel just before it is sent.
        """
        if self._urgent:
            return self._urgent.popleft()
        for channel in self._kept:
            if channel not in self._transfers:  # otherwise an older message would arrive after it
                it = self._kept.pop(channel)
                return b''.join(message_frames(it.channel, it.arrived_ns, it.data))
        while self._small:
            it = self._take_small()
            if now_s - it.since_s <= MAX_WAIT_S:
                return b''.join(message_frames(it.channel, it.arrived_ns, it.data))
            self.leave_out(it.channel)
        return self._next_part(thinned) if with_large else None

    def _next_part(self, thinned: Thinner) -> Optional[bytes]:
        for channel in [name for name in self._large if name not in self._transfers]:
            message = self._large.pop(channel)
            data = thinned(channel, message.data)
            if message.is_kept and data is not message.data:
                self._to_send_in_full[channel] = message
            self._transfers[channel] = message_frames(channel, message.arrived_ns, data)
        if not self._transfers and self._to_send_in_full:
            channel, message = self._to_send_in_full.popitem()
            self._transfers[channel] = message_frames(channel, message.arrived_ns, message.data)
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

    def leave_out(self, channel: int) -> None:
        """Count a message of a channel that is not sent."""
        self._left_out[channel] = self._left_out.get(channel, 0) + 1


def _file_frames(channel: int, arrived_ns: int, read: Callable[[], bytes]) -> Iterator[bytes]:
    yield from message_frames(channel, arrived_ns, read())


_MIN_BYTES, _MAX_WINDOW_BYTES = 24 << 10, 2 << 20
"""Limits of the window; the largest bounds the old data when a wide link becomes thin: 1.7 s of
10 Mbit/s."""
_BEGIN_BYTES, _BEGIN_S = 64 << 10, 0.1
_LARGE_S, _MIN_LARGE_BYTES = 0.15, 16 << 10
_QUEUED_S = 0.06
"""Maximum delay of an answer beyond the quickest one, by queues on the way."""
_SHRINK, _MOST_SHRINK = 0.8, 0.1
_OVERDUE = 2.0
"""Factor by which an answer exceeds its maximum time when a link has become thin."""
_RESERVE = 2.0
_QUICKEST_S = 20.0
"""Time for which the quickest answer counts: the route may change."""
_RATE_S = 0.5
_PROBE, _PROVED_S = 8.0, 20.0
"""Factor by which large messages may exceed the highest rate that the link has carried lately, and
time for which that counts [s]: small messages alone show little of what a link carries."""


class LinkWindow:
    """Adapts a window to the viewer's acknowledgments; times [s] come from a clock without jumps.

    TCP alone fills every buffer on the way, up to seconds of a thin link. So the data in flight are
    limited to what the link carries during an answer: the window grows while answers are as quick
    as possible, and shrinks when they become slower. When a link becomes thin, answers are missing
    at first, so nothing large is sent while an answer is overdue.
    """

    def __init__(self, least_bytes: int = _MIN_BYTES, begin_bytes: int = _BEGIN_BYTES,
                 queued_s: float = _QUEUED_S, longest_s: float = math.inf) -> None:
        """Begin without knowledge of the link.

        Args:
            least_bytes, begin_bytes: minimum and initial size of the window.
            queued_s: maximum delay of an answer beyond the quickest one.
            longest_s: maximum time of an answer, however quick others were.
        """
        self._least_bytes, self._window = least_bytes, float(begin_bytes)
        self._queued_s, self._longest_s = queued_s, longest_s
        self._sent = self._acknowledged = 0
        self._marks: Deque[Tuple[int, float]] = deque()  # bytes sent up to a time
        self._quickest: Deque[Tuple[float, float]] = deque()  # rising: time, answer [s]
        self._shrunk_s = self._rate_begin_s = float('-inf')
        self._rate_bytes = 0
        self._bytes_s = 0.0
        self._proved: Deque[Tuple[float, float]] = deque()  # falling: time, rate [bytes/s]
        self.answer_s = 0.0

    @property
    def under_way(self) -> int:
        """The number of unacknowledged bytes."""
        return self._sent - self._acknowledged

    @property
    def bytes_s(self) -> float:
        """Return the rate at which the viewer receives data [bytes/s]; 0 while unknown."""
        return self._bytes_s

    @property
    def carries_bytes_s(self) -> float:
        """Return the capacity of the link [bytes/s]; a cautious guess while it is unknown."""
        return self._window / (self.answer_s or _BEGIN_S)

    def large_bytes(self, count: int) -> float:
        """Return the size [bytes] up to which each of ``count`` large messages arrives soon."""
        proved_bytes_s = self._proved[0][1] if self._proved else 0.0
        carries_bytes_s = min(self.carries_bytes_s, _PROBE * proved_bytes_s)
        return max(_MIN_LARGE_BYTES, _LARGE_S * carries_bytes_s / max(1, count))

    def may_send(self) -> bool:
        """Return whether small data may be sent now, which need not wait for large data."""
        return self.under_way < _RESERVE * self._window

    def may_send_large(self, now_s: float) -> bool:
        """Return whether data of any size may be sent now."""
        is_overdue = (self.under_way > self._least_bytes
                      and now_s - self._marks[0][1] > _OVERDUE * self._patience_s)
        return self.under_way < self._window and not is_overdue

    @property
    def _patience_s(self) -> float:
        """The maximum time of an answer [s]."""
        quickest_s = self._quickest[0][1] if self._quickest else math.inf
        return min(quickest_s + self._queued_s, self._longest_s)

    def sent(self, count: int, now_s: float) -> None:
        """Note the number of bytes that were sent."""
        self._sent += count
        self._marks.append((self._sent, now_s))

    def acknowledged(self, total: int, now_s: float) -> None:
        """Note the total number of bytes that the viewer has received."""
        if not self._acknowledged < total <= self._sent:
            return
        was_full = self.under_way > 0.5 * self._window
        new, self._acknowledged = total - self._acknowledged, total
        begun_s = now_s
        while self._marks and self._marks[0][0] <= total:
            begun_s = self._marks.popleft()[1]
        self._count(new, now_s)
        if begun_s < now_s:
            self._adapt(now_s - begun_s, new, was_full, now_s)

    def _adapt(self, answer_s: float, new: int, was_full: bool, now_s: float) -> None:
        self.answer_s = answer_s
        while self._quickest and self._quickest[-1][1] >= answer_s:
            self._quickest.pop()
        self._quickest.append((now_s, answer_s))
        while self._quickest[0][0] < now_s - _QUICKEST_S:
            self._quickest.popleft()
        if answer_s > self._patience_s:
            if now_s - self._shrunk_s > answer_s:  # once for all data in flight
                is_thin = answer_s > _OVERDUE * self._patience_s
                shrink = max(self._patience_s / answer_s, _MOST_SHRINK) if is_thin else _SHRINK
                self._window = max(self._least_bytes, self._window * shrink)
                self._shrunk_s = now_s
        elif was_full:
            self._window = min(_MAX_WINDOW_BYTES, self._window + 0.5 * new)

    def _count(self, new: int, now_s: float) -> None:
        self._rate_bytes += new
        passed_s = now_s - self._rate_begin_s
        if passed_s > _RATE_S:
            self._bytes_s = self._rate_bytes / passed_s
            self._rate_begin_s, self._rate_bytes = now_s, 0
            while self._proved and self._proved[-1][1] <= self._bytes_s:
                self._proved.pop()
            self._proved.append((now_s, self._bytes_s))
            while self._proved[0][0] < now_s - _PROVED_S:
                self._proved.popleft()


CLOUD, IMAGE = 'sensor_msgs/PointCloud2', 'sensor_msgs/Image'
_STAMPED = 12
_PIXEL_BYTES = {'mono8': 1, '8UC1': 1, 'mono16': 2, '16UC1': 2, '32FC1': 4, 'rgb8': 3, 'bgr8': 3,
                '8UC3': 3, 'rgba8': 4, 'bgra8': 4, '8UC4': 4}


def thinned(kind: str, data: bytes, most_bytes: float) -> bytes:
    """Return a cloud or an image reduced to about ``most_bytes``, other messages unchanged.

    Points without coordinates are dropped first, then every n-th point is kept, or every n-th row
    and column of an image. Messages that cannot be parsed are returned unchanged.
    """
    if len(data) <= most_bytes:
        return data
    try:
        if kind == CLOUD:
            return _thinned_cloud(data, most_bytes)
        if kind == IMAGE:
            return _thinned_image(data, most_bytes)
    except (MessageDamaged, error, ValueError, IndexError, KeyError):
        return data
    return data


def _thinned_cloud(data: bytes, most_bytes: float) -> bytes:
    position = read_text(data, _STAMPED)[1]
    begin = position
    height, width, count = Struct('<III').unpack_from(data, position)
    position += 12
    offsets = {}
    for _ in range(count):
        name, position = read_text(data, position)
        offset, datatype, _count = Struct('<IBI').unpack_from(data, position)
        offsets[name] = offset, datatype
        position += 9
    fields_end = position
    big, point_step, row_step, size = Struct('<BIII').unpack_from(data, position)
    position += 13
    if row_step != width * point_step or size != height * row_step or not point_step:
        return data
    points = np.frombuffer(data, np.uint8, size, position).reshape(-1, point_step)
    points = _somewhere(points, offsets, '>f4' if big else '<f4')
    step = max(1, math.ceil(points.size / max(1.0, most_bytes)))
    points = points[::step]
    dense = data[position + size:position + size + 1]
    return b''.join([
        data[:begin], Struct('<III').pack(1, len(points), count), data[begin + 12:fields_end],
        Struct('<BIII').pack(big, point_step, points.size, points.size), points.tobytes(), dense])


def _somewhere(points: np.ndarray, offsets: 'dict[bytes, Tuple[int, int]]',
               number: str) -> np.ndarray:
    """Return the points with finite coordinates; a coordinate that is no float32 is not judged."""
    known = np.ones(len(points), bool)
    for axis in (b'x', b'y', b'z'):
        offset, datatype = offsets.get(axis, (0, 0))
        if datatype == 7 and offset + 4 <= points.shape[1]:  # FLOAT32
            known &= np.isfinite(
                np.ascontiguousarray(points[:, offset:offset + 4]).view(number)[:, 0])
    return points[known]


def _thinned_image(data: bytes, most_bytes: float) -> bytes:
    position = read_text(data, _STAMPED)[1]
    begin = position
    height, width = Struct('<II').unpack_from(data, position)
    encoding, position = read_text(data, position + 8)
    encoding_end = position
    big, row_step, size = Struct('<BII').unpack_from(data, position)
    position += 9
    pixel = _PIXEL_BYTES[encoding.decode()]
    if row_step < width * pixel or size != height * row_step:
        return data
    rows = np.frombuffer(data, np.uint8, size, position).reshape(height, row_step)
    step = max(1, math.ceil(math.sqrt(size / max(1.0, most_bytes))))
    kept = rows[::step, :width * pixel].reshape(-1, width, pixel)[:, ::step]
    return b''.join([
        data[:begin], Struct('<II').pack(*kept.shape[:2]), data[begin + 8:encoding_end],
        Struct('<BII').pack(big, kept.shape[1] * pixel, kept.size), kept.tobytes()])
