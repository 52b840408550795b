# SPDX-License-Identifier: BSD-3-Clause
"""Cost and delay of a depth sensor's crop, compared with depth_image_proc and pcl_ros.

usage: bench/run depth [--seconds 15] [--rounds 3] [--busy 0] [--only WAY]

A camera in a nodelet manager, as a driver is (camera_manager.cpp), publishes registered images of
640x480 at 30 Hz. In this manager, one of three ways turns them into the cloud in a box, which goes
to a subscriber in another process, as to RViz. The CPU time of the manager's process, including
the camera, is divided by the number of published clouds. The cost of one filter alone is the
difference between a manager with three instances of it and one with a single instance. "Delay":
from the stamp, which is the time when the camera publishes an image, to the arrival of the cloud
at the subscriber, of all rounds. The box is the same: pcl/CropBox has it in the camera's frame,
ours transform each point into another frame. Medians of the rounds. With ``--busy``, this many
other processes compute all the time.
"""
from __future__ import annotations

import argparse
import contextlib
import glob
import os
import statistics
import subprocess
import sys
import time
from typing import Dict, Iterator, List, NamedTuple, Sequence

import numpy as np
import rospy
from arrival_recorder import ArrivalRecorder, build_program, build_recorder
from players import ros_master
from roslib.packages import find_node

CENTER_M = (0.0, 0.0, 2.0)
SIZE_M = (1.0, 0.8, 1.0)
SETTLING_S = 2.0
START_TIMEOUT_S = 60.0
POINT_BYTES = 32
CAMERA = 'bench_camera_manager'
PROGRAMS = ('roi_filter_benchmark', 'registered_crop_benchmark')


class Way(NamedTuple):
    """A way from images to the points in the box: the number of instances of each nodelet."""

    whole_clouds: bool
    filter: str
    count: int


WAYS: Dict[str, Way] = {
    'depth_image_proc + pcl/CropBox': Way(True, 'pcl/CropBox', 1),
    'depth_image_proc + 3 pcl/CropBox': Way(True, 'pcl/CropBox', 3),
    'depth_image_proc + RoiFilter': Way(True, 'process_visualizer/RoiFilter', 1),
    'depth_image_proc + 3 RoiFilter': Way(True, 'process_visualizer/RoiFilter', 3),
    'RegisteredCrop': Way(False, 'process_visualizer/RegisteredCrop', 1),
}


class Figures(NamedTuple):
    """CPU time and output of a manager."""

    cpu_ms_per_cloud: float
    frames_per_s: float
    clouds_per_s: float
    points: int
    delays_ms: np.ndarray


