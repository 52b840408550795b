"""The report on a recording: what is in it, what is missing, and whether it is complete."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.bag_records import Connection
from process_visualizer.bags.marks import Mark, read_marks
from process_visualizer.bags.message_definition import DefinitionError, parse_definitions
from process_visualizer.bags.recorder_topics import ACCOUNT, PREFIX, last_json
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.report_streams import (
    Stream,
    StreamGap,
    backward_jumps,
    find_gaps,
    largest_interval,
)

_LEAST_JUMP_S = 0.1


class ClockJump(NamedTuple):
    """A jump of the recording computer's clock: the time after it [ns], and how far it went [s]."""

    time_ns: int
    seconds: float


class TopicReport(NamedTuple):
    """A topic of a recording.

    ``largest_interval_s`` begins at ``largest_interval_ns`` [since the epoch]. ``dropped`` is what
    the recorder received and could not write, None where it left no account.
    """

    topic: str
    types: Tuple[str, ...]
    message_count: int
    rate_hz: float
    largest_interval_s: float
    largest_interval_ns: int
    gaps: Tuple[StreamGap, ...]
    dropped: Optional[int]

    @property
    def lost(self) -> int:
        """How many messages never arrived, as their numbers tell."""
        return sum(gap.missing for gap in self.gaps if gap.is_numbered)


class Report(NamedTuple):
    """A whole report; times in ns since the epoch."""

    files: Tuple[str, ...]
    begin_ns: int
    end_ns: int
    topics: Tuple[TopicReport, ...]
    clock_jumps: Tuple[ClockJump, ...]
    marks: Tuple[Mark, ...]
    unreadable: Tuple[str, ...]
    has_account: bool

    @property
    def is_complete(self) -> bool:
        """Whether nothing is known to be missing."""
        return not self.unreadable and not any(it.gaps or it.dropped for it in self.topics)


def make_report(recording: Recording) -> Report:
    """Return the report on a recording; reads all messages of types with a header.

    Raises:
        BagError: a file of marks beside a bag is not one.
    """
    account = last_json(recording, ACCOUNT)
    topics = tuple(_topic_report(recording, topic, account)
                   for topic in _topics(recording, account))
    return Report(recording.paths, recording.index.begin_ns, recording.index.end_ns, topics,
                  _clock_jumps(recording, account), tuple(read_marks(recording)),
                  tuple(str(gap) for gap in recording.gaps), account is not None)


def _topics(recording: Recording, account: Optional[Dict[str, Any]]) -> List[str]:
    """The devices' topics in order, with those that were recorded though nothing came."""
    topics = {connection.topic for connection in recording.index.connections}
    topics.update(_accounted(account))
    return sorted(topic for topic in topics if not topic.startswith(PREFIX))


def _topic_report(recording: Recording, topic: str,
                  account: Optional[Dict[str, Any]]) -> TopicReport:
    index = recording.index
    numbers = index.connections_of(topic)
    positions = index.positions_of(numbers)
    connections = [index.connections[number] for number in numbers]
    times_ns = index.time_ns[positions]
    stream = Stream(times_ns, _sequence(recording, positions), index.connection[positions])
    # A latching publisher speaks when something changes: no interval of it is usual.
    gaps = () if any(it.latching for it in connections) else find_gaps(stream)
    duration_s = float(times_ns[-1] - times_ns[0]) / 1e9 if len(times_ns) else 0.0
    return TopicReport(topic, tuple(sorted({it.type for it in connections})), len(positions),
                       (len(positions) - 1) / duration_s if duration_s else 0.0,
                       *largest_interval(times_ns), gaps, _dropped(account, topic))


def _sequence(recording: Recording, positions: np.ndarray) -> np.ndarray:
    """The numbers in the messages' headers; -1 where there is none."""
    sequence = np.full(len(positions), -1, np.int64)
    connection = recording.index.connection[positions]
    for number in np.unique(connection).tolist():
        if begins_with_header(recording.index.connections[number]):
            for row in np.flatnonzero(connection == number).tolist():
                sequence[row] = _number_of(recording, int(positions[row]))
    return sequence


def _number_of(recording: Recording, position: int) -> int:
    try:
        head = bytes(recording.message(position)[:4])
    except BagDamaged:
        return -1
    return int.from_bytes(head, 'little') if len(head) == 4 else -1


def begins_with_header(connection: Connection) -> bool:
    """Return whether the messages begin with a std_msgs/Header."""
    try:
        definitions = parse_definitions(connection.type, connection.message_definition)
    except DefinitionError:
        return False
    fields = definitions.get(connection.type, [])
    return bool(fields) and fields[0].type_name == 'std_msgs/Header' and not fields[0].is_array


def _dropped(account: Optional[Dict[str, Any]], topic: str) -> Optional[int]:
    if account is None:
        return None
    entry = _accounted(account).get(topic)
    count = entry.get('dropped') if isinstance(entry, dict) else 0
    return count if isinstance(count, int) else None


def _accounted(account: Optional[Dict[str, Any]]) -> Dict[str, Any]:
    topics = account.get('topics') if account is not None else None
    return topics if isinstance(topics, dict) else {}


def _clock_jumps(recording: Recording, account: Optional[Dict[str, Any]]) -> Tuple[ClockJump, ...]:
    """What the recorder noticed; of other recorders' bags, where the times go back."""
    if account is not None:
        try:
            return tuple(ClockJump(int(jump['time'] * 1e9), float(jump['seconds']))
                         for jump in account['clock_jumps'])
        except (KeyError, TypeError):
            return ()
    index = recording.index
    as_written = np.lexsort((index.offset, index.chunk))
    return tuple(ClockJump(*jump)
                 for jump in backward_jumps(index.time_ns[as_written], _LEAST_JUMP_S))
