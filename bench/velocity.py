# SPDX-License-Identifier: BSD-3-Clause
"""Compares the tool's velocity with the simulator's truth: live, and played at several rates.

usage: bench/run velocity [--rates 0.25 1 -1 4] [--paused 200] [--seconds 22] [--bag FILE]
                          [--plot FILE.png]

The simulated cell runs as `cell run` starts it, without RViz, and is recorded. Then the cell runs
in playback mode with the same devices, and the player plays at each rate; then it pauses at random
positions, reached by seeking, by single steps, and by pausing during playback. Beside the estimate
is the result of the thesis from the same messages: the difference of two positions over the time
between their arrivals (equation 5.1, figure 6.15).

An estimate is compared with the truth at its stamp; the delay is the time from then to its arrival.
Errors are lengths of vectors, as shares of the largest speed. A false zero is a speed too low for
an arrow while the tool moves at 20 mm/s or more; a spike is an error above 6 % of the peak, three
times the permitted noise. The simulator's positions have no noise: all of it comes from the times.
It is the difference between the estimate and the slope of the true positions in its window; its
RMS is printed, and the largest one as a multiple of that.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Tuple

import numpy as np
import rosbag
import rospy
from recorders import OwnRecorder
from std_srvs.srv import Trigger
from velocity_paused import STATE, Comparison, Standing, command, report, standings
from velocity_plot import write_plot
from velocity_truth import ROBOT, SEED, Truth

from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.view_picture import wait_for_master
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.playback.playback_clock import ClockState, PlaybackClock
from process_visualizer.srv import Seek, SetRate

POSE, VELOCITY = f'/{ROBOT}/tcf', f'/{ROBOT}/tool_velocity'
TOPICS = ['/ur_rt_upper/q_act', '/ur_rt_upper/tcf', '/ur_rt_lower/q_act', '/ur_rt_lower/tcf',
          '/ft_upper/ft', '/ft_lower/ft', '/camera/rgb/image_color', '/camera/rgb/camera_info',
          '/camera/depth_registered/image_raw', '/camera/depth_registered/camera_info',
          '/edge_finder_upper', '/edge_finder_lower', '/feed_rate_est']
WINDOW_S = RobotParameters.velocity_window_s
_WARM_UP_S = 10.0  # until every node has started and the first images are drawn
_TIMEOUT_S = 60.0
_ZERO_M_PER_S, _MOVING_M_PER_S, _SPIKE_PERCENT = 0.002, 0.02, 6.0


class Run(NamedTuple):
    """The arrivals: poses (n, 4), velocities (n, 5) with wall times [s], the player's states.

    A pose is its arrival and x y z; a velocity is its stamp, its arrival, and x y z.
    """

    poses: np.ndarray
    velocities: np.ndarray
    states: List[ClockState]
    bag_begin_s: float = 0.0  # of position 0

    def bag_times(self, wall_s: np.ndarray) -> np.ndarray:
        """Return times (n,) [s] of the recording's clock for wall times (n,) in order."""
        if not self.states:
            return wall_s
        clock, states, found = PlaybackClock(), iter(self.states), []
        known_s = 0.0
        for one_s in wall_s:
            while known_s < one_s + 0.3 and (state := next(states, None)) is not None:
                clock.add(state)
                known_s = state.stamp_s
            bag = clock.bag_time(one_s)
            wanted = bag is not None and bag.segment == self.states[-1].segment
            found.append(bag.time_s if bag is not None and wanted else np.nan)
        return np.array(found) + self.bag_begin_s


