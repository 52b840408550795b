# SPDX-License-Identifier: BSD-3-Clause
"""Observation of a recording, from its index and a few messages of each topic."""
from __future__ import annotations

import math
import os
from collections import defaultdict
from typing import Any, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.message_definition import (
    Connection,
    DefinitionError,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_values import Values, message_values
from process_visualizer.bagio.recorder_topics import CALIBRATION, STATIC_FRAMES
from process_visualizer.bagio.recording import Recording
from process_visualizer.discovery.seen import (
    Seen,
    SeenDescription,
    SeenNumber,
    SeenTopic,
    SeenTransform,
    Source,
)
from process_visualizer.robot.description import is_own_description
from process_visualizer.robot.kinematics import Placement
from process_visualizer.ros_names import NAMED_JOINTS, STATIC_TF_TOPIC, TF_TYPES

_STRING = 'std_msgs/String'
_MAX_NUMBERS = 200
_MIN_NORM = 1e-3  # of a quaternion
_NO_NUMBERS = ('header', 'layout')


def seen_topics(sources: Sequence[Source]) -> Tuple[SeenTopic, ...]:
    """Return the topics sorted by name; a topic with two types gets that of its first source."""
    by_topic: Dict[str, List[Source]] = defaultdict(list)
    for source in sources:
        by_topic[source.topic].append(source)
    return tuple(_topic(by_topic[name]) for name in sorted(by_topic))


def seen_transforms(sources: Iterable[Source]) -> Tuple[SeenTransform, ...]:
    """Return the last transform of each frame; invalid transforms are left out."""
    found: Dict[str, SeenTransform] = {}
    for source in sources:
        if short_name(source.type) in TF_TYPES:
            for values in readable(source):
                for it in transforms(values, source.topic):
                    found[it.child] = _with_changes(it, found.get(it.child))
    return tuple(found.values())


def seen_descriptions(sources: Iterable[Source]) -> Tuple[SeenDescription, ...]:
    """Return the robot descriptions sent as std_msgs/String, one for each topic."""
    found: Dict[str, SeenDescription] = {}
    for source in sources:
        if short_name(source.type) == _STRING:
            for values in readable(source):
                text = values.get('data', '')
                if is_description(text):
                    namespace = source.topic.rpartition('/')[0]
                    found[source.topic] = SeenDescription(namespace, text)
    return tuple(found.values())


def is_description(text: Any) -> bool:
    """Return whether a parameter or text is a robot description, but not one of our cells."""
    return isinstance(text, str) and '<robot' in text and '<link' in text \
        and not is_own_description(text)


def _topic(sources: Sequence[Source]) -> SeenTopic:
    kind = short_name(sources[0].type)
    messages = [values for source in sources if short_name(source.type) == kind
                for values in readable(source)]
    frames = (part['header']['frame_id'].lstrip('/') for values in messages
              for part in (values, *_markers(values)) if _has_header(part))
    joints = (name for values in messages if kind in NAMED_JOINTS
              for name in _texts(values.get('name', values.get('joint_names'))))
    return SeenTopic(
        sources[0].topic, kind, tuple(dict.fromkeys(source.publisher for source in sources)),
        tuple(dict.fromkeys(frame for frame in frames if frame)),
        tuple(dict.fromkeys(joints)), _length(messages), _numbers(messages))


def readable(source: Source) -> Iterator[Values]:
    """Yield the values of the messages of a source, without those that cannot be parsed."""
    kind = short_name(source.type)
    try:
        definitions = parse_definitions(kind, source.definition)
    except DefinitionError:
        return
    for data in source.messages:
        try:
            yield message_values(kind, definitions, data)
        except (MessageDamaged, DefinitionError):
            continue


def _texts(value: Any) -> List[str]:
    return [it for it in value if isinstance(it, str)] if isinstance(value, list) else []


def _markers(values: Values) -> List[Values]:
    markers = values.get('markers')
    return [it for it in markers if isinstance(it, dict)] if isinstance(markers, list) else []


def _has_header(values: Values) -> bool:
    header = values.get('header')
    return isinstance(header, dict) and isinstance(header.get('frame_id'), str)


def _length(messages: Sequence[Values]) -> Optional[int]:
    lengths = {len(it['data']) for it in messages if isinstance(it.get('data'), list)}
    return lengths.pop() if len(lengths) == 1 else None


def _numbers(messages: Sequence[Values]) -> Tuple[SeenNumber, ...]:
    """Return the finite numbers that are in all messages."""
    series: Dict[str, List[float]] = defaultdict(list)
    whole: Dict[str, bool] = {}
    for values in messages:
        for path, value in _flat(values):
            series[path].append(float(value))
            whole[path] = isinstance(value, int) and whole.get(path, True)
    return tuple(_number(path, found, whole[path]) for path, found in series.items()
                 if len(found) == len(messages) and all(map(math.isfinite, found)))[:_MAX_NUMBERS]


def _number(path: str, values: Sequence[float], is_whole: bool) -> SeenNumber:
    rises = is_whole and len(values) > 2 and all(a < b for a, b in zip(values, values[1:]))
    return SeenNumber(path, min(values), max(values), rises, is_whole)


def _flat(values: Values, before: str = '') -> Iterator[Tuple[str, float]]:
    """Yield paths and numbers of fields, of nested fields, and of the array ``data``."""
    for name, value in values.items():
        path = f'{before}{name}'
        if isinstance(value, dict) and name not in _NO_NUMBERS:
            yield from _flat(value, f'{path}.')
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield path, value
        elif isinstance(value, list) and path == 'data':
            yield from ((f'{path}[{i}]', it) for i, it in enumerate(value)
                        if isinstance(it, (int, float)) and not isinstance(it, bool))


def _with_changes(new: SeenTransform, before: Optional[SeenTransform]) -> SeenTransform:
    """Return the new transform; ``changes`` is set if an earlier one differed."""
    if before is None or before.parent != new.parent:
        return new
    return new._replace(changes=before.changes or before.placement != new.placement)


def transforms(values: Values, topic: str) -> Iterator[SeenTransform]:
    """Yield the usable transforms of a message on tf."""
    for it in values.get('transforms', ()):
        try:
            parent, child = it['header']['frame_id'].lstrip('/'), it['child_frame_id'].lstrip('/')
            position, rotation = it['transform']['translation'], it['transform']['rotation']
            placement = Placement(_take(position, 'xyz'), _take(rotation, 'xyzw'))
        except (KeyError, TypeError, AttributeError):
            continue  # another message type under the name of a tf type
        norm = math.hypot(*placement.quaternion)
        if parent and child and math.isfinite(sum(placement.position)) \
                and _MIN_NORM < norm < 1.0 / _MIN_NORM:
            yield SeenTransform(parent, child, placement, topic)


def _take(values: Values, names: str) -> Any:
    return tuple(float(values[name]) for name in names)


_MOMENTS, _MOMENTS_OF_TF = 16, 64
"""Number of messages read from each publisher, evenly spread over the recording."""
_STATIC = (STATIC_TF_TOPIC, STATIC_FRAMES, CALIBRATION)
_MAX_STATIC = 500
_TURNS = 16
"""Number of first joint states and transforms; together they contain all parts sent regularly."""
_LARGE = frozenset({'sensor_msgs/Image', 'sensor_msgs/PointCloud2', 'sensor_msgs/CompressedImage',
                    'sensor_msgs/PointCloud', 'nav_msgs/OccupancyGrid',
                    'stereo_msgs/DisparityImage'})
_NO_PARAMETERS = ('A bag holds no parameters, so no robot_description: models were looked for in '
                  'the packages.')


def look_into(recording: Recording) -> Seen:
    """Return the observations from a recording; reads only a few messages."""
    sources = _sources(recording)
    transforms = seen_transforms([it for it in sources if it.topic != CALIBRATION])
    calibrated = seen_transforms([it for it in sources if it.topic == CALIBRATION])
    known = {it.child for it in calibrated}
    descriptions = seen_descriptions(sources)
    return Seen(' and '.join(os.path.basename(path) for path in recording.paths),
                seen_topics(sources),
                (*(it for it in transforms if it.child not in known), *calibrated), descriptions,
                () if descriptions else (_NO_PARAMETERS,))


def _sources(recording: Recording) -> List[Source]:
    index = recording.index
    wanted: Dict[int, List[int]] = {
        number: _positions(index.positions(number), len(index), connection)
        for number, connection in enumerate(index.connections)}
    messages: Dict[int, List[bytes]] = {number: [] for number in wanted}
    by_place = sorted((position, number) for number, positions in wanted.items()
                      for position in positions)
    for position, number in by_place:  # in file order, so that each chunk is decompressed once
        try:
            messages[number].append(bytes(recording.message(position)))
        except BagDamaged:
            continue  # the recording reports the damage
    return [Source(it.topic, it.type, it.message_definition, it.caller_id, tuple(messages[number]))
            for number, it in enumerate(index.connections) if messages[number]]


def _positions(positions: np.ndarray, total: int, connection: Connection) -> List[int]:
    """Return the positions of the messages to read from a connection."""
    if connection.topic in _STATIC:
        return [int(it) for it in positions[:_MAX_STATIC]]
    kind = short_name(connection.type)
    if not len(positions) or kind in _LARGE:
        return [int(it) for it in positions[:1]]
    found = _spread(positions, total, _MOMENTS_OF_TF if kind in TF_TYPES else _MOMENTS)
    if kind in NAMED_JOINTS or kind in TF_TYPES:  # their parts may take turns
        found = sorted({*found, *positions[:_TURNS].tolist()})
    return found


def _spread(positions: np.ndarray, total: int, count: int) -> List[int]:
    """Return the messages that follow evenly spaced moments, which are the same for all topics."""
    places = np.searchsorted(positions, np.linspace(0, total - 1, count))
    return [int(it) for it in positions[np.unique(np.minimum(places, len(positions) - 1))]]
