# SPDX-License-Identifier: BSD-3-Clause
"""Makes a bag of the simulated sewing cell, with the Kinect: 46 MB/s.

usage: python3 bench/cell_bag.py [--seconds 20] [--folder FOLDER]    (in the workspace)

Joints and tool frames of two robots at 125 Hz, two force sensors at 94 Hz, three sensors of the
sewing machine at 50 Hz, color (rgb8) and depth (16UC1) images of 640x480 with their camera infos
at 30 Hz. The contents are the simulator's, except that each message carries its index; the
machine's sensors are ramps.
"""
from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any, Callable, List, Tuple

import genpy
import numpy as np
from bag_maker import DEFAULT_FOLDER, BagTopic, MadeBag, made_bag
from message_index import array_message, edge_message, feed_rate_message
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32, Float32MultiArray, UInt16

from sewing_cell import camera_messages
from sewing_cell.camera import Camera, CameraFrame
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

_JOINT_HZ, _FORCE_HZ, _SENSOR_HZ, _IMAGE_HZ = 125, 94, 50, 30


def cell_bag(folder: str, length_s: float) -> MadeBag:
    """Return the bag of this many seconds from the folder; write it if it does not exist."""
    cycle = SewingCycle()
    topics: List[BagTopic] = []
    for arm in ARMS:
        topics += _robot_topics(cycle, arm, length_s)
    topics += [BagTopic(f'/edge_finder_{arm.name}', _SENSOR_HZ, UInt16,
                        lambda index, _time_ns: edge_message(index)) for arm in ARMS]
    topics.append(BagTopic('/feed_rate_est', _SENSOR_HZ, Float32,
                           lambda index, _time_ns: feed_rate_message(index)))
    topics += _camera_topics(_Frames(cycle))
    return made_bag(Path(folder) / f'cell_{length_s:g}_s.bag', topics, length_s)


def _robot_topics(cycle: SewingCycle, arm: Arm, length_s: float) -> List[BagTopic]:
    return [
        _array_topic(f'/ur_rt_{arm.name}/q_act', _JOINT_HZ, length_s,
                     lambda times_s: cycle.joints(arm, times_s)),
        _array_topic(f'/ur_rt_{arm.name}/tcf', _JOINT_HZ, length_s,
                     lambda times_s: cycle.tool_frame(arm, times_s)),
        _array_topic(f'/ft_{arm.name}/ft', _FORCE_HZ, length_s,
                     lambda times_s: cycle.wrench(arm, times_s))]


def _array_topic(name: str, rate_hz: int, length_s: float,
                 rows_at: Callable[[np.ndarray], np.ndarray]) -> BagTopic:
    """A topic of Float32MultiArray with the rows of a function of times (n,) [s]."""
    rows: List[List[float]] = []

    def content(index: int, _time_ns: int) -> bytes:
        if not rows:  # only when the bag is written
            rows.extend(rows_at(np.arange(length_s * rate_hz) / rate_hz).tolist())
        return array_message(index, rows[index])

    return BagTopic(name, rate_hz, Float32MultiArray, content)


class _Frames:
    """The Kinect's pictures; color and depth of an index are requested one after the other."""

    def __init__(self, cycle: SewingCycle) -> None:
        self._cycle = cycle
        self._cameras: List[Camera] = []
        self._last: Tuple[int, Any] = (-1, None)

    def frame(self, index: int) -> CameraFrame:
        if not self._cameras:  # drawing the static background is slow: only to write the bag
            self._cameras.append(Camera(self._cycle, _IMAGE_HZ))
        if self._last[0] != index:
            self._last = (index, self._cameras[0].render(index))
        return self._last[1]


def _camera_topics(frames: _Frames) -> List[BagTopic]:
    info = camera_messages.camera_info()
    color = camera_messages.image('rgb8', bytes_per_pixel=3)
    depth = camera_messages.image('16UC1', bytes_per_pixel=2)

    def color_image(index: int, time_ns: int) -> bytes:
        camera_messages.set_pixels(color, frames.frame(index).color)
        return _stamped(color, index, time_ns)

    def depth_image(index: int, time_ns: int) -> bytes:
        camera_messages.set_pixels(depth, frames.frame(index).depth)
        return _stamped(depth, index, time_ns)

    def camera_info(index: int, time_ns: int) -> bytes:
        return _stamped(info, index, time_ns)

    return [BagTopic('/camera/rgb/camera_info', _IMAGE_HZ, CameraInfo, camera_info),
            BagTopic('/camera/depth_registered/camera_info', _IMAGE_HZ, CameraInfo, camera_info),
            BagTopic('/camera/rgb/image_color', _IMAGE_HZ, Image, color_image),
            BagTopic('/camera/depth_registered/image_raw', _IMAGE_HZ, Image, depth_image)]


def _stamped(message: Any, index: int, time_ns: int) -> bytes:
    """Return the message's bytes with its index and its stamp in the header."""
    message.header.seq = index
    message.header.stamp = genpy.Time(*divmod(time_ns, 1_000_000_000))
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--folder', default=DEFAULT_FOLDER)
    options = parser.parse_args()
    bag = cell_bag(options.folder, options.seconds)
    print(f'{bag.path}: {bag.path.stat().st_size / options.seconds / 1e6:.1f} MB/s')


if __name__ == '__main__':
    main()
