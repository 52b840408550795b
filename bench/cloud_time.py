# SPDX-License-Identifier: BSD-3-Clause
"""Measures the distance between a cloud and the moving robot in it, at the stamp of the cloud.

usage: bench/run cloud_time [--seconds 20]

The simulated cell runs, is recorded, and is played back. From the tf of the upper robot at a
cloud's stamp, and at times around it, the depth image is computed that the simulated Kinect would
see. The time at which it agrees best with the cloud gives the error of the stamp, and with the
tool's speed the distance of the cloud from the robot. "Arrival": as if stamped at its arrival.
"""
from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional

import numpy as np
import rospy
import tf2_ros
from players import ros_master
from sensor_msgs.msg import PointCloud2

from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.robot.rotations import matrix_from_quaternion
from sewing_cell import pinhole
from sewing_cell.mesh_picture import Picture
from sewing_cell.scene import draw_robot

CONFIG = Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml'
DEVICES = 'ur_rt_upper,kinect,simulator'
TOPICS = ('/ur_rt_upper/q_act', '/camera/rgb/image_color', '/camera/rgb/camera_info',
          '/camera/depth_registered/image_raw')
LINKS = [f'ur_rt_upper/link{number}' for number in range(8)] + ['ur_rt_upper/tool']
BOX = {'center': [-0.5, 0.0, 0.3], 'size': [1.4, 2.4, 0.4]}  # above the covers, m
SHIFTS_S = np.arange(-0.08, 0.0801, 0.01)
SLOWEST_M_PER_S = 0.1
EVERY = 3
"""One of this many clouds is compared."""
MAX_M = 0.03
RATES = (1.0, -1.0, -0.5, -2.0)
_RUN_UP_S = 0.5
_TIMEOUT_S = 60.0
_SETTLING_S = 3.0
_BUFFER_S = 600.0


class Offset(NamedTuple):
    """Distance of a cloud from the robot [m]: as stamped, and as if stamped at its arrival."""

    stamped_m: float
    at_arrival_m: float


class Watch:
    """Collects clouds and all transforms, and compares them afterwards."""

    def __init__(self, rate: float = 1.0) -> None:
        self._slowest = SLOWEST_M_PER_S * abs(rate)
        self._clouds_with_arrival: List['tuple[PointCloud2, float]'] = []
        self._count = 0
        self._buffer = tf2_ros.Buffer(rospy.Duration.from_sec(_BUFFER_S))
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._clouds = rospy.Subscriber('/kinect/points', PointCloud2, self._take, queue_size=1,
                                        buff_size=1 << 24, tcp_nodelay=True)

    def __enter__(self) -> 'Watch':
        return self

    def __exit__(self, *_exception: object) -> None:
        self._listener.unregister()

    def run(self, seconds: float) -> List[Offset]:
        """Compare the clouds of a period."""
        time.sleep(seconds)
        self._clouds.unregister()
        compared = (self._compare(*it) for it in self._clouds_with_arrival)
        return [offset for offset in compared if offset is not None]

    def _take(self, cloud: PointCloud2) -> None:
        arrival_s = rospy.get_time()
        self._count += 1
        if self._count % EVERY == 0:
            self._clouds_with_arrival.append((cloud, arrival_s))

    def _compare(self, cloud: PointCloud2, arrival_s: float) -> Optional[Offset]:
        stamp_s = cloud.header.stamp.to_sec()
        try:
            before, after = self._links(stamp_s - 0.02), self._links(stamp_s + 0.02)
            speed = float(np.linalg.norm(after[8, :3, 3] - before[8, :3, 3])) / 0.04
            if speed < self._slowest:
                return None
            measured = _depth_image(cloud)
            off_s = _off_s(measured, lambda shift: self._links(stamp_s + shift))
        except tf2_ros.TransformException:
            return None
        return None if off_s is None else Offset(
            abs(off_s) * speed, abs(stamp_s + off_s - arrival_s) * speed)

    def _links(self, time_s: float) -> np.ndarray:
        """Return the poses of the links and the tool in the world, (9, 4, 4), m."""
        poses = np.tile(np.eye(4), (len(LINKS), 1, 1))
        for pose, link in zip(poses, LINKS):
            it = self._buffer.lookup_transform('world', link, rospy.Time.from_sec(time_s)).transform
            turned = it.rotation
            pose[:3, :3] = matrix_from_quaternion((turned.x, turned.y, turned.z, turned.w))
            pose[:3, 3] = it.translation.x, it.translation.y, it.translation.z
        return poses


def _expected(links: np.ndarray) -> np.ndarray:
    """Return the depth image of the robot, (480, 640), m; inf beside it."""
    picture = Picture.empty()
    draw_robot(picture, pinhole.camera_from_world() @ links)
    return picture.depth


