# SPDX-License-Identifier: BSD-3-Clause
"""The contents of a recording, for choosing one; reads only its index."""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bagio.bag_errors import BagError, Gap
from process_visualizer.bagio.marks import Mark, read_marks
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device
from process_visualizer.cell.stored_configuration import StoredConfiguration
from process_visualizer.ros_names import OWN_TOPICS


class CatalogTopic(NamedTuple):
    """A topic of a recording; if it has several types, only the first can be played.

    ``rate_hz`` is the mean rate from first to last message; 0 with fewer than two messages.
    """

    name: str
    types: Tuple[str, ...]
    message_count: int
    rate_hz: float
    is_latched: bool = False


class Catalog(NamedTuple):
    """Contents of a recording; ``begin_ns`` is since the epoch.

    ``topics`` are the devices' topics, sorted by name, without the recorder's own;
    ``message_count`` counts all messages in the files, as rosbag does. ``marks`` are in the order
    of time. ``problems`` describes the unreadable parts of the files (also ``gaps``) and of the
    files beside them. ``remarks`` are further notes for the operator.
    """

    paths: Tuple[str, ...]
    begin_ns: int
    duration_s: float
    size_bytes: int
    message_count: int
    topics: Tuple[CatalogTopic, ...]
    marks: Tuple[Mark, ...] = ()
    problems: Tuple[str, ...] = ()
    configuration: Optional[StoredConfiguration] = None
    gaps: Tuple[Gap, ...] = ()
    remarks: Tuple[str, ...] = ()

    @property
    def topic_names(self) -> Tuple[str, ...]:
        """The names of the topics."""
        return tuple(topic.name for topic in self.topics)

    def position_s(self, mark: Mark) -> float:
        """Return the position of a mark, in s from the beginning."""
        return (mark.time_ns - self.begin_ns) / 1e9


def read_catalog(paths: Sequence[str]) -> Catalog:
    """Return the contents of the bags of one recording.

    Raises:
        BagUnindexed: one of the files has to be reindexed first.
        BagError: one of the files is not a bag, or cannot be read.
        ValueError: no file is given.
    """
    with Recording(paths) as recording:
        marks, bad_marks = _marks(recording)
        configuration = recorded_configuration(recording)
        topics = _topics(recording)
        return Catalog(
            recording.paths, recording.begin_ns,
            (recording.end_ns - recording.begin_ns) / 1e9, recording.size_bytes,
            len(recording.index) + recording.index.left_out, topics, tuple(marks),
            (*map(str, recording.gaps), *bad_marks), configuration, recording.gaps,
            recording.remarks)


def missing_topics(catalog: Catalog,
                   devices: Sequence[Device]) -> Dict[str, Tuple[str, ...]]:
    """Return the topics missing in the recording, by device; complete devices are left out."""
    present = set(catalog.topic_names)
    missing = {device.name: tuple(name for name in _recorded(device) if name not in present)
               for device in devices}
    return {name: topics for name, topics in missing.items() if topics}


def unused_topics(catalog: Catalog, devices: Sequence[Device]) -> Tuple[str, ...]:
    """Return the topics of the recording that no device uses."""
    played = {name for device in devices for name in _recorded(device)}
    return tuple(name for name in catalog.topic_names if name not in played)


def _recorded(device: Device) -> List[str]:
    return list(dict.fromkeys(topic.name for topic in device.topics if topic.record))


def _marks(recording: Recording) -> Tuple[List[Mark], List[str]]:
    """Return the marks, or the problem in reading them: a recording can be played without marks."""
    try:
        return read_marks(recording), []
    except BagError as error:
        return [], [str(error)]


def _topics(recording: Recording) -> Tuple[CatalogTopic, ...]:
    names = {connection.topic for connection in recording.index.connections}
    topics = (_topic(recording, name) for name in sorted(names) if not name.startswith(OWN_TOPICS))
    return tuple(topic for topic in topics if topic.message_count)


def _topic(recording: Recording, name: str) -> CatalogTopic:
    index = recording.index
    numbers = index.connections_of(name)
    times_ns = index.time_ns[index.positions_of(numbers)]
    count = len(times_ns)
    duration_s = float(times_ns[-1] - times_ns[0]) / 1e9 if count else 0.0
    types = dict.fromkeys(index.connections[number].type for number in numbers)
    return CatalogTopic(name, tuple(types), count,
                        (count - 1) / duration_s if duration_s else 0.0,
                        any(index.connections[number].latching for number in numbers))
