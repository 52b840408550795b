# SPDX-License-Identifier: BSD-3-Clause
"""A whole recording as a run: its channels, tool motions and events."""
from __future__ import annotations

import os
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.marks import read_marks
from process_visualizer.bagio.message_layout import MessageDamaged, checked_end, read_length
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.errors import nearest
from process_visualizer.cell.model import (
    Cell,
    ProcessEvent,
    TopicFunction,
)
from process_visualizer.curves.curve_sources import CurveSource, Quantity, curve_sources
from process_visualizer.curves.samples import Samples, Series, found_series, read_samples, sampled
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import matrix_from_quaternion, quaternion_from_ypr
from process_visualizer.robot.tool_frame import base_frame
from process_visualizer.ros_names import POSE_STAMPED, WRENCH_STAMPED
from process_visualizer.runs.event import passages_s
from process_visualizer.runs.recorded.robot_series import CONTROLLER_STATE, robot_series
from process_visualizer.runs.run import (
    Channel,
    ChannelKind,
    Key,
    Run,
    RunEvent,
    RunPhase,
    ToolForce,
    ToolMotion,
)

# Configured sources that a recording does not have.

class Absent(NamedTuple):
    """A source without data: its name, what is wrong, and whether a name is misspelled.

    If the messages of the topic do not have the field, the text says so.
    """

    name: str
    text: str
    is_misspelt: bool


def absent_sources(recording: Recording, wanted: Sequence[CurveSource],
                   series: Sequence[Series]) -> Tuple[Absent, ...]:
    """Return the wanted sources of numbers that a recording does not have, given its series."""
    topics = {it.topic for it in recording.index.connections}
    found = [it.source for it in series if _has_field(recording, it)]
    return tuple(_absent(source, topics) for source in wanted
                 if source not in found and not source.plain)


def _has_field(recording: Recording, series: Series) -> bool:
    """Return whether the first messages have the number; true without messages, as unknown."""
    if series.source.quantity is not Quantity.NUMBER:
        return True
    for number, locator in series.locators.parts[0].items():
        positions = recording.index.positions(number)
        try:
            if not len(positions) or locator.places(recording.message(int(positions[0]))).numbers:
                return True
        except BagDamaged:
            return True
    return False


def _absent(source: CurveSource, topics: Set[str]) -> Absent:
    name = f'{source.device} {source.channel_label}'.strip()
    if source.topic in topics:
        what = f'number "{source.field}"' if source.quantity is Quantity.NUMBER \
            else f'{source.channel_label} that can be read'
        return Absent(name, f'the messages of "{source.topic}" have no {what}, which is configured '
                            f'for "{name}"', source.quantity is Quantity.NUMBER)
    meant: Optional[str] = nearest(source.topic, topics)
    hint = '' if meant is None else f'; did you mean "{meant}"?'
    return Absent(name, f'no recording has the topic "{source.topic}", which is configured for '
                        f'"{name}"{hint}', meant is not None)


# The pose, in the global frame, of the frame in which a recorded tool position is given.

_FRAME_OFFSET = 12
"""Offset of the frame in a std_msgs/Header, after sequence number and stamp."""


def tool_base(recording: Recording, cell: Cell, source: CurveSource) -> Placement:
    """Return the pose of the frame of a source's positions; an unknown frame counts as global.

    The messages name the frame, or else the configuration.
    """
    device = cell.device(source.device)
    topic = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    named = None if topic is None else topic.parent_frame
    frame = header_frame(recording, source.topic, POSE_STAMPED) or named or base_frame(device)
    for base in (it.base for it in cell.devices):
        if base is not None and base.frame == frame:
            x, y, z, w = (float(it) for it in quaternion_from_ypr(base.pose.ypr))
            return Placement(base.pose.xyz, (x, y, z, w))
    return Placement()


def header_frame(recording: Recording, topic: str, kind: str) -> Optional[str]:
    """Return the frame in the first message of a topic, if it is of a type with a header."""
    index = recording.index
    for number in index.connections_of(topic):
        positions = index.positions(number)
        if index.connections[number].type != kind or not len(positions):
            continue
        try:
            data = recording.message(int(positions[0]))
            length, begin = read_length(data, _FRAME_OFFSET)
            return bytes(data[begin:checked_end(data, begin, length)]).decode(
                'utf-8', 'replace').strip('/') or None
        except (BagDamaged, MessageDamaged):
            continue
    return None


_COLOR = (0.5, 0.5, 0.5)
_KINDS: Dict[Quantity, ChannelKind] = {
    Quantity.SPEED: ChannelKind.SPEED, Quantity.FORCE: ChannelKind.FORCE,
    Quantity.NUMBER: ChannelKind.VARIABLE, Quantity.JOINT: ChannelKind.JOINT,
    Quantity.LAG: ChannelKind.VARIABLE, Quantity.TORQUE: ChannelKind.FORCE}


