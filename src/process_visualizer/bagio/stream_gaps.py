# SPDX-License-Identifier: BSD-3-Clause
"""Decides where messages of a topic are missing, from their times and sequence numbers."""
from __future__ import annotations

from typing import List, NamedTuple, Tuple

import numpy as np

from process_visualizer.bagio.message_definition import (
    HEADER,
    Connection,
    DefinitionError,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.recording import (
    U32_BYTES,
    RecordBatch,
    Recording,
    record_batches,
)

GAP_FACTOR = 3.0
_MIN_MESSAGES = 10
"""Minimum number of messages for a usual interval."""
_CATCH_UP_S = 5.0
_CATCH_UP_INTERVALS = 20.0
"""Maximum delay of late messages, in seconds and in usual intervals; the longer one applies."""
_MIN_MISSING = 1.5
_SPAN_MESSAGES = 100


class StreamGap(NamedTuple):
    """An interval in which sequence numbers are missing, or the messages paused.

    ``begin_ns`` is the time of the last message before the gap [ns since the epoch]; ``missing`` is
    the number of missing sequence numbers (if ``is_numbered``), or else roughly the number of
    messages that the usual rate would have given.
    """

    begin_ns: int
    duration_s: float
    missing: int
    is_numbered: bool


class Stream(NamedTuple):
    """The messages of a topic in the order of time.

    ``sequence`` has the sequence numbers of their headers (int64; -1: none), ``publisher`` a number
    for the publisher of each message.
    """

    time_ns: np.ndarray
    sequence: np.ndarray
    publisher: np.ndarray


def find_gaps(stream: Stream) -> Tuple[StreamGap, ...]:
    """Return the gaps of all publishers of a stream, in the order of time.

    If the sequence numbers of a publisher increase, they show what is missing. Otherwise an
    interval of more than three times the publisher's usual interval (the median) is a gap, unless
    the messages are only late: a busy computer may deliver many at once, so that some seconds later
    no message is missing.
    """
    found: List[StreamGap] = []
    for publisher in np.unique(stream.publisher):
        rows = np.flatnonzero(stream.publisher == publisher)
        found += _gaps(stream.time_ns[rows], _steps(stream.sequence[rows]))
    return tuple(sorted(found))


def _gaps(time_ns: np.ndarray, step: np.ndarray) -> List[StreamGap]:
    """Return the gaps of one publisher; ``step`` is the increment of the numbers (0: unknown)."""
    rows = np.flatnonzero(step > 1)
    found = _as_gaps(time_ns, rows - 1, step[rows] - 1, True)
    if len(time_ns) >= _MIN_MESSAGES:
        intervals_s = np.diff(time_ns) / 1e9
        long = intervals_s > GAP_FACTOR * np.median(intervals_s)
        rows = np.flatnonzero(long & (step[1:] <= 0))
        missing = _missing_behind(time_ns, rows)
        kept = missing >= _MIN_MISSING
        found += _as_gaps(time_ns, rows[kept], np.rint(missing[kept]).astype(np.int64), False)
    return found


def _as_gaps(time_ns: np.ndarray, before: np.ndarray, missing: np.ndarray,
             is_numbered: bool) -> List[StreamGap]:
    begin_ns = time_ns[before]
    durations_s = (time_ns[before + 1] - begin_ns) / 1e9
    return [StreamGap(*gap, is_numbered)
            for gap in zip(begin_ns.tolist(), durations_s.tolist(), missing.tolist())]


def _steps(numbers: np.ndarray) -> np.ndarray:
    """Return the increment of each number since the previous message (0: unknown)."""
    step = np.zeros(len(numbers), np.int64)
    known = (numbers[1:] >= 0) & (numbers[:-1] >= 0)
    step[1:] = np.where(known, np.maximum(np.diff(numbers), 0), 0)
    return step


def _missing_behind(time_ns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Estimate the number (float) of messages missing after each row, not counting late ones."""
    usual_ns = usual_interval_ns(time_ns)
    catch_up_ns = max(_CATCH_UP_S * 1e9, _CATCH_UP_INTERVALS * usual_ns)
    # number of intervals by which each message is behind a stream without gaps; late messages
    # catch up in the end
    behind = (time_ns - time_ns[0]) / usual_ns - np.arange(len(time_ns))
    last = np.searchsorted(time_ns, time_ns[rows + 1] + catch_up_ns, side='right')
    return range_minima(behind, rows + 1, last) - behind[rows]


def range_minima(values: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the minimum of each range of rows; no range may be empty."""
    found = np.full(len(begin), np.inf)
    level = np.log2(end - begin).astype(np.int64)  # two ranges of this power of two cover it
    table, width = values, 1
    for power in range(int(level.max(initial=-1)) + 1):
        chosen = level == power
        found[chosen] = np.minimum(table[begin[chosen]], table[end[chosen] - width])
        table, width = np.minimum(table[:-width], table[width:]), 2 * width
    return found


def usual_interval_ns(time_ns: np.ndarray) -> float:
    """Return the usual interval [ns], measured over many messages so that jitter cancels out."""
    # shorter spans in short recordings, so that few spans contain a gap
    span = max(min(_SPAN_MESSAGES, len(time_ns) // 8), 1)
    return max(float(np.median(time_ns[span:] - time_ns[:-span])) / span, 1.0)


def largest_interval(time_ns: np.ndarray) -> Tuple[float, int]:
    """Return the longest interval [s] and its start [ns]; zeros for fewer than two times."""
    if len(time_ns) < 2:
        return 0.0, 0
    row = int(np.argmax(np.diff(time_ns)))
    return float(time_ns[row + 1] - time_ns[row]) / 1e9, int(time_ns[row])


def backward_jumps(time_ns: np.ndarray, least_s: float) -> List[Tuple[int, float]]:
    """Return the backward jumps of a clock by more than ``least_s``.

    Each jump is the time after it [ns] and its size [s, negative].
    """
    steps_s = np.diff(time_ns) / 1e9
    return [(int(time_ns[row + 1]), float(steps_s[row]))
            for row in np.flatnonzero(steps_s < -least_s).tolist()]


_HEAD_BYTES = 512
"""Bytes read of each record: its header has about 40 bytes, and the sequence number follows."""


def header_numbers(recording: Recording) -> np.ndarray:
    """Return the sequence numbers (int64) of all messages by position; -1 for no number.

    Messages that the index lists but the file lacks are added to ``recording.gaps``.
    """
    index = recording.index
    is_numbered = np.array([*map(begins_with_header, index.connections)], bool)[index.connection]
    found = np.full(len(index), -1, np.int64)
    for batch in record_batches(recording, np.arange(len(index)), _HEAD_BYTES):
        found[batch.positions] = np.where(is_numbered[batch.positions], _numbers_in(batch), -1)
    return found


def begins_with_header(connection: Connection) -> bool:
    """Return whether the messages of a connection begin with a std_msgs/Header."""
    try:
        definitions = parse_definitions(connection.type, connection.message_definition)
    except DefinitionError:
        return False
    fields = definitions.get(short_name(connection.type), [])
    return bool(fields) and fields[0].type_name == HEADER and not fields[0].is_array


def _numbers_in(batch: RecordBatch) -> np.ndarray:
    """Return the sequence numbers of a batch; header and data each follow their length."""
    header_size = batch.u32_at(batch.begin, batch.end)
    data = batch.begin + 2 * U32_BYTES + header_size
    data_size = batch.u32_at(data - U32_BYTES, batch.end)
    number = batch.u32_at(data, batch.end)
    return np.where((header_size >= 0) & (data_size >= U32_BYTES), number, -1)
