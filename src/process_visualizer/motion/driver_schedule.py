"""The even times at which a driver measures, from the times at which its messages came."""
from __future__ import annotations

from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

_MEMORY = 250  # messages
_LEAST = 40
_BLOCK = 10  # messages from one fit to the next
_MOST_OFF = 0.35  # of a period: a message that is further from its place tells nothing
_MOST_OFF_RUNNING = 10  # so many such messages one after another: the driver began anew
_MOST_SPREAD = 0.15  # of a period, half of the messages: more is no even driver
_MOST_LOST = 25  # messages in one gap


class _Line(NamedTuple):
    """Message number n was measured at ``begin_s + step_s * (n - first)``."""

    first: int
    begin_s: float
    step_s: float

    def at(self, number: int) -> float:
        return self.begin_s + self.step_s * (number - self.first)


class DriverSchedule:
    """Lays the messages of a driver that measures at even times on the line of these times.

    A message comes some time after it was measured, and that time varies. The messages are
    numbered (a gap of several periods counts as so many), and the line through their times is
    that of least squares; where a message stands on it does not depend on how late it came.

    A driver whose messages do not keep to a line (no period, measured whenever it gets to it) keeps
    the times at which they came, and so does one that has just begun, or begun anew.
    """

    def __init__(self) -> None:
        self._known: Deque[Tuple[int, float]] = deque(maxlen=_MEMORY)
        self.reset()

    def reset(self) -> None:
        """Forget all messages: after a discontinuity."""
        self._known.clear()
        self._line: Optional[_Line] = None
        self._number = self._off = self._countdown = 0
        self._last_s = 0.0

    def measured_s(self, time_s: float, period_s: float) -> float:
        """Add a message; return when it was measured [s].

        Args:
            time_s: when it came, as far as that is known; backwards in playback backwards.
            period_s: the driver's; 0 where it has none.
        """
        if not period_s:
            self.reset()
            return time_s
        steps = max(1, round(self._since_last_s(time_s) / period_s))
        if steps > _MOST_LOST:
            self.reset()
        self._last_s = time_s
        self._number += steps
        return self._placed(time_s, period_s)

    def _since_last_s(self, time_s: float) -> float:
        if self._line is None:
            return abs(time_s - self._last_s)
        since_s = time_s - self._line.at(self._number)
        return since_s if self._line.step_s > 0.0 else -since_s

    def _placed(self, time_s: float, period_s: float) -> float:
        if self._line is None:
            self._learn(time_s, period_s)
            return time_s
        place_s = self._line.at(self._number)
        if abs(time_s - place_s) <= _MOST_OFF * period_s:
            self._off = 0
            self._learn(time_s, period_s)
            return place_s
        self._off += 1
        if self._off >= _MOST_OFF_RUNNING:
            self.reset()
            return time_s
        return place_s

    def _learn(self, time_s: float, period_s: float) -> None:
        self._known.append((self._number, time_s))
        self._countdown -= 1
        if self._countdown <= 0 and len(self._known) >= _LEAST:
            self._countdown = _BLOCK
            self._line = self._fit(period_s)

    def _fit(self, period_s: float) -> Optional[_Line]:
        """Return the line of least squares; None if the messages do not keep to it."""
        known = list(self._known)
        line = _least_squares(known)
        off_s = sorted(abs(time_s - line.at(number)) for number, time_s in known)
        return line if off_s[len(known) // 2] <= _MOST_SPREAD * period_s else None


def _least_squares(points: List[Tuple[int, float]]) -> _Line:
    first, first_s = points[0]
    count = len(points)
    mean = sum(number - first for number, _ in points) / count
    mean_s = sum(time_s - first_s for _, time_s in points) / count
    inertia = slope = 0.0
    for number, time_s in points:
        lever = number - first - mean
        inertia += lever * lever
        slope += lever * (time_s - first_s)
    step_s = slope / inertia
    return _Line(first, first_s + mean_s - step_s * mean, step_s)
