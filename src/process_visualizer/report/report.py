# SPDX-License-Identifier: BSD-3-Clause
"""The report on a recording: its contents, what is missing, and whether it is complete."""
from __future__ import annotations

from enum import Enum
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bags.json_text import finite_number
from process_visualizer.bags.marks import Mark, read_marks
from process_visualizer.bags.recorder_topics import ACCOUNT, last_json, texts
from process_visualizer.bags.recording import Recording
from process_visualizer.messages.connection import Connection
from process_visualizer.report.header_numbers import header_numbers
from process_visualizer.report.report_streams import (
    Stream,
    StreamGap,
    backward_jumps,
    find_gaps,
    largest_interval,
)
from process_visualizer.ros_names import OWN_TOPICS

_LEAST_JUMP_S = 0.1
_END_OF_TIME_S = 1 << 32  # of ROS
_RARE = 0.1
"""A publisher that skips numbers more often than this does not number all its messages."""


class Completeness(Enum):
    """The completeness of a recording, as far as it is known."""

    COMPLETE = 'complete'
    INCOMPLETE = 'not complete'
    UNKNOWN = 'nothing is known to be missing'
    EMPTY = 'empty'


class ClockJump(NamedTuple):
    """A jump of the recording computer's clock: the time after it [ns], and how far it went [s]."""

    time_ns: int
    seconds: float


class TopicReport(NamedTuple):
    """A topic of a recording.

    ``largest_interval_s`` begins at ``largest_interval_ns`` [since the epoch]. ``gaps`` can be
    seen in its messages; ``lost`` counts the known losses among them: messages that never reached
    the recorder. ``dropped`` counts messages that it received and could not write, None without an
    account. ``untimed`` are those without a usable time.
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

    ``remarks`` are what else its reader should know of the files.
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
        """Return whether it is complete, as far as the account and the readable parts show.

        Gaps count only if they are losses: a foreign bag may have a throttled topic.
        """
        if self.unreadable or any(it.lost or it.dropped for it in self.topics):
            return Completeness.INCOMPLETE
        if not any(it.message_count for it in self.topics):
            return Completeness.EMPTY
        return Completeness.COMPLETE if self.has_account else Completeness.UNKNOWN

    @property
    def is_good(self) -> bool:
        """Return whether it has messages and nothing is known to be missing."""
        return self.completeness in (Completeness.COMPLETE, Completeness.UNKNOWN)


def make_report(recording: Recording) -> Report:
    """Return the report on a recording; reads all messages of types with a header.

    Raises:
        BagError: a file of marks beside a bag is not one.
    """
    account = last_json(recording, ACCOUNT)
    # each file of a recording ends with one; a file that was repaired has none
    has_account = account is not None and len(texts(recording, ACCOUNT)) >= len(recording.paths)
    recording.check_chunks()
    sequence = header_numbers(recording)
    topics = tuple(_topic_report(recording, topic, sequence, account)
                   for topic in _topics(recording, account))
    return Report(recording.paths, recording.index.begin_ns, recording.index.end_ns, topics,
                  _clock_jumps(recording, account), tuple(read_marks(recording)),
                  tuple(str(gap) for gap in recording.gaps), has_account, recording.remarks)


def _topics(recording: Recording, account: Optional[Dict[str, Any]]) -> List[str]:
    """The devices' topics in order, including recorded ones without messages."""
    topics = {connection.topic for connection in recording.index.connections}
    topics.update(_accounted(account))
    return sorted(topic for topic in topics if not topic.startswith(OWN_TOPICS))


def _topic_report(recording: Recording, topic: str, sequence: np.ndarray,
                  account: Optional[Dict[str, Any]]) -> TopicReport:
    index = recording.index
    numbers = index.connections_of(topic)
    positions = index.positions_of(numbers)
    connections = [index.connections[number] for number in numbers]
    times_ns = index.time_ns[positions]
    stream = Stream(times_ns, sequence[positions],
                    _publishers(index.connections)[index.connection[positions]])
    # A latching publisher speaks when something changes: no interval of it is usual.
    gaps = () if any(it.latching for it in connections) else find_gaps(stream)
    duration_s = float(times_ns[-1] - times_ns[0]) / 1e9 if len(times_ns) else 0.0
    untimed = sum(it.message_count for it in index.strays if it.topic == topic)
    return TopicReport(topic, tuple(sorted({it.type for it in connections})), len(positions),
                       (len(positions) - 1) / duration_s if duration_s else 0.0,
                       *largest_interval(times_ns), gaps, _dropped(account, topic),
                       0 if account is None else _lost(gaps, len(positions), untimed),
                       untimed)


def _publishers(connections: Sequence[Connection]) -> np.ndarray:
    """Return a number (int64) for the node of each connection; a restarted node keeps it."""
    nodes: Dict[str, int] = {}
    return np.array([nodes.setdefault(it.caller_id or f'unknown {number}', len(nodes))
                     for number, it in enumerate(connections)], np.int64)


def _lost(gaps: Tuple[StreamGap, ...], message_count: int, untimed: int) -> int:
    """Return how many messages never arrived, if numbers are missing now and then only.

    A topic that comes through a throttle has the numbers of its source. Messages without a usable
    time did arrive.
    """
    left_out = [gap.missing for gap in gaps if gap.is_numbered]
    if len(left_out) > max(_RARE * message_count, 1):
        return 0
    return max(sum(left_out) - untimed, 0)


def _dropped(account: Optional[Dict[str, Any]], topic: str) -> Optional[int]:
    if account is None:
        return None
    entry = _accounted(account).get(topic)
    count = entry.get('dropped') if isinstance(entry, dict) else 0
    return count if isinstance(count, int) and count >= 0 else None


def _accounted(account: Optional[Dict[str, Any]]) -> Dict[str, Any]:
    topics = account.get('topics') if account is not None else None
    topics = topics if isinstance(topics, dict) else {}
    return {name: entry for name, entry in topics.items() if name.isprintable()}


def _clock_jumps(recording: Recording, account: Optional[Dict[str, Any]]) -> Tuple[ClockJump, ...]:
    """Jumps that the recorder noticed; in other recorders' bags, where the times go back."""
    if account is not None:
        jumps = account.get('clock_jumps')
        noticed = map(_clock_jump, jumps if isinstance(jumps, list) else ())
        return tuple(jump for jump in noticed if jump is not None)
    index = recording.index
    moved = {it.topic for it in index.strays}  # to the beginning
    timed = np.array([it.topic not in moved for it in index.connections], bool)[index.connection]
    as_written = np.lexsort((index.offset[timed], index.chunk[timed]))
    return tuple(ClockJump(*jump)
                 for jump in backward_jumps(index.time_ns[timed][as_written], _LEAST_JUMP_S))


def _clock_jump(value: Any) -> Optional[ClockJump]:
    """A jump from the account, None if it is not one."""
    try:
        time_s, seconds = finite_number(value['time']), finite_number(value['seconds'])
    except (KeyError, TypeError, ValueError):
        return None
    return ClockJump(int(time_s * 1e9), seconds) if 0 <= time_s < _END_OF_TIME_S else None
