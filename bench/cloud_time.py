# SPDX-License-Identifier: BSD-3-Clause
"""Measures how far a cloud is from the robot that moves in it, at the stamp of the cloud.

usage: bench/run cloud_time [--seconds 20]

The simulated cell runs, is recorded, and is played back. From the tf of the upper robot at a
cloud's stamp, and at times around it, the depth image is computed that the simulated Kinect would
see. The time at which it agrees best with the cloud says how long the stamp is off, and with the
tool's speed how far the cloud is from the robot. "Arrival": if the stamp were that of the arrival.

At rest (after a seek, a step back, a pause forwards and backwards) the cloud that is shown is held
against the robot that is shown. Where either was at a time of the recording is known from playing
forwards.
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
from process_visualizer.motion.rotations import matrix_from_quaternion
from sewing_cell import layout, pinhole, silhouette
from sewing_cell.arms import UPPER

CONFIG = Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml'
DEVICES = 'ur_rt_upper,kinect,simulator'
TOPICS = ('/ur_rt_upper/q_act', '/camera/rgb/image_color', '/camera/rgb/camera_info',
          '/camera/depth_registered/image_raw')
LINKS = [f'ur_rt_upper/link{number}' for number in range(8)] + ['ur_rt_upper/tool']
BOX = {'center': [-0.5, 0.0, 0.3], 'size': [1.4, 2.4, 0.4]}  # above the covers, m
SHIFTS_S = np.arange(-0.08, 0.0801, 0.01)
SLOWEST_M_PER_S = 0.1
EVERY = 3
"""Of so many clouds one is compared."""
FARTHEST_M = 0.03
RATES = (1.0, -1.0, -0.5, -2.0)
RESTS = 80
"""How often it is looked at rest in each way."""
_REST_S = 0.6
_RUN_UP_S = 0.5
_TIMEOUT_S = 60.0
_SETTLING_S = 3.0
_BUFFER_S = 600.0


class Offset(NamedTuple):
    """How far a cloud is from the robot, m: as stamped, and if it were stamped at its arrival.

    At rest both are the distance of what is shown.
    """

    stamped_m: float
    at_arrival_m: float


class Watch:
    """Keeps clouds and all transforms, and compares them afterwards."""

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
        """Compare the clouds of some time."""
        time.sleep(seconds)
        self._clouds.unregister()
        compared = (self._compare(*it) for it in self._clouds_with_arrival)
        return [offset for offset in compared if offset is not None]

    def _take(self, cloud: PointCloud2) -> None:
        arrival_s = rospy.get_time()
        self._newest = cloud
        self._count += 1
        if self._count % EVERY == 0:
            self._clouds_with_arrival.append((cloud, arrival_s))

    def _compare(self, cloud: PointCloud2, arrival_s: float) -> Optional[Offset]:
        stamp_s = cloud.header.stamp.to_sec()
        try:
            before, after = self.links(stamp_s - 0.02), self.links(stamp_s + 0.02)
            speed = float(np.linalg.norm(after[8] - before[8])) / 0.04
            if speed < self._slowest:
                return None
            measured = _depth_image(cloud)
            off_s = cloud_off_s(measured, lambda shift: self.links(stamp_s + shift))
        except tf2_ros.TransformException:
            return None
        return None if off_s is None else Offset(
            abs(off_s) * speed, abs(stamp_s + off_s - arrival_s) * speed)

    def newest_cloud(self) -> PointCloud2:
        """The cloud that is shown."""
        return self._newest

    def links(self, time_s: float) -> np.ndarray:
        """Origins of the links, the tool and the gripper's tip in the world, (10, 3), m.

        Time 0 is now.
        """
        points = []
        for link in LINKS:
            it = self._buffer.lookup_transform('world', link, rospy.Time.from_sec(time_s)).transform
            points.append([it.translation.x, it.translation.y, it.translation.z])
        turned = it.rotation
        axis = matrix_from_quaternion((turned.x, turned.y, turned.z, turned.w))[:, 2]
        return np.array([*points, points[-1] + layout.GRIP_HEIGHT * axis])


def _expected(links: np.ndarray) -> np.ndarray:
    """The depth image of the robot, (480, 640), m; inf where it is not."""
    image = np.full((pinhole.HEIGHT, pinhole.WIDTH), np.inf)
    for patch in silhouette.robot(UPPER, pinhole.project(links).tolist()):
        where = (patch.rows, patch.columns)
        depth = np.where(patch.mask, patch.depth, np.inf)
        image[where] = np.minimum(image[where], depth)
    return image


def _depth_image(cloud: PointCloud2) -> np.ndarray:
    """The depth of each pixel that has a point in the box, m; inf elsewhere."""
    image = np.full((pinhole.HEIGHT, pinhole.WIDTH), np.inf)
    points = np.frombuffer(cloud.data, '<f4').reshape(-1, cloud.point_step // 4)[:, :3]
    pixels = np.rint(points[:, :2] / points[:, 2:] * pinhole.FOCAL_LENGTH_PX
                     + (pinhole.CENTRE_U, pinhole.CENTRE_V)).astype(int)
    image[pixels[:, 1], pixels[:, 0]] = points[:, 2]
    return image


def _difference(expected: np.ndarray, measured: np.ndarray) -> float:
    """Sum of the differences of all pixels, each limited, where the box has the robot."""
    lowest = pinhole.POSITION[2] - (BOX['center'][2] - BOX['size'][2] / 2)
    in_box = np.where(expected < lowest, expected, np.inf)
    with np.errstate(invalid='ignore'):
        apart = np.abs(in_box - measured)
    return float(np.nan_to_num(apart, nan=0.0, posinf=FARTHEST_M).clip(0, FARTHEST_M).sum())


def _minimum(places: np.ndarray, costs: np.ndarray) -> Optional[float]:
    """Where a parabola through the lowest three is lowest; None if that is at an end."""
    index = int(costs.argmin())
    if index in (0, len(costs) - 1):
        return None
    low, middle, high = costs[index - 1:index + 2]
    curvature = low - 2 * middle + high
    step = float(places[1] - places[0])
    return float(places[index]) + (0.5 * (low - high) / curvature * step if curvature > 0 else 0.0)


@contextlib.contextmanager
def cell(*options: str) -> Iterator[None]:
    """The simulated cell without RViz, with a box around the robot."""
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


class Rest:
    """What is shown at rest, held against the recording as it was played forwards."""

    def __init__(self, client: PlayerClient, forward: Watch, wall_s: float) -> None:
        """Take the watch over playing forwards, and the wall time of position 0 then."""
        self._client = client
        self._forward = forward
        self._wall_s = wall_s

    def run(self, come: Callable[[PlayerClient, float], object], end_s: float) -> List[Offset]:
        """Come to random positions and compare what is shown there."""
        generator = np.random.RandomState(1)
        with Watch() as shown:
            found = [self._compare(shown, come, position_s)
                     for position_s in generator.uniform(2.0, end_s, RESTS)]
        return [offset for offset in found if offset is not None]

    def _compare(self, shown: Watch, come: Callable[[PlayerClient, float], object],
                 position_s: float) -> Optional[Offset]:
        come(self._client, position_s)
        time.sleep(_REST_S)
        state = self._client.wait_for(lambda it: it.paused, _TIMEOUT_S)
        assert state is not None, 'the player pauses'
        wall_s = self._wall_s + state.position
        before, after = self._links(wall_s - 0.02), self._links(wall_s + 0.02)
        speed = float(np.linalg.norm(after[8] - before[8])) / 0.04
        if speed < SLOWEST_M_PER_S:
            return None
        robot_s = self._robot_off_s(wall_s, shown.links(0.0))
        cloud_s = cloud_off_s(_depth_image(shown.newest_cloud()),
                              lambda shift: self._links(wall_s + shift))
        if robot_s is None or cloud_s is None:
            return None
        return Offset(abs(cloud_s - robot_s) * speed, abs(cloud_s - robot_s) * speed)

    def _robot_off_s(self, wall_s: float, shown: np.ndarray) -> Optional[float]:
        """How much later than the position the robot is that is shown."""
        apart = [float(np.sum((self._links(wall_s + shift)[8] - shown[8]) ** 2))
                 for shift in SHIFTS_S]
        return _minimum(SHIFTS_S, np.array(apart))

    def _links(self, wall_s: float) -> np.ndarray:
        return self._forward.links(wall_s)


def cloud_off_s(measured: np.ndarray, links: Callable[[float], np.ndarray]) -> Optional[float]:
    """After how long the robot is where a depth image has it, given its links by that time."""
    costs = [_difference(_expected(links(shift)), measured) for shift in SHIFTS_S]
    return _minimum(SHIFTS_S, np.array(costs))


def seek(client: PlayerClient, position_s: float) -> None:
    """Go to a position while paused."""
    client.pause()
    client.seek(position_s)


def step_back(client: PlayerClient, position_s: float) -> None:
    """Go back by one image."""
    seek(client, position_s)
    client.step(-1, '/camera/rgb/image_color')


def pause(client: PlayerClient, position_s: float, rate: float) -> None:
    """Come to a position by playing, and pause there."""
    client.set_rate(rate)
    client.seek(position_s - rate * _RUN_UP_S)
    client.play()
    time.sleep(_RUN_UP_S)
    client.pause()


WAYS: Dict[str, Callable[[PlayerClient, float], object]] = {
    'at rest: after a seek': seek,
    'at rest: after a step back': step_back,
    'at rest: paused forwards': lambda client, position_s: pause(client, position_s, 1.0),
    'at rest: paused backwards': lambda client, position_s: pause(client, position_s, -1.0),
}


def play(seconds: float) -> Dict[str, List[Offset]]:
    """Compare forwards, backwards and at rest."""
    client = PlayerClient()
    client.wait_until_ready(_TIMEOUT_S)
    found: Dict[str, List[Offset]] = {}
    with Watch() as forward:
        wall_s = start(client, 1.0, 1.0)
        found['played at 1x'] = forward.run(seconds - 4.0)
        for rate in RATES[1:]:
            with Watch(rate) as watch:
                start(client, rate, seconds - 1.0)
                found[f'played at {rate:g}x'] = watch.run((seconds - 4.0) / max(1.0, -rate))
        client.set_rate(1.0)
        rest = Rest(client, forward, wall_s)
        for name, come in WAYS.items():
            found[name] = rest.run(come, seconds - 3.0)
    client.close()
    return found


def start(client: PlayerClient, rate: float, begin_s: float) -> float:
    """Play from a position; return the wall time of position 0 (if the rate is 1)."""
    client.set_rate(rate)
    client.seek(begin_s)
    client.play()
    time.sleep(_RUN_UP_S)
    state = client.state
    assert state is not None, 'the player sends its state ten times a second'
    return float(state.stamp.to_sec()) - float(state.position)


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
