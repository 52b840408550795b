# SPDX-License-Identifier: BSD-3-Clause
"""Measures the fusion of the cropped clouds of one to four depth sensors.

usage: bench/run fusion [--seconds 10] [--rounds 3]

Registered images of 640x480 are published at 30 Hz; each sensor crops them with RegisteredCrop, and
CloudFusion joins the results in voxels of 5 mm. Either all nodelets share one manager, or each
sensor has its own and the fusion another one, which the clouds reach through sockets. The CPU time
is that of all these processes together. "Delay": from the images' stamp to the arrival of the
joined cloud at a subscriber. Medians of the rounds. Before that, VoxelGrid alone is compared with
pcl::VoxelGrid.
"""
from __future__ import annotations

import argparse
import contextlib
import statistics
import time
from typing import Dict, Iterator, List, NamedTuple

import rospy
from depth import Manager, Way, run_programs, running_camera
from sensor_msgs.msg import PointCloud2

MAX_SENSORS = 4
VOXEL_M = 0.005
SETTLING_S = 2.0
START_TIMEOUT_S = 60.0


class Figures(NamedTuple):
    """Output and CPU time of the fusion."""

    clouds_per_s: float
    delay_ms: float
    cpu_ms_per_cloud: float
    points: int


class Arrivals:
    """Counts joined clouds while it is used as a context manager."""

    def __init__(self, topic: str) -> None:
        self.delays_s: List[float] = []
        self.points: List[int] = []
        self._subscriber = rospy.Subscriber(topic, PointCloud2, self._take, queue_size=10,
                                            buff_size=1 << 24, tcp_nodelay=True)

    def __enter__(self) -> 'Arrivals':
        return self

    def __exit__(self, *_exception: object) -> None:
        self._subscriber.unregister()

    def _take(self, cloud: PointCloud2) -> None:
        self.delays_s.append((rospy.Time.now() - cloud.header.stamp).to_sec())
        self.points.append(cloud.width)


@contextlib.contextmanager
def fused(sensors: int, is_shared: bool, name: str) -> Iterator[List[Manager]]:
    """The managers of sensors and fusion; the output is on ``/NAME_fusion/output``."""
    counts = [sensors] if is_shared else [1] * sensors
    names = [f'{name}_{number}' for number in range(len(counts))]
    rospy.set_param(f'/{name}_fusion', {
        'topics': [f'/{manager}_crop_{number}/output' for manager, count in zip(names, counts)
                   for number in range(count)], 'frame': 'box', 'voxel': VOXEL_M})
    with contextlib.ExitStack() as stack:
        managers = [stack.enter_context(Manager(
            Way(False, 'process_visualizer/RegisteredCrop', count), manager))
            for manager, count in zip(names, counts)]
        if not is_shared:
            managers.append(stack.enter_context(Manager(Way(False, '', 0), f'{name}_joining')))
        managers[-1].load('process_visualizer/CloudFusion', f'{name}_fusion', {})
        yield managers


def measure(sensors: int, is_shared: bool, name: str, seconds: float) -> Figures:
    """Run one way."""
    topic = f'/{name}_fusion/output'
    with fused(sensors, is_shared, name) as managers, Arrivals(topic) as arrivals:
        rospy.wait_for_message(topic, PointCloud2, START_TIMEOUT_S)
        time.sleep(SETTLING_S)
        begin, begin_cpu_s = len(arrivals.delays_s), sum(it.cpu_s() for it in managers)
        time.sleep(seconds)
        end, cpu_s = len(arrivals.delays_s), sum(it.cpu_s() for it in managers) - begin_cpu_s
    count = end - begin
    return Figures(count / seconds, 1e3 * statistics.median(arrivals.delays_s[begin:end]),
                   1e3 * cpu_s / count, arrivals.points[-1])


def measure_all(seconds: float, rounds: int) -> Dict['tuple[int, bool]', Figures]:
    """Return the medians of all ways, which are run in turn."""
    ways = [(sensors, is_shared) for sensors in range(1, MAX_SENSORS + 1)
            for is_shared in (True, False)]
    found: Dict['tuple[int, bool]', List[Figures]] = {way: [] for way in ways}
    for number in range(rounds):
        for way in ways:
            name = f'way_{number}_{way[0]}_{"shared" if way[1] else "own"}'
            found[way].append(measure(*way, name, seconds))
    return {way: Figures(*(statistics.median(values) for values in zip(*figures)))
            for way, figures in found.items()}


def print_table(figures: Dict['tuple[int, bool]', Figures]) -> None:
    """Print all ways."""
    print('| sensors | managers | clouds/s | delay | CPU per cloud | points |\n'
          '|---|---|---|---|---|---|')
    for (sensors, is_shared), it in figures.items():
        print(f'| {sensors} | {"one for all" if is_shared else "one each"} '
              f'| {it.clouds_per_s:.1f} | {it.delay_ms:.0f} ms | {it.cpu_ms_per_cloud:.1f} ms '
              f'| {it.points} |')


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=10, help='of each run')
    parser.add_argument('--rounds', type=int, default=3)
    options = parser.parse_args()
    run_programs(('voxel_grid_benchmark',))
    with running_camera('bench_fusion'):
        print_table(measure_all(options.seconds, options.rounds))


if __name__ == '__main__':
    main()