class Series(NamedTuple):
    """Velocities (n, 3) [m/s] at times (n,) [s] since the simulation began, and the truth."""

    time_s: np.ndarray
    value: np.ndarray
    truth: np.ndarray
    smooth: np.ndarray  # the truth as the slope over a window that begins half of it before

    def at(self, times_s: np.ndarray) -> np.ndarray:
        """Return velocities (n, 3) [m/s] at other times (n,) [s], interpolated linearly."""
        return np.column_stack([np.interp(times_s, self.time_s, axis) for axis in self.value.T])

    def noise(self) -> str:
        """Return the RMS of the noise in % of the peak, and the largest as a multiple of it."""
        noise = _length(self.value - self.smooth) / _length(self.truth).max() * 100
        rms = np.sqrt((noise ** 2).mean())
        return f'{rms:.2f} | {noise.max() / rms:.1f}'

    def row(self) -> str:
        """Return RMS and largest error in % of the peak, numbers of false zeros and spikes."""
        error = _length(self.value - self.truth) / _length(self.truth).max() * 100
        zeros = (_length(self.value) < _ZERO_M_PER_S) & (_length(self.truth) > _MOVING_M_PER_S)
        return (f'{np.sqrt((error ** 2).mean()):.2f} | {error.max():.1f} | {zeros.sum()} | '
                f'{(error > _SPIKE_PERCENT).sum()}')


def main() -> int:
    options = _options()
    folder = Path(os.environ['ROS_HOME'])
    folder.mkdir(parents=True, exist_ok=True)
    bag = options.bag or str(folder / 'velocity_cell.bag')
    port = os.environ['ROS_MASTER_URI'].rpartition(':')[2]
    with running('roscore', '-p', port):
        wait_for_master(30)
        rospy.init_node('velocity_benchmark', disable_signals=True)
        if not os.path.exists(bag):
            _record(bag, options.seconds)
        runs = {'live': _read(bag)}
        played, standing = _played(bag, options, folder)
    runs.update(played)
    _report(runs, standing, bag, options)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--paused', type=int, default=200, help='how many positions')
    parser.add_argument('--rates', nargs='*', type=float, default=[0.25, 1.0, -1.0, 4.0])
    parser.add_argument('--seconds', type=float, default=22.0, help='of simulation')
    parser.add_argument('--bag', help='keep the recording here, or play this one')
    parser.add_argument('--plot', help='a .png file')
    return parser.parse_args()


