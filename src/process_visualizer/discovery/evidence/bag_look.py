# SPDX-License-Identifier: BSD-3-Clause
"""Looks into a recording: at its index, and at some messages of each topic."""
from __future__ import annotations

import os
from typing import Dict, List

import numpy as np

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.recorder_topics import CALIBRATION
from process_visualizer.bags.recording import Recording
from process_visualizer.discovery.evidence.seen import Seen, Source
from process_visualizer.discovery.evidence.topic_facts import (
    seen_descriptions,
    seen_topics,
    seen_transforms,
)
from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_definition import short_name
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TYPES

_MOMENTS, _MOMENTS_OF_TF = 16, 64
"""Of each publisher about so many messages are read, evenly spread over the recording."""
_STATIC = (STATIC_TF_TOPIC, CALIBRATION)
_MOST_STATIC = 500
_LARGE = frozenset({'sensor_msgs/Image', 'sensor_msgs/PointCloud2', 'sensor_msgs/CompressedImage',
                    'sensor_msgs/PointCloud', 'nav_msgs/OccupancyGrid',
                    'stereo_msgs/DisparityImage'})
_NO_PARAMETERS = ('A bag holds no parameters, so no robot_description: models were looked for in '
                  'the packages.')


def look_into(recording: Recording) -> Seen:
    """Return what a recording shows; reads a few messages only."""
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
    by_place = sorted((position, number) for number, found in wanted.items() for position in found)
    for position, number in by_place:  # in the file's order: a chunk is decompressed once
        try:
            messages[number].append(bytes(recording.message(position)))
        except BagDamaged:
            continue  # the recording notes it
    return [Source(it.topic, it.type, it.message_definition, it.caller_id, tuple(messages[number]))
            for number, it in enumerate(index.connections) if messages[number]]


def _positions(positions: np.ndarray, total: int, connection: Connection) -> List[int]:
    """Return which messages of a connection are read."""
    if connection.topic in _STATIC:
        return [int(it) for it in positions[:_MOST_STATIC]]
    kind = short_name(connection.type)
    if not len(positions) or kind in _LARGE:
        return [int(it) for it in positions[:1]]
    return _spread(positions, total, _MOMENTS_OF_TF if kind in TF_TYPES else _MOMENTS)


def _spread(positions: np.ndarray, total: int, count: int) -> List[int]:
    """The messages next after so many moments, the same for all topics."""
    places = np.searchsorted(positions, np.linspace(0, total - 1, count))
    return [int(it) for it in positions[np.unique(np.minimum(places, len(positions) - 1))]]
