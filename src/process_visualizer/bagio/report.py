# SPDX-License-Identifier: BSD-3-Clause
"""The report on a recording; decides whether it is complete (verdict); as text and as JSON."""
from __future__ import annotations

import json
import time
from collections import defaultdict
from enum import Enum
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.json_text import finite_number
from process_visualizer.bagio.marks import Mark, read_marks
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import ACCOUNT, MARKS, last_json, texts
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.stream_gaps import (
    Stream,
    StreamGap,
    backward_jumps,
    find_gaps,
    header_numbers,
    largest_interval,
)
from process_visualizer.ros_names import OWN_TOPICS
from process_visualizer.shown_text import shown_in_line

_MIN_JUMP_S = 0.1
_END_OF_TIME_S = 1 << 32  # of ROS time
_RARE = 0.1
"""Share of skipped numbers above which the publisher does not number all of its messages."""


class Completeness(Enum):
    """The completeness of a recording, as far as is known."""

    COMPLETE = 'complete'
    INCOMPLETE = 'not complete'
    UNKNOWN = 'nothing is known to be missing'
    EMPTY = 'empty'


class ClockJump(NamedTuple):
    """A jump of the recording computer's clock: the time after it [ns], and its size [s]."""

    time_ns: int
    seconds: float


class TopicReport(NamedTuple):
    """A topic of a recording.

    ``largest_interval_s`` begins at ``largest_interval_ns`` [since the epoch]. ``gaps`` are those
    in the topic's messages; ``lost`` counts the losses known from them: messages that never reached
    the recorder. ``dropped`` counts messages that the recorder received but could not write (None:
    no account). ``untimed`` counts messages without a usable time.
    """

    topic: str
    types: Tuple[str, ...]
    message_count: int
    rate_hz: float
    largest_interval_s: float
    largest_interval_ns: int
    gaps: Tuple[StreamGap, ...]
    dropped: Optional[int]
    lost: int
    untimed: int = 0


class Report(NamedTuple):
    """A whole report; times in ns since the epoch.

    ``remarks`` are further notes on the files for the reader.
    """

    files: Tuple[str, ...]
    begin_ns: int
    end_ns: int
    topics: Tuple[TopicReport, ...]
    clock_jumps: Tuple[ClockJump, ...]
    marks: Tuple[Mark, ...]
    unreadable: Tuple[str, ...]
    has_account: bool
    remarks: Tuple[str, ...] = ()

    @property
    def completeness(self) -> Completeness:
        """Return the completeness, as far as the account and the readable parts show.

        A gap counts only if messages were lost: another program's bag may have a throttled topic.
        """
        if self.unreadable or any(it.lost or it.dropped for it in self.topics):
            return Completeness.INCOMPLETE
        if not any(it.message_count for it in self.topics):
            return Completeness.EMPTY
        return Completeness.COMPLETE if self.has_account else Completeness.UNKNOWN

    @property
    def is_good(self) -> bool:
        """Return whether the recording has messages and none is known to be missing."""
        return self.completeness in (Completeness.COMPLETE, Completeness.UNKNOWN)


def make_report(recording: Recording) -> Report:
    """Return the report on a recording; reads the beginning of every message.

    Raises:
        BagError: a file of marks beside a bag is invalid.
    """
    account = last_json(recording, ACCOUNT)
    # each file of a recording ends with an account, except for repaired files
    has_account = account is not None and len(texts(recording, ACCOUNT)) >= len(recording.paths)
    recording.check_chunks()
    topics = tuple(_topic_reports(recording, account))
    return Report(recording.paths, recording.index.begin_ns, recording.index.end_ns, topics,
                  _clock_jumps(recording, account), tuple(read_marks(recording)),
                  tuple(str(gap) for gap in recording.gaps), has_account, recording.remarks)


def _topics(recording: Recording, account: Optional[Dict[str, Any]]) -> List[str]:
    """Return the devices' topics in order, including recorded topics without messages."""
    topics = {connection.topic for connection in recording.index.connections}
    topics.update(_accounted(account))
    return sorted(topic for topic in topics if not topic.startswith(OWN_TOPICS))


def _topic_reports(recording: Recording,
                   account: Optional[Dict[str, Any]]) -> Iterator[TopicReport]:
    index = recording.index
    sequence, publishers = header_numbers(recording), _publishers(index.connections)
    accounted = None if account is None else _accounted(account)
    untimed: Dict[str, int] = defaultdict(int)
    for it in index.strays:
        untimed[it.topic] += it.message_count
    for topic in _topics(recording, account):
        positions = index.positions_of(index.connections_of(topic))
        stream = Stream(index.time_ns[positions], sequence[positions],
                        publishers[index.connection[positions]])
        connections = [index.connections[it] for it in index.connections_of(topic)]
        yield _topic_report(topic, connections, stream, untimed[topic], accounted)