@contextmanager
def running(*command: str) -> Iterator['subprocess.Popen[bytes]']:
    """Run a program in a ``with``, and interrupt it at the end."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(_TIMEOUT_S)


@contextmanager
def running_cell(*options: str) -> Iterator[None]:
    """Run the simulated cell in a ``with``, once every node has registered."""
    config = Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml'
    with running('rosrun', 'process_visualizer', 'cell', 'run', str(config), '--no-rviz',
                 *options):
        rospy.wait_for_message(POSE, rospy.AnyMsg, _TIMEOUT_S)
        yield


def _record(bag: str, seconds: float) -> None:
    with running_cell(f'seed:={SEED}'):
        recorder = BagRecorder()  # of the cell
        recorder.wait_until_ready(_TIMEOUT_S)
        time.sleep(_WARM_UP_S)
        recorder.start(RecordingOptions((*TOPICS, VELOCITY), folder=os.path.dirname(bag),
                                        name=os.path.basename(bag)))
        time.sleep(seconds)
        recorder.stop()
        recorder.close()


def _played(bag: str, options: argparse.Namespace,
            folder: Path) -> Tuple[Dict[str, Run], Dict[str, List[Standing]]]:
    runs: Dict[str, Run] = {}
    with running_cell('--mode', 'playback', '--bag', bag):
        time.sleep(_WARM_UP_S)
        for number, rate in enumerate(options.rates):
            command('pause', Trigger)
            command('set_rate', SetRate, rate)
            path = str(folder / f'played_{number}.bag')
            recorder = OwnRecorder(path, [POSE, VELOCITY, STATE])
            recorder.start()
            state = rospy.wait_for_message(STATE, PlayerState, _TIMEOUT_S)
            command('seek', Seek, 0.0 if rate > 0.0 else state.duration)
            command('play', Trigger)
            _wait_for_the_end(rate)
            recorder.stop()
            runs[f'{rate:g}x'] = _read(path)
            os.remove(path)
        return runs, standings(options.paused) if options.paused else {}


def _wait_for_the_end(rate: float) -> None:
    while True:
        state = rospy.wait_for_message(STATE, PlayerState, _TIMEOUT_S)
        left_s = state.duration - state.position if rate > 0.0 else state.position
        if left_s < 0.02 * abs(rate):
            return
        time.sleep(min(max(left_s / abs(rate) - 0.01, 0.01), 1.0))


def _read(path: str) -> Run:
    poses: List[Tuple[float, ...]] = []
    velocities: List[Tuple[float, ...]] = []
    states: List[ClockState] = []
    begin_s = 0.0
    with rosbag.Bag(path) as bag:
        for topic, message, stamp in bag.read_messages(topics=[POSE, VELOCITY, STATE]):
            if topic == POSE:
                poses.append((stamp.to_sec(), *message.data[:3]))
            elif topic == VELOCITY:
                linear = message.twist.linear
                velocities.append((message.header.stamp.to_sec(), stamp.to_sec(),
                                   linear.x, linear.y, linear.z))
            else:
                begin_s = message.begin.to_sec()
                states.append(ClockState(
                    message.stamp.to_sec(), message.position, message.rate, message.paused,
                    message.segment, message.since.to_sec()))
    return Run(np.array(poses), np.array(velocities), states, begin_s)


def _report(runs: Dict[str, Run], standing: Dict[str, List[Standing]], bag: str,
            options: argparse.Namespace) -> None:
    truth, plots = Truth(600.0), {}
    live = runs['live'].poses
    begin_s = truth.begin_s(live[:, 0], live[:, 1:])
    print('| | estimate: RMS, % of peak | largest error, % | false zeros | spikes | '
          'noise: RMS, % | largest, times the RMS | delay, ms | '
          'two samples: RMS, % | largest error, % | false zeros | spikes |\n' + '|---' * 12 + '|')
    for name, run in runs.items():
        rate = float(name.strip('x')) if run.states else 1.0
        estimate = _series(run.bag_times(run.velocities[:, 0]) - begin_s, run.velocities[:, 2:],
                           truth)
        two = _two_samples(run, rate, begin_s, truth)
        delay_ms = 1e3 * np.median(run.velocities[:, 1] - run.velocities[:, 0])
        print(f'| {name} | {estimate.row()} | {estimate.noise()} | {delay_ms:.0f} | {two.row()} |',
              flush=True)
        plots[name] = (estimate, two)
    if standing:
        peak_m_per_s = _length(plots['live'][0].truth).max()
        report(standing, bag, Comparison(truth, begin_s, peak_m_per_s, plots['1x'][0].at))
    if options.plot:
        write_plot(options.plot, plots)


def _two_samples(run: Run, rate: float, begin_s: float, truth: Truth) -> Series:
    """Compute the thesis' equation 5.1."""
    arrival_s, positions = run.poses[:, 0], run.poses[:, 1:]
    times_s = run.bag_times(arrival_s) - begin_s
    with np.errstate(divide='ignore', invalid='ignore'):
        values = np.diff(positions, axis=0) / (np.diff(arrival_s) * rate)[:, None]
    return _series(0.5 * (times_s[1:] + times_s[:-1]), values, truth)


def _series(times_s: np.ndarray, values: np.ndarray, truth: Truth) -> Series:
    known = np.isfinite(times_s) & np.isfinite(values).all(axis=1)
    times_s, values = times_s[known], values[known]
    return Series(times_s, values, truth.velocity(times_s), truth.slope(times_s, WINDOW_S))


def _length(vectors: np.ndarray) -> np.ndarray:
    length: np.ndarray = np.linalg.norm(vectors, axis=1)
    return length


if __name__ == '__main__':
    sys.exit(main())
