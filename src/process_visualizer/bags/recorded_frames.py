# SPDX-License-Identifier: BSD-3-Clause
"""Frames of the cell at the time of a recording, as the recorder has stored them."""
from __future__ import annotations

import math
from typing import Dict, NamedTuple

import numpy as np

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.recorder_topics import CALIBRATION
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Pose
from process_visualizer.messages.message_definition import (
    DefinitionError,
    parse_definitions,
    short_name,
)
from process_visualizer.messages.message_layout import MessageDamaged
from process_visualizer.messages.message_values import Values, message_values
from process_visualizer.motion.rotations import matrix_from_quaternion, ypr_from_matrix

_LEAST_NORM = 1e-3  # of a quaternion


class RecordedFrame(NamedTuple):
    """A frame's pose in its parent, names without a leading slash."""

    parent: str
    pose: Pose


def recorded_frames(recording: Recording) -> Dict[str, RecordedFrame]:
    """Return the frames as they were at last, by name; none if no recorder has stored them.

    What cannot be read is left out; ``recording.gaps`` has it.
    """
    index = recording.index
    found: Dict[str, RecordedFrame] = {}
    for position in index.positions_of(index.connections_of(CALIBRATION)).tolist():
        connection = index.connections[int(index.connection[position])]
        kind = short_name(connection.type)
        try:
            definitions = parse_definitions(kind, connection.message_definition)
            values = message_values(kind, definitions, recording.message(position))
            found.update(_frames(values))
        except BagDamaged:
            continue  # it is noted
        except (DefinitionError, MessageDamaged, KeyError, TypeError, ValueError) as error:
            recording.note(position, f'it holds no frames: {error}')
    return found


def _frames(values: Values) -> Dict[str, RecordedFrame]:
    """The frames of a tf2_msgs/TFMessage.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    return {str(it['child_frame_id']).lstrip('/'): RecordedFrame(
                str(it['header']['frame_id']).lstrip('/'), _pose(it['transform']))
            for it in values['transforms']}


def _pose(transform: Values) -> Pose:
    place, turned = transform['translation'], transform['rotation']
    x, y, z = (float(place[axis]) for axis in 'xyz')
    quaternion = np.array([float(turned[axis]) for axis in 'xyzw'])
    length = float(np.linalg.norm(quaternion))
    if not all(map(math.isfinite, (x, y, z, length))) or length < _LEAST_NORM:
        raise ValueError('a transform is not finite, or no rotation')
    yaw, pitch, roll = ypr_from_matrix(matrix_from_quaternion(quaternion / length)).tolist()
    return Pose((x, y, z), (yaw, pitch, roll))
