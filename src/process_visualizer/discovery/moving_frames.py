# SPDX-License-Identifier: BSD-3-Clause
"""Moving frames of a recording, to distinguish models with the same joints."""
from __future__ import annotations

from collections import defaultdict
from typing import Any, Dict, Iterator, List, NamedTuple, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.message_definition import short_name
from process_visualizer.bagio.message_values import Values
from process_visualizer.bagio.recording import Recording
from process_visualizer.discovery.bag_look import readable, transforms
from process_visualizer.discovery.seen import Source
from process_visualizer.robot.kinematics import Placement
from process_visualizer.ros_names import JOINT_STATE, POSE_STAMPED, TF_TYPES

_MOMENTS = 40
_AROUND = 3  # joint states on each side of a moment, so that their stamps lie on both sides, too
_GROUPS = 8  # maximum number of groups of joints, each sent in its own messages
_SAME_CLOCK_S = 0.5
MIN_MOVED_M = 0.05
MIN_SAMPLES = 8


class Sample(NamedTuple):
    """Positions of joints [rad or m] by name, and the pose of a frame at the same time."""

    positions: Dict[str, float]
    place: Placement


class FrameMotion(NamedTuple):
    """Motion of a ``frame`` in its ``parent``, from ``topic``, with the joints of ``joint_topic``.

    The frame of a pose has no name: ''.
    """

    joint_topic: str
    topic: str
    parent: str
    frame: str
    samples: Tuple[Sample, ...]

    @property
    def name(self) -> str:
        """Return a text that names the motion."""
        return f'{self.frame} in {self.topic}' if self.frame else self.topic


class _Timed(NamedTuple):
    stamp_s: float
    bag_s: float
    value: Any


def recorded_motions(recording: Recording) -> List[FrameMotion]:
    """Return each moving frame with each topic of joint states; reads only some messages."""
    index = recording.index
    types = {'joints': (JOINT_STATE,), 'frames': (POSE_STAMPED, *TF_TYPES)}
    numbers = {kind: [number for number, connection in enumerate(index.connections)
                      if short_name(connection.type) in kinds] for kind, kinds in types.items()}
    motions = []
    for number in numbers['frames']:
        for (parent, frame), places in _moving(recording, number).items():
            for joints in numbers['joints']:
                samples = [sample for place in places
                           for sample in _samples(recording, joints, place)]
                if len(samples) >= MIN_SAMPLES:
                    motions.append(FrameMotion(index.connections[joints].topic,
                                               index.connections[number].topic, parent, frame,
                                               tuple(samples)))
    return motions


def _moving(recording: Recording, number: int) -> Dict[Tuple[str, str], List[_Timed]]:
    """Return the poses of moving frames of a connection, at moments spread over the recording."""
    positions = recording.index.positions(number)
    chosen = np.unique(np.linspace(0, max(len(positions) - 1, 0), _MOMENTS).astype(int))
    places: Dict[Tuple[str, str], List[_Timed]] = defaultdict(list)
    for position in positions[chosen] if len(positions) else ():
        for pair, place in _places(recording, number, int(position)):
            places[pair].append(place)
    return {pair: track for pair, track in places.items() if len(track) >= MIN_SAMPLES
            and _has_moved(np.array([place.value.position for place in track]))}


def _has_moved(positions: np.ndarray) -> bool:
    return bool(np.isfinite(positions).all() and np.ptp(positions, axis=0).max() >= MIN_MOVED_M)


def _places(recording: Recording, number: int,
            position: int) -> 'Iterator[Tuple[Tuple[str, str], _Timed]]':
    source, bag_s = _source(recording, number, position)
    for values in readable(source):
        try:
            for it in values['transforms'] if source.type in TF_TYPES else ():
                for place in transforms({'transforms': [it]}, source.topic):
                    yield (place.parent, place.child), _Timed(_stamp_s(it), bag_s, place.placement)
            if source.type == POSE_STAMPED:
                yield (values['header']['frame_id'].lstrip('/'), ''), _Timed(
                    _stamp_s(values), bag_s, _placement(values['pose']))
        except (KeyError, TypeError, AttributeError):
            continue  # a message of another type under this name


def _samples(recording: Recording, number: int, place: _Timed) -> Iterator[Sample]:
    """Yield the joint positions at the time of a pose, interpolated between measurements."""
    positions = recording.index.positions(number)
    times_ns = recording.index.time_ns[positions]
    at = int(np.searchsorted(times_ns, round(place.bag_s * 1e9)))

    def around(count: int) -> List[_Timed]:
        return [joints for position in positions[max(at - count, 0):at + count]
                for joints in _joints(recording, number, int(position))]

    near = around(_AROUND)
    if any(joints.value.keys() != near[0].value.keys() for joints in near):
        near = around(_AROUND * _GROUPS)
    has_stamps = all(joints.stamp_s and abs(joints.stamp_s - place.stamp_s) < _SAME_CLOCK_S
                     for joints in near)
    near.sort(key=lambda joints: joints.stamp_s if has_stamps else joints.bag_s)
    time_s = place.stamp_s if has_stamps else place.bag_s
    tracks: Dict[str, List[Tuple[float, float]]] = defaultdict(list)
    for joints in near:
        for name, value in joints.value.items():
            tracks[name].append((joints.stamp_s if has_stamps else joints.bag_s, value))
    if tracks and all(len(track) > 1 and (track[0][0] <= time_s <= track[-1][0] or not has_stamps)
                      for track in tracks.values()):
        yield Sample({name: float(np.interp(time_s, *zip(*track)))
                      for name, track in tracks.items()}, place.value)


def _joints(recording: Recording, number: int, position: int) -> Iterator[_Timed]:
    source, bag_s = _source(recording, number, position)
    for values in readable(source):
        try:
            positions = dict(zip(values['name'], map(float, values['position'])))
            yield _Timed(_stamp_s(values), bag_s, positions)
        except (KeyError, TypeError, AttributeError):
            continue  # a message of another type under this name


def _source(recording: Recording, number: int, position: int) -> Tuple[Source, float]:
    it = recording.index.connections[number]
    try:
        messages: Tuple[bytes, ...] = (bytes(recording.message(position)),)
    except BagDamaged:
        messages = ()  # the recording reports the damage
    return Source(it.topic, short_name(it.type), it.message_definition, it.caller_id, messages), \
        float(recording.index.time_ns[position]) * 1e-9


def _placement(pose: Values) -> Placement:
    x, y, z = (float(pose['position'][name]) for name in 'xyz')
    a, b, c, d = (float(pose['orientation'][name]) for name in 'xyzw')
    return Placement((x, y, z), (a, b, c, d))


def _stamp_s(values: Values) -> float:
    stamp = values['header']['stamp']
    return float(stamp.seconds + stamp.nanoseconds * 1e-9)