def _depth_image(cloud: PointCloud2) -> np.ndarray:
    """Return the depth of each pixel that has a point in the box, m; inf elsewhere."""
    image = np.full((pinhole.HEIGHT, pinhole.WIDTH), np.inf)
    points = np.frombuffer(cloud.data, '<f4').reshape(-1, cloud.point_step // 4)[:, :3]
    pixels = np.rint(points[:, :2] / points[:, 2:] * pinhole.FOCAL_LENGTH_PX
                     + (pinhole.CENTER_U, pinhole.CENTER_V)).astype(int)
    image[pixels[:, 1], pixels[:, 0]] = points[:, 2]
    return image


def _difference(expected: np.ndarray, measured: np.ndarray) -> float:
    """Sum the differences of all pixels, each limited, where the box has the robot."""
    lowest = pinhole.POSITION[2] - (BOX['center'][2] - BOX['size'][2] / 2)
    in_box = np.where(expected < lowest, expected, np.inf)
    with np.errstate(invalid='ignore'):
        apart = np.abs(in_box - measured)
    return float(np.nan_to_num(apart, nan=0.0, posinf=MAX_M).clip(0, MAX_M).sum())


def _minimum(places: np.ndarray, costs: np.ndarray) -> Optional[float]:
    """Return the minimum of a parabola through the lowest three; None if they are at an end."""
    index = int(costs.argmin())
    if index in (0, len(costs) - 1):
        return None
    low, middle, high = costs[index - 1:index + 2]
    curvature = low - 2 * middle + high
    step = float(places[1] - places[0])
    return float(places[index]) + (0.5 * (low - high) / curvature * step if curvature > 0 else 0.0)


@contextlib.contextmanager
def cell(*options: str) -> Iterator[None]:
    """Run the simulated cell without RViz, with a box around the robot."""
    process = subprocess.Popen(
        ['rosrun', 'process_visualizer', 'cell', 'run', str(CONFIG), '--devices', DEVICES,
         '--no-rviz', *options], stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        rospy.wait_for_message('/kinect/points', PointCloud2, _TIMEOUT_S)
        for name, value in BOX.items():
            rospy.set_param(f'/kinect/kinect_roi/{name}', value)
        time.sleep(_SETTLING_S)
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def record(path: str, seconds: float) -> None:
    """Record what the cell's devices publish."""
    subprocess.run(['rosrun', 'rosbag', 'record', '-O', path, f'--duration={seconds}', *TOPICS],
                   stdout=subprocess.DEVNULL, check=True)


def _off_s(measured: np.ndarray, links: Callable[[float], np.ndarray]) -> Optional[float]:
    """Return a depth image's delay relative to the robot's links by delay; None if not found."""
    costs = [_difference(_expected(links(shift)), measured) for shift in SHIFTS_S]
    return _minimum(SHIFTS_S, np.array(costs))


def play(seconds: float) -> Dict[str, List[Offset]]:
    """Compare forwards and backwards."""
    client = PlayerClient()
    client.wait_until_ready(_TIMEOUT_S)
    found: Dict[str, List[Offset]] = {}
    for rate in RATES:
        with Watch(rate) as watch:
            start(client, rate, 1.0 if rate > 0 else seconds - 1.0)
            found[f'played at {rate:g}x'] = watch.run((seconds - 4.0) / max(1.0, -rate))
    client.close()
    return found


def start(client: PlayerClient, rate: float, begin_s: float) -> None:
    """Play from a position."""
    client.set_rate(rate)
    client.seek(begin_s)
    client.play()
    time.sleep(_RUN_UP_S)


def print_table(found: Dict[str, List[Offset]]) -> None:
    """Print the medians and the 95th percentiles."""
    print('| cloud against robot | clouds | at its stamp: median | p95 '
          '| at its arrival: median | p95 |\n|---|---|---|---|---|---|')
    for name, offsets in found.items():
        if not offsets:
            print(f'| {name} | 0 | | | | |')
            continue
        values = 1e3 * np.percentile(np.array(offsets), [50, 95], axis=0).T
        print(f'| {name} | {len(offsets)} | '
              + ' | '.join(f'{value:.1f} mm' for value in values.ravel()) + ' |')


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=20, help='of each part')
    options = parser.parse_args()
    bag = os.path.join(os.environ['ROS_HOME'], 'cell.bag')
    found: Dict[str, List[Offset]] = {}
    with ros_master():
        rospy.init_node('bench_cloud_time', disable_signals=True)
        with cell():
            with Watch() as watch:
                found['live'] = watch.run(options.seconds)
            record(bag, options.seconds)
        with cell('--mode', 'playback', '--bag', bag):
            found.update(play(options.seconds))
    print_table(found)


if __name__ == '__main__':
    main()
