# SPDX-License-Identifier: BSD-3-Clause
"""Base frames of a recording: those stored in it, and those saved beside it."""
from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged, BagError
from process_visualizer.bagio.json_text import finite_number, parsed_json
from process_visualizer.bagio.message_definition import (
    DefinitionError,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_values import Values, message_values
from process_visualizer.bagio.recorder_topics import CALIBRATION
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell, Device, Pose, Vector3
from process_visualizer.robot.rotations import matrix_from_quaternion, ypr_from_matrix
from process_visualizer.whole_file import small_file, write_text

_MIN_NORM = 1e-3  # norm of a quaternion


class RecordedFrame(NamedTuple):
    """A frame's pose in its parent frame (names without a leading slash)."""

    parent: str
    pose: Pose


def recorded_frames(recording: Recording) -> Dict[str, RecordedFrame]:
    """Return the last recorded pose of each frame, by name; none if no recorder has stored them.

    Unreadable messages are left out and added to ``recording.gaps``.
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
            continue  # already noted
        except (DefinitionError, MessageDamaged, KeyError, TypeError, ValueError) as error:
            recording.note(position, f'it holds no frames: {error}')
    return found


def _frames(values: Values) -> Dict[str, RecordedFrame]:
    """Return the frames of a tf2_msgs/TFMessage.

    Raises:
        KeyError, TypeError, ValueError: the values are not those of a TFMessage.
    """
    return {str(it['child_frame_id']).lstrip('/'): RecordedFrame(
                str(it['header']['frame_id']).lstrip('/'), _pose_of_transform(it['transform']))
            for it in values['transforms']}


def _pose_of_transform(transform: Values) -> Pose:
    place, turned = transform['translation'], transform['rotation']
    x, y, z = (float(place[axis]) for axis in 'xyz')
    quaternion = np.array([float(turned[axis]) for axis in 'xyzw'])
    length = float(np.linalg.norm(quaternion))
    if not all(map(math.isfinite, (x, y, z, length))) or length < _MIN_NORM:
        raise ValueError('a transform is not finite, or not a rotation')
    yaw, pitch, roll = ypr_from_matrix(matrix_from_quaternion(quaternion / length)).tolist()
    return Pose((x, y, z), (yaw, pitch, roll))


class RecordingCalibration(NamedTuple):
    """Base frames of a recording: as recorded in its first file, and as saved later.

    Saved poses are poses of base frames in the global frame, by the frame's name.
    """

    bag: str
    then: Mapping[str, RecordedFrame]
    saved: Mapping[str, Pose]

    def recorded(self, frame: str, parent: str) -> Optional[Pose]:
        """Return the recorded pose of a frame in a parent frame; None if unknown."""
        found = self.then.get(frame)
        return found.pose if found is not None and found.parent == parent else None


def calibration_path(bag: str) -> str:
    """Return the file beside a bag that holds the poses saved for it."""
    return f'{bag}.calibration.json'


def read_recording_calibration(paths: Sequence[str]) -> RecordingCalibration:
    """Return the calibration of a recording.

    Raises:
        BagError: a bag, or the file beside it, cannot be read.
    """
    with Recording(paths) as recording:
        return RecordingCalibration(paths[0], recorded_frames(recording), saved_poses(paths[0]))


def saved_poses(bag: str) -> Dict[str, Pose]:
    """Return the poses saved beside a bag, by frame; none if there is no such file.

    Raises:
        BagError: the file does not hold poses.
    """
    path = calibration_path(bag)
    try:
        return {name: Pose(_vector(entry['xyz']), _vector(entry['ypr']))
                for name, entry in _object(parsed_json(small_file(path).decode())).items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(path, f'cannot be read as poses ({error}); repair or remove it') from error


def with_saved_poses(cell: Cell, poses: Mapping[str, Pose]) -> Cell:
    """Return a cell whose base frames have the saved poses; the others keep theirs."""
    return replace(cell, devices=tuple(_moved(it, poses) for it in cell.devices))


def _moved(device: Device, poses: Mapping[str, Pose]) -> Device:
    base = device.base
    if base is None or base.frame not in poses:
        return device
    return replace(device, base=replace(base, pose=poses[base.frame]))


def save_pose(bag: str, frame: str, pose: Optional[Pose]) -> Dict[str, Pose]:
    """Save a pose for a bag, or remove it (None); return all saved poses.

    The bag itself is not touched. If no pose is left, the file is removed.

    Raises:
        BagError: the file cannot be read or written; it stays unchanged.
    """
    poses = {name: it for name, it in saved_poses(bag).items() if name != frame}
    if pose is not None:
        poses[frame] = pose
    write_saved_poses(bag, poses)
    return poses


def write_saved_poses(bag: str, poses: Mapping[str, Pose]) -> None:
    """Replace all poses saved for a bag; without poses, their file is removed.

    Raises:
        BagError: the file cannot be written; it stays unchanged.
    """
    path = calibration_path(bag)
    try:
        _write(path, poses)
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error


def _write(path: str, poses: Mapping[str, Pose]) -> None:
    if not poses:
        if os.path.exists(path):
            os.remove(path)
        return
    write_text(path, json.dumps({name: {'xyz': pose.xyz, 'ypr': pose.ypr}
                                 for name, pose in poses.items()}, indent=1, ensure_ascii=False))


def _object(value: Any) -> Dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError('it does not begin with "{"')
    return value


def _vector(values: Any) -> Vector3:
    """Return three numbers from JSON.

    Raises:
        ValueError: the values are not three numbers.
    """
    numbers: List[float] = [finite_number(it) for it in values]
    if len(numbers) != 3:
        raise ValueError('three numbers are expected')
    found: Tuple[float, float, float] = (numbers[0], numbers[1], numbers[2])
    return found
