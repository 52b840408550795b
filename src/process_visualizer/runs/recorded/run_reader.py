# SPDX-License-Identifier: BSD-3-Clause
"""A whole recording as a run: its channels, tool motions and events."""
from __future__ import annotations

import os
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bags.marks import read_marks
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Cell, ProcessEvent
from process_visualizer.curves.curve_sources import CurveSource, Quantity, curve_sources
from process_visualizer.curves.samples import Samples, found_series, read_samples, sampled
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import matrix_from_quaternion
from process_visualizer.ros_names import WRENCH_STAMPED
from process_visualizer.runs.event import passages_s
from process_visualizer.runs.recorded.absent_sources import absent_sources
from process_visualizer.runs.recorded.joint_series import joint_series
from process_visualizer.runs.recorded.tool_base import header_frame, tool_base
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

_KINDS: Dict[Quantity, ChannelKind] = {
    Quantity.SPEED: ChannelKind.SPEED, Quantity.FORCE: ChannelKind.FORCE,
    Quantity.NUMBER: ChannelKind.VARIABLE, Quantity.JOINT: ChannelKind.JOINT}
_COLOR = (0.5, 0.5, 0.5)


def read_run(recording: Recording, cell: Cell,
             on_progress: Optional[Callable[[float], None]] = None,
             is_cancelled: Callable[[], bool] = lambda: False) -> Run:
    """Return a whole recording as a run; what it does not have, the run has not either.

    Raises:
        ReadingCancelled: is_cancelled() has become true.
        BagError: a file cannot be read, of marks or as a bag.
    """
    devices = cell.devices
    configured = [*curve_sources(devices), *map(_event_source, cell.events)]
    wanted = found_series(recording, configured, devices)
    absent = absent_sources(recording, configured, wanted)
    samples = read_samples(recording, [*wanted, *joint_series(recording, devices)],
                           on_progress=on_progress, is_cancelled=is_cancelled, by_stamp=True)
    stored = recorded_configuration(recording)
    events = [it for it in samples if not it.source.device]
    channels = [it for it in samples if it.source.device]
    return Run(os.path.basename(recording.paths[0]),
               (recording.end_ns - recording.begin_ns) / 1e9,
               _distinct(channels), tuple(_motions(recording, cell, channels)),
               tuple(sorted(_events(events, cell.events) + _marks(recording),
                            key=lambda it: it.time_s)), recording=recording.paths,
               forces=tuple(_forces(recording, channels)),
               configuration='' if stored is None else repr(stored),
               absent=tuple((it.text, it.is_misspelt) for it in absent),
               phases=tuple(RunPhase(it.name, it.begin, it.end, it.is_wait)
                            for it in cell.phases))


def _event_source(event: ProcessEvent) -> CurveSource:
    return CurveSource('', event.name, '', _COLOR, Quantity.NUMBER, event.topic, field=event.field)


def _distinct(samples: Sequence[Samples]) -> Tuple[Channel, ...]:
    """The channels; what has the label of another one of its device has its topic too."""
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
    with np.errstate(over='ignore', invalid='ignore'):  # of numbers that are no measurements
        times_s, values = (samples.times_s, samples.values[:, -1]) \
            if source.quantity is Quantity.JOINT else sampled(samples)
    order = np.argsort(times_s, kind='stable')
    return Channel(source.device, source.channel_label, source.unit,
                   _KINDS[source.quantity], times_s[order], values[order], source.tolerance,
                   source.value_names, source.topic)


def _motions(recording: Recording, cell: Cell, samples: Sequence[Samples]) -> List[ToolMotion]:
    found = []
    for it in samples:
        if it.source.quantity is Quantity.SPEED:
            order = np.argsort(it.times_s, kind='stable')
            positions = _placed(it.values[order], tool_base(recording, cell, it.source))
            found.append(ToolMotion(it.source.device, it.times_s[order], positions))
    return found


def _forces(recording: Recording, samples: Sequence[Samples]) -> Iterator[ToolForce]:
    """They are only drawn: single precision, as there may be many."""
    for it in samples:
        if it.source.quantity is Quantity.FORCE:
            order = np.argsort(it.times_s, kind='stable')
            yield ToolForce(it.source.device,
                            header_frame(recording, it.source.topic, WRENCH_STAMPED) or '',
                            it.times_s[order], it.values[order].astype(np.float32))


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
    return [RunEvent(mark.label, (mark.time_ns - recording.begin_ns) / 1e9)
            for mark in read_marks(recording)]
