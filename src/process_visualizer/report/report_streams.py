# SPDX-License-Identifier: BSD-3-Clause
"""Finds what is missing in the stream of a topic, from the times and numbers of its messages."""
from __future__ import annotations

from typing import List, NamedTuple, Tuple

import numpy as np

GAP_FACTOR = 3.0
_LEAST_MESSAGES = 10
"""With fewer messages the usual interval is not known."""
_CATCH_UP_S = 5.0
_CATCH_UP_INTERVALS = 20.0
"""How late messages may come, whichever is longer."""
_LEAST_MISSING = 1.5
_SPAN_MESSAGES = 100


class StreamGap(NamedTuple):
    """A place where sequence numbers are missing, or where the messages paused.

    ``begin_ns`` is the time of the last message before [ns since the epoch]; ``missing`` is the
    number of missing sequence numbers (``is_numbered``), otherwise about how many messages would
    have come at the usual rate.
    """

    begin_ns: int
    duration_s: float
    missing: int
    is_numbered: bool


class Stream(NamedTuple):
    """A topic's messages in the order of time.

    ``sequence`` are the numbers in their headers (int64), -1 where there is none, ``publisher``
    a number for the publisher of each.
    """

    time_ns: np.ndarray
    sequence: np.ndarray
    publisher: np.ndarray


def find_gaps(stream: Stream) -> Tuple[StreamGap, ...]:
    """Return the gaps of a stream in the order of time: those of each of its publishers.

    If the numbers of a publisher grow, they show what is missing. Otherwise an interval
    of more than three times the publisher's usual one (the median) is a gap, unless the messages
    are only late: a busy computer delivers many at once, and some seconds later no message is
    missing.
    """
    found: List[StreamGap] = []
    for publisher in np.unique(stream.publisher):
        rows = np.flatnonzero(stream.publisher == publisher)
        found += _gaps(stream.time_ns[rows], _steps(stream.sequence[rows]))
    return tuple(sorted(found))


def _gaps(time_ns: np.ndarray, step: np.ndarray) -> List[StreamGap]:
    """The gaps of one publisher, by how much the number of each message grew (0: unknown)."""
    rows = np.flatnonzero(step > 1)
    found = _as_gaps(time_ns, rows - 1, step[rows] - 1, True)
    if len(time_ns) >= _LEAST_MESSAGES:
        intervals_s = np.diff(time_ns) / 1e9
        long = intervals_s > GAP_FACTOR * np.median(intervals_s)
        rows = np.flatnonzero(long & (step[1:] <= 0))
        missing = _missing_behind(time_ns, rows)
        kept = missing >= _LEAST_MISSING
        found += _as_gaps(time_ns, rows[kept], np.rint(missing[kept]).astype(np.int64), False)
    return found


def _as_gaps(time_ns: np.ndarray, before: np.ndarray, missing: np.ndarray,
             is_numbered: bool) -> List[StreamGap]:
    begin_ns = time_ns[before]
    durations_s = (time_ns[before + 1] - begin_ns) / 1e9
    return [StreamGap(*gap, is_numbered)
            for gap in zip(begin_ns.tolist(), durations_s.tolist(), missing.tolist())]


def _steps(numbers: np.ndarray) -> np.ndarray:
    """By how much the number of each message grew since the last one (0: unknown)."""
    step = np.zeros(len(numbers), np.int64)
    known = (numbers[1:] >= 0) & (numbers[:-1] >= 0)
    step[1:] = np.where(known, np.maximum(np.diff(numbers), 0), 0)
    return step


def _missing_behind(time_ns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """About how many messages (float) are missing after each, and do not come late either."""
    usual_ns = usual_interval_ns(time_ns)
    catch_up_ns = max(_CATCH_UP_S * 1e9, _CATCH_UP_INTERVALS * usual_ns)
    # how far each message is behind a stream without gaps; what comes late is not, in the end
    behind = (time_ns - time_ns[0]) / usual_ns - np.arange(len(time_ns))
    last = np.searchsorted(time_ns, time_ns[rows + 1] + catch_up_ns, side='right')
    return range_minima(behind, rows + 1, last) - behind[rows]


def range_minima(values: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the least value of each range of rows, none of which is empty."""
    found = np.full(len(begin), np.inf)
    level = np.log2(end - begin).astype(np.int64)  # two such powers of two cover a range
    table, width = values, 1
    for power in range(int(level.max(initial=-1)) + 1):
        chosen = level == power
        found[chosen] = np.minimum(table[begin[chosen]], table[end[chosen] - width])
        table, width = np.minimum(table[:-width], table[width:]), 2 * width
    return found


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
    """Return the jumps of a clock, at which written times go back by more than a limit.

    Each is the time after it [ns] and how far it went [s, negative].
    """
    steps_s = np.diff(time_ns) / 1e9
    return [(int(time_ns[row + 1]), float(steps_s[row]))
            for row in np.flatnonzero(steps_s < -least_s).tolist()]
