# SPDX-License-Identifier: BSD-3-Clause
"""A report as text for people and as JSON for programs."""
from __future__ import annotations

import json
import time
from typing import List, Optional

from process_visualizer.bagio.report import Completeness, Report, StreamGap, TopicReport
from process_visualizer.shown_text import shown_in_line

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
