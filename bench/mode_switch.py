# SPDX-License-Identifier: BSD-3-Clause
"""Delay of the switches from live to playback and back, with one click each.

usage: bench/run mode_switch [--times 10]

The simulated cell without its Kinect, in the real window with RViz. To playback: until a robot's
joint states are those of the position where playback was left; to live: until they are the
driver's.
"""
from __future__ import annotations

import argparse
import time
from typing import Callable, List, Tuple

import numpy as np
import rospy
from bench_window import BenchWindow, pause, until
from sensor_msgs.msg import JointState

from process_visualizer.gui.playback.playback_model import PlaybackModel

ROBOT, RECORDED_S = 'ur_rt_upper', 25.0
SAME, AWAY = 1e-6, 0.05  # rad
TIMEOUT_S, REST_S = 30.0, 3.0


class Robot:
    """The newest joint positions of the robot in the scene."""

    def __init__(self) -> None:
        self.positions: Tuple[float, ...] = ()
        rospy.Subscriber(f'/{ROBOT}/joint_states', JointState, self._take)

    def _take(self, message: JointState) -> None:
        self.positions = message.position

    def is_at(self, place: Tuple[float, ...], within: float = SAME) -> bool:
        """Return whether the robot's joints are at a position."""
        return len(self.positions) == len(place) > 0 and bool(
            np.allclose(self.positions, place, rtol=0.0, atol=within))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--times', type=int, default=10)
    times = parser.parse_args().times
    bench = BenchWindow()
    try:
        bench.launcher.cell.tick('kinect', False)
        bench.launch()
        path = bench.record(RECORDED_S)
        bench.launcher.play((path,))
        playback = bench.launcher.playback
        until(lambda: playback.state.duration_s > RECORDED_S / 2, 60.0)
        print('| from the click to the scene, s | median | p95 | longest |\n|---|---|---|---|')
        live, back = measured(bench, playback, times)
        for name, found in (('playback to live', live), ('live to playback', back)):
            print(f'| {name} | {np.median(found):.2f} | {np.percentile(found, 95):.2f} '
                  f'| {max(found):.2f} |', flush=True)
    finally:
        bench.close()


def measured(bench: BenchWindow, playback: PlaybackModel,
             times: int) -> Tuple[List[float], List[float]]:
    """Return the times [s] until live, and until the same position of the recording again."""
    robot, live, back = Robot(), [], []
    place = go_away(robot, playback)
    for _ in range(times):
        live.append(taken_s(bench, 'realtime', lambda: not robot.is_at(place)))
        until(lambda: bench.launcher.launch.is_running, TIMEOUT_S)
        pause(REST_S)
        back.append(taken_s(bench, 'playback',
                            lambda: robot.is_at(place) and playback.state.is_available))
        until(lambda: bench.launcher.launch.is_running, TIMEOUT_S)
        pause(REST_S)
    return live, back


def go_away(robot: Robot, playback: PlaybackModel) -> Tuple[float, ...]:
    """Seek to where the robot's pose differs from the beginning; return its joint positions."""
    playback.pause()
    playback.seek(0.0)
    pause(REST_S)
    rest = robot.positions
    for position_s in np.arange(2.0, playback.state.duration_s, 1.0):
        playback.seek(float(position_s))
        pause(1.0)
        if not robot.is_at(rest, AWAY):
            return robot.positions
    raise ValueError('the robot does not move in the recording')


def taken_s(bench: BenchWindow, name: str, is_there: Callable[[], bool]) -> float:
    """Click, and return the time [s] until the scene is there."""
    begin_s = time.monotonic()
    bench.click(name)
    until(is_there, TIMEOUT_S)
    return time.monotonic() - begin_s


if __name__ == '__main__':
    main()
