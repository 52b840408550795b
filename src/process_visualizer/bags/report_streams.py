"""Finds what is missing in the stream of a topic, from the times and numbers of its messages."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

import numpy as np

GAP_FACTOR = 3.0
_LEAST_MESSAGES = 10
"""With fewer it is not known which interval is usual."""
_CATCH_UP_S = 5.0
_CATCH_UP_INTERVALS = 20.0
"""How long messages may take to come late, whichever is longer."""
_LEAST_MISSING = 1.5
_SPAN_MESSAGES = 100


class StreamGap(NamedTuple):
    """A place where messages are missing.

    ``begin_ns`` is the time of the last message before [ns since the epoch]; ``missing`` is how
    many are missing: exact if they are numbered, else about.
    """

    begin_ns: int
    duration_s: float
    missing: int
    is_numbered: bool


class Stream(NamedTuple):
    """A topic's messages in the order of time.

    ``sequence`` are the numbers in their headers (int64), -1 where there is none, ``publisher``
    the number of the connection of each.
    """

    time_ns: np.ndarray
    sequence: np.ndarray
    publisher: np.ndarray


def find_gaps(stream: Stream) -> Tuple[StreamGap, ...]:
    """Return the gaps of a stream in the order of time.

    Messages of a publisher whose numbers grow show by them what is missing. Elsewhere an interval
    of more than three times the usual one (the median) is a gap, unless the messages only come
    late: a busy computer hands out many at once, and no message is missing some seconds later.
    """
    step = _steps(stream)
    intervals_s = np.diff(stream.time_ns) / 1e9
    found = [_numbered(stream, row, int(step[row])) for row in np.flatnonzero(step > 1).tolist()]
    if len(stream.time_ns) >= _LEAST_MESSAGES:
        long = intervals_s > GAP_FACTOR * np.median(intervals_s)
        for row in np.flatnonzero(long & (step[1:] <= 0)).tolist():
            gap = _unnumbered(stream.time_ns, row)
            if gap is not None:
                found.append(gap)
    return tuple(sorted(found))


def _steps(stream: Stream) -> np.ndarray:
    """By how much the number of each message grew since its publisher's last one; 0: unknown."""
    step = np.zeros(len(stream.time_ns), np.int64)
    for publisher in np.unique(stream.publisher):
        rows = np.flatnonzero(stream.publisher == publisher)
        numbers = stream.sequence[rows]
        known = (numbers[1:] >= 0) & (numbers[:-1] >= 0)
        step[rows[1:]] = np.where(known, np.maximum(np.diff(numbers), 0), 0)
    return step


def _numbered(stream: Stream, row: int, step: int) -> StreamGap:
    earlier = np.flatnonzero(stream.publisher[:row] == stream.publisher[row])[-1]
    begin_ns = int(stream.time_ns[earlier])
    return StreamGap(begin_ns, (int(stream.time_ns[row]) - begin_ns) / 1e9, step - 1, True)


def _unnumbered(time_ns: np.ndarray, row: int) -> Optional[StreamGap]:
    """The gap behind a message, if there are messages that do not come late either."""
    usual_ns = usual_interval_ns(time_ns)
    catch_up_ns = max(_CATCH_UP_S * 1e9, _CATCH_UP_INTERVALS * usual_ns)
    last = int(np.searchsorted(time_ns, float(time_ns[row + 1]) + catch_up_ns, side='right'))
    since_ns = time_ns[row + 1:last] - time_ns[row]
    missing = float(np.min(since_ns / usual_ns - np.arange(1, len(since_ns) + 1)))
    if missing < _LEAST_MISSING:
        return None
    return StreamGap(int(time_ns[row]), float(since_ns[0]) / 1e9, round(missing), False)


def usual_interval_ns(time_ns: np.ndarray) -> float:
    """Return the usual interval [ns], over many messages, so that jitter does not matter."""
    # of short recordings over less, so that a gap is in few of the spans
    span = max(min(_SPAN_MESSAGES, len(time_ns) // 8), 1)
    return max(float(np.median(time_ns[span:] - time_ns[:-span])) / span, 1.0)


def largest_interval(time_ns: np.ndarray) -> Tuple[float, int]:
    """Return the longest interval [s] and when it begins [ns]; zeros with less than two times."""
    if len(time_ns) < 2:
        return 0.0, 0
    row = int(np.argmax(np.diff(time_ns)))
    return float(time_ns[row + 1] - time_ns[row]) / 1e9, int(time_ns[row])


def backward_jumps(time_ns: np.ndarray, least_s: float) -> List[Tuple[int, float]]:
    """Return the jumps of a clock: times as they were written, that go back by more than a limit.

    Each is the time after it [ns] and how far it went [s, negative].
    """
    steps_s = np.diff(time_ns) / 1e9
    return [(int(time_ns[row + 1]), float(steps_s[row]))
            for row in np.flatnonzero(steps_s < -least_s).tolist()]