def _topic_report(topic: str, connections: Sequence[Connection], stream: Stream, untimed: int,
                  accounted: Optional[Dict[str, Any]]) -> TopicReport:
    times_ns = stream.time_ns
    # A latching publisher sends when something changes, so it has no usual interval.
    gaps = () if any(it.latching for it in connections) else find_gaps(stream)
    duration_s = float(times_ns[-1] - times_ns[0]) / 1e9 if len(times_ns) else 0.0
    dropped = _dropped(accounted, topic)
    return TopicReport(topic, tuple(sorted({it.type for it in connections})), len(times_ns),
                       (len(times_ns) - 1) / duration_s if duration_s else 0.0,
                       *largest_interval(times_ns), gaps, dropped,
                       0 if accounted is None else
                       _lost(gaps, len(times_ns), untimed + (dropped or 0)), untimed)


def _publishers(connections: Sequence[Connection]) -> np.ndarray:
    """Return a number (int64) for the node of each connection, the same after a restart."""
    nodes: Dict[str, int] = {}
    return np.array([nodes.setdefault(it.caller_id or f'unknown {number}', len(nodes))
                     for number, it in enumerate(connections)], np.int64)


def _lost(gaps: Tuple[StreamGap, ...], message_count: int, others: int) -> int:
    """Return the number of messages that never arrived; 0 if numbers are skipped regularly.

    A throttled topic has the sequence numbers of its source. ``others`` counts messages that did
    arrive, but are not among the messages: without a usable time, or dropped by the recorder.
    """
    left_out = [gap.missing for gap in gaps if gap.is_numbered]
    if len(left_out) > max(_RARE * message_count, 1):
        return 0
    return max(sum(left_out) - others, 0)


def _dropped(accounted: Optional[Dict[str, Any]], topic: str) -> Optional[int]:
    if accounted is None:
        return None
    entry = accounted.get(topic)
    count = entry.get('dropped') if isinstance(entry, dict) else 0
    return count if isinstance(count, int) and count >= 0 else None


def _accounted(account: Optional[Dict[str, Any]]) -> Dict[str, Any]:
    topics = account.get('topics') if account is not None else None
    topics = topics if isinstance(topics, dict) else {}
    return {name: entry for name, entry in topics.items() if name.isprintable()}


def _clock_jumps(recording: Recording, account: Optional[Dict[str, Any]]) -> Tuple[ClockJump, ...]:
    """Return the jumps that the recorder noticed; in other bags, those where times go back."""
    if account is not None:
        jumps = account.get('clock_jumps')
        noticed = map(_clock_jump, jumps if isinstance(jumps, list) else ())
        return tuple(jump for jump in noticed if jump is not None)
    index = recording.index
    # Skip times that were replaced by the first one, and marks, which may wait for a hung recorder.
    others = {*(it.topic for it in index.strays), MARKS}
    timed = np.array([it.topic not in others for it in index.connections], bool)[index.connection]
    as_written = np.lexsort((index.offset[timed], index.chunk[timed]))
    return tuple(ClockJump(*jump)
                 for jump in backward_jumps(index.time_ns[timed][as_written], _MIN_JUMP_S))


def _clock_jump(value: Any) -> Optional[ClockJump]:
    """Return a jump from the account, or None if it is invalid."""
    try:
        time_s, seconds = finite_number(value['time']), finite_number(value['seconds'])
    except (KeyError, TypeError, ValueError):
        return None
    return ClockJump(int(time_s * 1e9), seconds) if 0 <= time_s < _END_OF_TIME_S else None


_MAX_GAPS = 10
_MAX_LISTED = 5
_KNOWN = {
    Completeness.COMPLETE: 'complete',
    Completeness.INCOMPLETE: 'not complete',
    Completeness.UNKNOWN: 'nothing is known to be missing (its recorder left no account of what it '
                          'dropped)',
    Completeness.EMPTY: 'empty: it holds no messages'}


def verdict(report: Report) -> str:
    """Return one line that says whether the recording is complete, or what is missing."""
    known = ': '.join([_KNOWN[report.completeness], *filter(None, ['; '.join(_missing(report))])])
    return '; '.join([known, *_untimed(report), *_silent(report), *_jumped(report)])


def _missing(report: Report) -> List[str]:
    """Return what is known to be missing."""
    parts = []
    lost = sum(topic.lost for topic in report.topics)
    if lost:
        topics = _listed([topic.topic for topic in report.topics if topic.lost])
        parts.append(f'{lost} lost on {topics}')
    dropped = sum(topic.dropped or 0 for topic in report.topics)
    if dropped:
        parts.append(f'{dropped} dropped by the recorder')
    if report.unreadable:
        parts.append('a part of the file cannot be read')
    return parts


def _untimed(report: Report) -> List[str]:
    count = sum(topic.untimed for topic in report.topics)
    some = 'one message has' if count == 1 else f'{count} messages have'
    return [f'{some} no usable time'] if count else []


def _silent(report: Report) -> List[str]:
    topics = [topic.topic for topic in report.topics
              if not topic.message_count and not topic.untimed]
    return ['nothing was received on ' + _listed(topics)] if topics else []