def read_run(recording: Recording, cell: Cell,
             on_progress: Optional[Callable[[float], None]] = None,
             is_canceled: Callable[[], bool] = lambda: False) -> Run:
    """Return a whole recording as a run; data missing there is missing in the run.

    Raises:
        ReadingCanceled: is_canceled() has become true.
        BagError: a file cannot be read, of marks or as a bag.
    """
    devices = cell.devices
    configured = [*curve_sources(devices), *map(_event_source, cell.events)]
    wanted = found_series(recording, configured, devices)
    absent = absent_sources(recording, configured, wanted)
    of_robots = robot_series(recording, devices)
    samples = [it for it in read_samples(
        recording, [*wanted, *of_robots], on_progress=on_progress,
        is_canceled=is_canceled, by_stamp=True) if not _is_unmeasured(it)]
    stored = recorded_configuration(recording)
    events = [it for it in samples if not it.source.device]
    channels = [it for it in samples if it.source.device]
    return Run(os.path.basename(recording.paths[0]),
               (recording.end_ns - recording.begin_ns) / 1e9,
               _distinct(channels), tuple(_motions(recording, cell, channels)),
               tuple(sorted(_events(events, cell.events) + _marks(recording),
                            key=lambda it: it.time_s)), recording=recording.paths,
               forces=tuple(_forces(recording, channels, Quantity.FORCE)),
               torques=tuple(_forces(recording, channels, Quantity.TORQUE)),
               configuration='' if stored is None else repr(stored),
               absent=(*((it.text, it.is_misspelt) for it in absent), *_no_lag(of_robots)),
               phases=tuple(RunPhase(it.name, it.begin, it.end, it.is_wait)
                            for it in cell.phases),
               is_damaged=bool(recording.gaps))


def as_received(recording: Recording, cell: Cell, samples: Sequence[Samples]) -> Run:
    """Return a recording as a run whose numbers hold from their arrival on, as in RViz.

    Its times are those of the recording; for speeds, those of measurement.
    """
    return Run(os.path.basename(recording.paths[0]),
               (recording.end_ns - recording.begin_ns) / 1e9, _distinct(samples),
               tuple(_motions(recording, cell, samples)), recording=recording.paths,
               forces=tuple(_forces(recording, samples, Quantity.FORCE)))


def _is_unmeasured(samples: Samples) -> bool:
    """Return whether a force sensor sends no torques, or no joint has a command."""
    return samples.source.quantity in (Quantity.TORQUE, Quantity.LAG) and not bool(
        np.nan_to_num(sampled(samples)[1]).any())


def _no_lag(series: Sequence[Series]) -> Iterator[Tuple[str, bool]]:
    robots: Dict[Quantity, List[str]] = {Quantity.JOINT: [], Quantity.LAG: []}
    for it in series:
        robots.setdefault(it.source.quantity, []).append(it.source.device)
    names = sorted({*robots[Quantity.JOINT]} - {*robots[Quantity.LAG]})
    if names:
        yield (f'how far joints of {", ".join(names)} lag behind their commands (no topic of '
               f'{CONTROLLER_STATE} was recorded)', False)


def _event_source(event: ProcessEvent) -> CurveSource:
    return CurveSource('', event.name, '', _COLOR, Quantity.NUMBER, event.topic, field=event.field)


def _distinct(samples: Sequence[Samples]) -> Tuple[Channel, ...]:
    """Return the channels; a label that another channel of the device has gets the topic added."""
    found: Dict[Key, Channel] = {}
    for it in samples:
        channel = _channel(it)
        if channel.key in found:
            channel = channel._replace(label=f'{channel.label} ({it.source.topic})')
        if channel.key in found:
            channel = channel._replace(label=f'{channel.label} {it.source.field}')
        found.setdefault(channel.key, channel)
    return tuple(found.values())


def _channel(samples: Samples) -> Channel:
    source = samples.source
    with np.errstate(over='ignore', invalid='ignore'):  # bogus numbers may overflow
        times_s, values = (samples.times_s, samples.values[:, -1]) \
            if source.quantity is Quantity.JOINT else sampled(samples)
    order = np.argsort(times_s, kind='stable')
    return Channel(source.device, source.channel_label, source.unit,
                   _KINDS[source.quantity], times_s[order], values[order], source.tolerance,
                   source.value_names, source.topic, source.max_tolerance)


def _motions(recording: Recording, cell: Cell, samples: Sequence[Samples]) -> List[ToolMotion]:
    found = []
    for it in samples:
        if it.source.quantity is Quantity.SPEED:
            order = np.argsort(it.times_s, kind='stable')
            positions = _placed(it.values[order], tool_base(recording, cell, it.source))
            found.append(ToolMotion(it.source.device, it.times_s[order], positions))
    return found


def _forces(recording: Recording, samples: Sequence[Samples],
            quantity: Quantity) -> Iterator[ToolForce]:
    """Yield forces or torques, in single precision, as there may be many."""
    for it in samples:
        if it.source.quantity is quantity:
            order = np.argsort(it.times_s, kind='stable')
            with np.errstate(over='ignore'):
                values = it.values[order].astype(np.float32)
            yield ToolForce(it.source.device,
                            header_frame(recording, it.source.topic, WRENCH_STAMPED) or '',
                            it.times_s[order], values)


def _placed(positions: np.ndarray, base: Placement) -> np.ndarray:
    turn = matrix_from_quaternion(base.quaternion)
    result: np.ndarray = positions @ turn.T + np.array(base.position)
    return result


def _events(samples: Sequence[Samples], events: Sequence[ProcessEvent]) -> List[RunEvent]:
    by_name = {event.name: event for event in events}
    found = []
    for it in samples:
        event = by_name[it.source.label]
        order = np.argsort(it.times_s, kind='stable')  # a clock may have been set back
        found += [RunEvent(event.name, float(time_s)) for time_s in passages_s(
            it.times_s[order], it.values[order, 0], event.threshold, event.is_above,
            event.hysteresis, event.lasting_s)]
    return found


def _marks(recording: Recording) -> List[RunEvent]:
    return [RunEvent(mark.label, (mark.time_ns - recording.begin_ns) / 1e9, True)
            for mark in read_marks(recording)]
