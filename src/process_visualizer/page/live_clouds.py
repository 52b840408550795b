# SPDX-License-Identifier: BSD-3-Clause
"""Clouds of depth sensors, encoded for a live page."""
from __future__ import annotations

from struct import Struct
from typing import Optional, Sequence

import genpy
import numpy as np
from sensor_msgs.msg import PointCloud2

from process_visualizer.page.clouds import Points, points_of_cloud
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import matrix_from_quaternion

CLOUD = 3
"""First byte of an encoded cloud; see `cloud_message`."""
MAX_POINTS = 4000
"""Maximum number of points in all clouds of a page together."""
_HEAD = Struct('<BxHId6f')
_STEPS_OF_16_BITS = 65_535
_FAR_M = 1e3


def live_points(data: bytes, most: int) -> Optional[Points]:
    """Return at most ``most`` points of a serialized sensor_msgs/PointCloud2, evenly sampled.

    Return None if the message is damaged or has no positions.
    """
    try:
        points = points_of_cloud(PointCloud2().deserialize(data))
    except genpy.DeserializationError:
        return None
    if points is None:
        return None
    near = np.flatnonzero((np.abs(points.positions) < _FAR_M).all(axis=1))
    rows = near[::max(-(-len(near) // most), 1)]
    return Points(points.frame, points.positions[rows], points.colors[rows])


def placed(points: Points, place: Placement) -> Points:
    """Return points in the outer frame; ``place`` is the pose of their own frame in it."""
    turn = np.array(matrix_from_quaternion(place.quaternion))
    return Points('', points.positions @ turn.T + np.array(place.position), points.colors)


def cloud_message(time_s: float, clouds: Sequence[Points]) -> bytes:
    """Return clouds encoded as bytes.

    A header (kind, 0, number of points, time, lowest corner and size of the bounding box [m]), then
    the positions as 16-bit fractions of the box, then the colors.
    """
    positions = np.concatenate([np.empty((0, 3)), *(it.positions for it in clouds)])
    colors = np.concatenate([np.empty((0, 3), np.uint8), *(it.colors for it in clouds)])
    low = positions.min(axis=0) if len(positions) else np.zeros(3)
    size = positions.max(axis=0) - low if len(positions) else np.zeros(3)
    share = np.divide(positions - low, size, out=np.zeros_like(positions), where=size > 0.0)
    return b''.join([
        _HEAD.pack(CLOUD, 0, len(positions), time_s, *low.tolist(), *size.tolist()),
        np.rint(_STEPS_OF_16_BITS * share).astype('<u2').tobytes(), colors.tobytes()])
