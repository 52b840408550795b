# SPDX-License-Identifier: BSD-3-Clause
"""Delay of the instant replay during a recording: from the drag to the robot in the second cell.

usage: bench/run replay [--drags 60]

The simulated cell without its Kinect, in the real window with RViz. The mouse drags along the live
curves; each time the delay is measured until the robot's joint states, as the RViz of the second
cell gets them, are those recorded at that moment. Then the switches between live and replay are
measured: from the click until the replay's window is told to appear, and from Esc until it is told
to disappear; and the losses of the recording.
"""
from __future__ import annotations

import argparse
import os
import random
import time
from typing import List, Tuple

import numpy as np
import rosbag
from bench_window import BenchWindow, pause, until
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtGui import QMouseEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication
from sensor_msgs.msg import JointState

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import make_report
from process_visualizer.clients.remote_follower import RemoteFollower
from process_visualizer.gui.live.replay_model import ReplayPhase

ROBOT = 'ur_rt_upper'
MIN_S, MAX_S, WAYS = 2.0, 20.0, 5
SAME, TIMEOUT_S, Y_PX = 1e-5, 20.0, 60


class ReplayBench:
    """The mouse on the live timeline, and the robot of the second cell."""

    def __init__(self, bench: BenchWindow) -> None:
        self._bench, self._replay = bench, bench.launcher.replay
        self._timeline = bench.window.live.timeline
        self._positions: Tuple[float, ...] = ()
        self._follower: 'RemoteFollower | None' = None
        self._times_s, self._recorded = np.zeros(0), np.zeros((0, 0))

    def go_back(self, ago_s: float) -> float:
        """Click into the past; return the delay [s]."""
        begin_s = time.monotonic()
        QTest.mouseClick(self._timeline, Qt.LeftButton, Qt.NoModifier, self._place(ago_s))
        until(lambda: self._replay.phase is ReplayPhase.SHOWN, 120.0)
        return time.monotonic() - begin_s

    def return_to_live(self) -> float:
        """Press Esc; return the time [s] until RViz of the replay has hidden itself."""
        tasks, done = self._bench.launcher.tasks, []  # type: ignore[var-annotated]
        begin_s = time.monotonic()
        self._replay.leave()
        tasks.run('replay', lambda: None, done.append)  # in the same queue: after hiding
        until(lambda: bool(done), TIMEOUT_S)
        return time.monotonic() - begin_s

    def follow(self) -> None:
        """Subscribe to the robot of the second cell, and read the recording."""
        link = self._bench.launcher.link.replay
        self._follower = RemoteFollower(
            f'/{ROBOT}/joint_states', JointState, f'/{ROBOT}/joint_proc', link.master_uri,
            self._take, lambda: None)
        with rosbag.Bag(os.path.join(link.folder, 'replay.bag')) as bag:
            found = [(stamp.to_sec(), message.data)
                     for _, message, stamp in bag.read_messages([f'/{ROBOT}/q_act'])]
        self._times_s = np.array([stamp_s for stamp_s, _ in found])
        self._recorded = np.array([data for _, data in found])

    def drag(self, count: int) -> List[float]:
        """Drag to random moments; return each delay [s] until the robot is there."""
        QTest.mousePress(self._timeline, Qt.LeftButton, Qt.NoModifier, self._place(MAX_S))
        taken, rng = [], random.Random(1)
        while len(taken) < count:
            place = self._place(rng.uniform(MIN_S, MAX_S))
            target = self._recorded[np.searchsorted(self._times_s, self._time_s(place)) - 1]
            if not self._is_at(target):  # while the robot rests, there is nothing to see
                taken.append(self._move(place, target))
            pause(0.3)
        QTest.mouseRelease(self._timeline, Qt.LeftButton, Qt.NoModifier, place)
        return taken

    def close(self) -> None:
        """Unsubscribe."""
        if self._follower is not None:
            self._follower.close()

    def _move(self, place: QPoint, target: np.ndarray) -> float:
        begin_s = time.monotonic()
        QApplication.sendEvent(self._timeline, QMouseEvent(
            QEvent.MouseMove, QPointF(place), Qt.NoButton, Qt.LeftButton, Qt.NoModifier))
        until(lambda: self._is_at(target), TIMEOUT_S)
        return time.monotonic() - begin_s

    def _place(self, ago_s: float) -> QPoint:
        return QPoint(int(self._timeline.axis.x(-ago_s)), Y_PX)

    def _time_s(self, place: QPoint) -> float:
        """Return the moment at a screen position, on the recorder's clock."""
        window = self._bench.launcher.live.window
        assert window is not None
        end_s = window.epoch_s + window.begin_s + window.duration_s
        return float(end_s + self._timeline.axis.time_s(place.x()))

    def _take(self, message: JointState) -> None:
        self._positions = message.position

    def _is_at(self, target: np.ndarray) -> bool:
        return bool(np.allclose(self._positions, target, rtol=0.0, atol=SAME))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--drags', type=int, default=60)
    drags = parser.parse_args().drags
    window = BenchWindow()
    bench = ReplayBench(window)
    try:
        window.launcher.cell.tick('kinect', False)
        window.launch()
        live = window.launcher.live
        until(lambda: live.window is not None and live.window.begin_s > 0.0, 60.0)
        recording = window.begin_recording()
        print(f'first replay, with its launch: {bench.go_back(MAX_S):.1f} s', flush=True)
        bench.follow()
        pause(1.0)
        show('drag to the robot in the second cell', bench.drag(drags))
        there, back = [], []
        for _ in range(WAYS):
            back.append(bench.return_to_live())
            there.append(bench.go_back(MIN_S + 1.0))
        show('live to replay', there)
        show('back to live', back)
        bench.return_to_live()
        window.end_recording()
        with Recording([recording]) as found:
            print(f'the recording: {make_report(found).completeness.value}')
    finally:
        bench.close()
        window.close()


def show(name: str, taken: List[float]) -> None:
    print(f'{name}, ms: median {1e3 * np.median(taken):.0f}, p95 '
          f'{1e3 * np.percentile(taken, 95):.0f}, longest {1e3 * max(taken):.0f} '
          f'({len(taken)} times)', flush=True)


if __name__ == '__main__':
    main()