def _jumped(report: Report) -> List[str]:
    count = len(report.clock_jumps)
    times = 'once' if count == 1 else f'{count} times'
    return [f'the clock jumped {times}, so times on both sides do not fit'] if count else []


def _listed(names: List[str]) -> str:
    more = len(names) - _MAX_LISTED
    return ', '.join(names[:_MAX_LISTED]) + (f' and {more} more' if more > 0 else '')


def as_text(report: Report) -> str:
    """Return the report as lines of text; times are relative to the beginning of the recording."""
    duration_s = (report.end_ns - report.begin_ns) / 1e9
    begin = time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(report.begin_ns / 1e9))
    lines = [*report.files, f'begin {begin}, duration {duration_s:.1f} s', '', *_table(report), '']
    for topic in report.topics:
        lines += _gap_lines(topic, report.begin_ns)
    for jump in report.clock_jumps:
        lines.append(f'the clock jumped by {jump.seconds:+.3f} s '
                     f'at {_clock(jump.time_ns - report.begin_ns)}')
    lines += [f'mark at {_clock(mark.time_ns - report.begin_ns)}: {mark.label}'
              for mark in report.marks]
    lines += [*report.remarks, *report.unreadable, f'verdict: {verdict(report)}']
    return '\n'.join(map(shown_in_line, lines))


def as_json(report: Report) -> str:
    """Return the report as JSON; times in s since the epoch."""
    return json.dumps({
        'files': list(report.files), 'begin': report.begin_ns / 1e9, 'end': report.end_ns / 1e9,
        'complete': _as_bool(report.completeness), 'verdict': verdict(report),
        'has_account': report.has_account,
        'topics': [_topic_json(topic) for topic in report.topics],
        'clock_jumps': [{'time': it.time_ns / 1e9, 'seconds': it.seconds}
                        for it in report.clock_jumps],
        'marks': [{'time': it.time_ns / 1e9, 'label': it.label} for it in report.marks],
        'unreadable': list(report.unreadable), 'remarks': list(report.remarks)},
                      indent=1)


def _as_bool(completeness: Completeness) -> Optional[bool]:
    """Return whether the recording is complete; None if that is unknown."""
    return None if completeness is Completeness.UNKNOWN else completeness is Completeness.COMPLETE


def _topic_json(topic: TopicReport) -> 'dict[str, object]':
    return {'topic': topic.topic, 'types': list(topic.types), 'messages': topic.message_count,
            'rate_hz': topic.rate_hz, 'largest_interval_s': topic.largest_interval_s,
            'largest_interval_at': topic.largest_interval_ns / 1e9, 'lost': topic.lost,
            'dropped': topic.dropped, 'without_time': topic.untimed,
            'gaps': [{'at': gap.begin_ns / 1e9, 'duration_s': gap.duration_s,
                      'missing': gap.missing, 'exact': gap.is_numbered} for gap in topic.gaps]}


def _table(report: Report) -> List[str]:
    width = max([len(topic.topic) for topic in report.topics], default=5)
    head = (f'{"topic":{width}}  {"messages":>9} {"Hz":>8} {"longest interval":>22} '
            f'{"lost":>6} {"dropped":>8} {"gaps":>5}')
    return [head, *(_row(topic, width, report.begin_ns) for topic in report.topics)]


def _row(topic: TopicReport, width: int, begin_ns: int) -> str:
    dropped = '?' if topic.dropped is None else str(topic.dropped)
    longest = ''
    if topic.message_count > 1:
        at = _clock(topic.largest_interval_ns - begin_ns)
        longest = f'{topic.largest_interval_s:.3f} s at {at}'
    return (f'{topic.topic:{width}}  {topic.message_count:>9} {topic.rate_hz:>8.2f} {longest:>22} '
            f'{topic.lost:>6} {dropped:>8} {len(topic.gaps):>5}')


def _gap_lines(topic: TopicReport, begin_ns: int) -> List[str]:
    lines = [_gap_line(topic, gap, begin_ns) for gap in topic.gaps[:_MAX_GAPS]]
    if len(topic.gaps) > _MAX_GAPS:
        lines.append(f'{topic.topic}: and {len(topic.gaps) - _MAX_GAPS} more')
    return lines


def _gap_line(topic: TopicReport, gap: StreamGap, begin_ns: int) -> str:
    where = f'{topic.topic} at {_clock(gap.begin_ns - begin_ns)} for {gap.duration_s:.3f} s'
    if not gap.is_numbered:
        return f'{where}: no message (about {gap.missing} at its usual rate)'
    if topic.lost:
        return f'{where}: {gap.missing} lost'
    return f'{where}: {gap.missing} sequence numbers missing (lost, or skipped by the publisher)'


def _clock(offset_ns: int) -> str:
    """Return a time since the beginning as m:ss.mmm."""
    minutes, rest_ms = divmod(round(offset_ns / 1e6), 60_000)
    return f'{minutes}:{rest_ms / 1e3:06.3f}'
