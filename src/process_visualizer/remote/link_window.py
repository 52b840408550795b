# SPDX-License-Identifier: BSD-3-Clause
"""The limit of bytes under way to a viewer, so that they arrive soon."""
from __future__ import annotations

from collections import deque
from typing import Deque, Tuple

_LEAST_BYTES, _MOST_BYTES = 24 << 10, 8 << 20
_BEGIN_BYTES, _BEGIN_S = 64 << 10, 0.1
_LARGE_S, _LEAST_LARGE_BYTES = 0.25, 16 << 10
_QUEUED_S = 0.06
"""So much longer than the quickest one an answer may take: that is what queues on the way."""
_SHRINK = 0.8
_RESERVE = 2.0
_QUICKEST_S = 20.0
"""The quickest answer counts for so long: the way may become another one."""
_RATE_S = 0.5


class LinkWindow:
    """Follows what the viewer acknowledges; times [s] are those of a clock that does not jump.

    TCP alone fills every buffer on the way, up to seconds of a thin link. So no more is under way
    than the link carries in the time of an answer: it grows while answers come as quickly as they
    can, and shrinks when they become slower.
    """

    def __init__(self) -> None:
        """Nothing is known of the link."""
        self._window = float(_BEGIN_BYTES)
        self._sent = self._acknowledged = 0
        self._marks: Deque[Tuple[int, float]] = deque()  # bytes sent up to a time
        self._quickest: Deque[Tuple[float, float]] = deque()  # rising: time, answer [s]
        self._shrunk_s = self._rate_begin_s = float('-inf')
        self._rate_bytes = 0
        self._bytes_s = 0.0
        self.answer_s = 0.0

    @property
    def under_way(self) -> int:
        """The bytes that are not acknowledged."""
        return self._sent - self._acknowledged

    @property
    def bytes_s(self) -> float:
        """Return what the viewer gets at present [bytes/s]; 0 while nothing is known."""
        return self._bytes_s

    @property
    def carries_bytes_s(self) -> float:
        """Return what the link would carry [bytes/s]; a cautious guess while nothing is known."""
        return self._window / (self.answer_s or _BEGIN_S)

    def large_bytes(self, count: int) -> float:
        """Return how long each of some large messages may be to be there soon [bytes]."""
        return max(_LEAST_LARGE_BYTES, _LARGE_S * self.carries_bytes_s / max(1, count))

    def may_send(self) -> bool:
        """Return whether more may be sent now, if it is small: it need not wait for large data."""
        return self.under_way < _RESERVE * self._window

    def may_send_large(self) -> bool:
        """Return whether more may be sent now, whatever it is."""
        return self.under_way < self._window

    def sent(self, count: int, now_s: float) -> None:
        """Note bytes that have been sent."""
        self._sent += count
        self._marks.append((self._sent, now_s))

    def acknowledged(self, total: int, now_s: float) -> None:
        """Note how many bytes the viewer has had in all."""
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
        if answer_s > self._quickest[0][1] + _QUEUED_S:
            if now_s - self._shrunk_s > answer_s:  # once for what is under way
                self._window = max(_LEAST_BYTES, self._window * _SHRINK)
                self._shrunk_s = now_s
        elif was_full:
            self._window = min(_MOST_BYTES, self._window + 0.5 * new)

    def _count(self, new: int, now_s: float) -> None:
        self._rate_bytes += new
        passed_s = now_s - self._rate_begin_s
        if passed_s > _RATE_S:
            self._bytes_s = self._rate_bytes / passed_s
            self._rate_begin_s, self._rate_bytes = now_s, 0