class Manager:
    """A nodelet manager with the nodelets of a way, with or without a camera; a context manager."""

    def __init__(self, way: Way, name: str, has_camera: bool = False) -> None:
        self._name = name
        self._processes = [start_camera(name) if has_camera
                           else _start('manager', f'__name:={name}')]
        points = f'/{name}_cloud/points'
        if way.whole_clouds:
            self.load('depth_image_proc/point_cloud_xyzrgb', f'{name}_cloud', {
                'depth_registered/image_rect': '/depth', 'rgb/image_rect_color': '/color',
                'rgb/camera_info': '/camera_info', 'depth_registered/points': points})
        for number in range(way.count):
            self._load_filter(way.filter, f'{name}_crop_{number}', points)

    def __enter__(self) -> 'Manager':
        return self

    def __exit__(self, *_exception: object) -> None:
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            process.wait()

    def cpu_s(self) -> float:
        """Return the CPU time that the manager's process has used so far."""
        with open(f'/proc/{self._processes[0].pid}/stat', encoding='ascii') as file:
            words = file.read().rpartition(')')[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf('SC_CLK_TCK')

    def _load_filter(self, kind: str, name: str, points: str) -> None:
        rospy.set_param(f'/{name}', _box())
        self.load(kind, name, {'~input': points, '~depth': '/depth', '~color': '/color',
                               '~camera_info': '/camera_info'})

    def load(self, kind: str, name: str, remaps: Dict[str, str]) -> None:
        """Load a nodelet."""
        self._processes.append(_start(
            'load', kind, self._name, '--no-bond', f'__name:={name}',
            *(f'{old}:={new}' for old, new in remaps.items())))


def _box() -> Dict[str, object]:
    """The parameters of our filters, and those of pcl/CropBox."""
    limits = {f'{side}_{axis}': center + sign * size / 2
              for axis, center, size in zip('xyz', CENTER_M, SIZE_M)
              for side, sign in (('min', -1), ('max', 1))}
    return {'frame': 'box', 'center': list(CENTER_M), 'size': list(SIZE_M), **limits}


def _start(*arguments: str) -> 'subprocess.Popen[bytes]':
    return subprocess.Popen([find_node('nodelet', 'nodelet')[0], *arguments],
                            stdout=subprocess.DEVNULL)


def start_camera(name: str) -> 'subprocess.Popen[bytes]':
    """Start a manager of this name with a camera in it."""
    return subprocess.Popen([find_node('process_visualizer', CAMERA)[0], f'__name:={name}'],
                            stdout=subprocess.DEVNULL)


def measure(way: Way, name: str, seconds: float) -> Figures:
    """Run a way and return its figures."""
    outputs = [f'/{name}_crop_{number}/output' for number in range(way.count)]
    path = os.path.join(os.environ['ROS_HOME'], 'arrivals')
    with ArrivalRecorder([*outputs, '/camera_info'], path) as recorder:
        with Manager(way, name, has_camera=True) as manager:
            for output in outputs:
                rospy.wait_for_message(output, rospy.AnyMsg, START_TIMEOUT_S)
            time.sleep(SETTLING_S)
            begin_ns, begin_cpu_s = time.monotonic_ns(), manager.cpu_s()
            time.sleep(seconds)
            end_ns, cpu_s = time.monotonic_ns(), manager.cpu_s() - begin_cpu_s
        arrivals = recorder.finish()
    arrivals = arrivals[(arrivals['time_ns'] >= begin_ns) & (arrivals['time_ns'] < end_ns)]
    clouds = arrivals[arrivals['topic'] == 0]
    frames = np.count_nonzero(arrivals['topic'] == way.count)
    return Figures(1e3 * cpu_s / len(clouds), frames / seconds, len(clouds) / seconds,
                   int(np.median(clouds['size'])) // POINT_BYTES, delays_ms(clouds))


def delays_ms(arrivals: np.ndarray) -> np.ndarray:
    """Return the delays from the stamp in the header of a message to its arrival."""
    words = np.ascontiguousarray(arrivals['front'][:, :12]).view('<u4').astype(np.int64)
    stamp_ns = words[:, 1] * 1_000_000_000 + words[:, 2]
    wall_ns = arrivals['time_ns'] + (time.time_ns() - time.monotonic_ns())
    return 1e-6 * (wall_ns - stamp_ns)


def measure_all(names: Sequence[str], seconds: float, rounds: int) -> Dict[str, Figures]:
    """Return the medians of some ways, which are run in turn, with all delays."""
    found: Dict[str, List[Figures]] = {name: [] for name in names}
    for number in range(rounds):
        for place, name in enumerate(names):
            found[name].append(measure(WAYS[name], f'way_{place}_{number}', seconds))
    return {name: _together(figures) for name, figures in found.items()}


def _together(figures: Sequence[Figures]) -> Figures:
    return Figures(statistics.median(it.cpu_ms_per_cloud for it in figures),
                   statistics.median(it.frames_per_s for it in figures),
                   statistics.median(it.clouds_per_s for it in figures), figures[0].points,
                   np.concatenate([it.delays_ms for it in figures]))


def print_table(figures: Dict[str, Figures]) -> None:
    """Print the ways, and the cost of one filter alone."""
    print('| images to cropped cloud, in one manager | CPU per frame | frames/s | clouds/s '
          '| points | delay: clouds | median | p95 | p99 |\n|---|---|---|---|---|---|---|---|---|')
    for name, it in figures.items():
        delays = ' | '.join(f'{value:.1f} ms' for value in np.percentile(it.delays_ms,
                                                                         [50, 95, 99]))
        print(f'| {name} | {it.cpu_ms_per_cloud:.1f} ms | {it.frames_per_s:.1f} '
              f'| {it.clouds_per_s:.1f} | {it.points} | {len(it.delays_ms)} | {delays} |')
    for name in ('pcl/CropBox', 'RoiFilter') if len(figures) == len(WAYS) else ():
        three, one = figures[f'depth_image_proc + 3 {name}'], figures[f'depth_image_proc + {name}']
        alone_ms = (three.cpu_ms_per_cloud - one.cpu_ms_per_cloud) / 2
        print(f'| {name} alone: half of what two more of it take | {alone_ms:.1f} ms '
              '| | | | | | | |')


@contextlib.contextmanager
def busy_machine(count: int) -> Iterator[None]:
    """Run other processes that compute all the time."""
    processes = [subprocess.Popen([sys.executable, '-c', 'while True: pass'])
                 for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@contextlib.contextmanager
def running_frames(node: str) -> Iterator[None]:
    """Provide a master, this process as a node, and a camera's frame in the frame of the box."""
    with ros_master():
        rospy.init_node(node, disable_signals=True)
        frames = subprocess.Popen([find_node('tf2_ros', 'static_transform_publisher')[0],
                                   *'0 0 0 0 0 0 box camera'.split()], stdout=subprocess.DEVNULL)
        try:
            yield
        finally:
            frames.terminate()


@contextlib.contextmanager
def running_camera(node: str) -> Iterator[None]:
    """Provide the same, and a camera in a process of its own."""
    build_program(CAMERA)
    with running_frames(node):
        camera = start_camera('camera')
        try:
            yield
        finally:
            camera.terminate()
            camera.wait()


def find_pcl_filters() -> None:
    """Let pluginlib find pcl_ros's filters: Debian has them outside of its search path."""
    libraries = glob.glob('/usr/lib/*/libpcl_ros_filters.so*')
    if libraries:
        prefix = os.path.join(os.environ['ROS_HOME'], 'pcl_ros')
        os.makedirs(os.path.join(prefix, 'lib'))
        os.symlink(libraries[0], os.path.join(prefix, 'lib', 'libpcl_ros_filters.so'))
        os.environ['CMAKE_PREFIX_PATH'] += os.pathsep + prefix


def run_programs(programs: Sequence[str] = PROGRAMS) -> None:
    """Run the benchmarks of the filters without nodes."""
    devel = os.environ['CMAKE_PREFIX_PATH'].split(os.pathsep)[0]
    build = ['cmake', '--build', os.path.join(devel, '..', 'build'), '--target']
    for program in programs:
        subprocess.run([*build, program], stdout=subprocess.DEVNULL, check=True)
        print(program, flush=True)
        path = os.path.join(devel, 'lib', 'process_visualizer', program)
        if subprocess.run([path]).returncode:
            sys.exit(f'{program}: slower than its limit, see above')


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=15, help='of each run')
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--busy', type=int, default=0, help='processes that keep the machine busy')
    parser.add_argument('--only', choices=WAYS, help='measure this way only')
    options = parser.parse_args()
    build_recorder()
    build_program(CAMERA)
    run_programs()
    find_pcl_filters()
    with running_frames('bench_depth'), busy_machine(options.busy):
        figures = measure_all([options.only] if options.only else list(WAYS),
                              options.seconds, options.rounds)
    print_table(figures)


if __name__ == '__main__':
    main()
