# SPDX-License-Identifier: BSD-3-Clause
"""Accuracy of the ghost beside live robots, and its CPU time.

usage: bench/run live_ghost

The nodes of the simulated sewing cell run in real-time mode, without camera and RViz. In place of
its drivers, this program publishes their topics, at the cell's own rates, but faster or slower or
with a pause, so that the moment of the cycle is known at each time. The reference is a cycle with
another seed, read from a bag. The error is that of the topic with the ghost's moment, at its
stamp, while the robots move and the moment is known.
"""
from __future__ import annotations

import os
import subprocess
import tempfile
import threading
import time
from typing import Dict, List, NamedTuple, Tuple
from xmlrpc.client import ServerProxy

import numpy as np
import rosgraph
import rospy
from cell_run import process_sample
from sewing_bag import FORCE_HZ, JOINT_HZ, SENSOR_HZ, WarpedCycle, write_sewing_bag

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.ghost_client import follow_ghost
from process_visualizer.msg import GhostPhase
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.view_picture import wait_for_master
from process_visualizer.ros_names import GHOST, GHOST_PHASE_TOPIC
from process_visualizer.runs.comparison.ghost import live_reference
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import Run
from sewing_cell.cycle import SewingCycle
from sewing_cell.driver_groups import ForceDriver, JointDriver, MachineDriver
from sewing_cell.simulator import Ticker

CONFIG = os.path.join(os.path.dirname(__file__), '..', 'sewing_cell', 'devices', 'simulated.xml')
DEVICES = 'ur_rt_upper,ur_rt_lower,sewing_machine'
PERIOD_S, MOVES_S, RESTS_S = 20.0, 1.2, 18.8
"""A cycle, and the times in it when the robots begin to move and to rest."""
PAUSE_AT_S = 8.0


class Case(NamedTuple):
    """Motion of the live cell: seconds of the cycle per second, and a pause [s] amid the seam."""

    name: str
    speed: float
    pause_s: float = 0.0

    def cycle_s(self, since_s: np.ndarray) -> np.ndarray:
        """Return the time in the cycle [s] (n,) at times since the start."""
        paused_s = np.clip(since_s - PAUSE_AT_S / self.speed, 0.0, self.pause_s)
        result: np.ndarray = self.speed * (since_s - paused_s)
        return result

    @property
    def duration_s(self) -> float:
        """Return the duration of a cycle."""
        return PERIOD_S / self.speed + self.pause_s


CASES = (Case('as fast', 1.0), Case('10 % faster', 1.1), Case('10 % slower', 0.9),
         Case('25 % faster', 1.25), Case('20 % slower', 0.8), Case('a pause of 3 s', 1.0, 3.0))


class Phases:
    """The node's messages."""

    def __init__(self) -> None:
        self.rows: List[Tuple[float, float, bool]] = []  # stamp [s], moment [s], known
        self._ear = rospy.Subscriber(GHOST_PHASE_TOPIC, GhostPhase, self._take, queue_size=1000,
                                     tcp_nodelay=True)

    def _take(self, phase: GhostPhase) -> None:
        self.rows.append((phase.stamp.to_sec(), phase.reference, phase.known))


def reference(folder: str) -> Tuple[Run, float]:
    """Return the reference, and when it begins in its cycle [s]."""
    path = write_sewing_bag(os.path.join(folder, 'good.bag'), SewingCycle('good', 3), PERIOD_S)
    run, = ChosenRuns(XmlParser().parse(CONFIG)).runs([str(path)])
    return run, run.begin_s


def drive(case: Case, phases: Phases, begin_s: float) -> np.ndarray:
    """Run the cell once; return the errors [s] (n,), NaN where the moment is not known."""
    node, cycle = NodeHandle(), WarpedCycle(SewingCycle('good', 5), case.cycle_s)
    drivers: Dict[float, object] = {JOINT_HZ: JointDriver(node, cycle, JOINT_HZ),
                                    FORCE_HZ: ForceDriver(node, cycle, FORCE_HZ),
                                    SENSOR_HZ: MachineDriver(node, cycle, SENSOR_HZ)}
    tickers = [Ticker(node, str(rate_hz), rate_hz, driver, lambda _count: None, _raise)
               for rate_hz, driver in drivers.items()]
    time.sleep(1.0)  # until the subscribers are connected
    start_s = time.monotonic() + 0.1
    start_ros_s = rospy.get_time() + start_s - time.monotonic()
    del phases.rows[:]
    for it in tickers:
        it.start(start_s)
    threading.Event().wait(case.duration_s - 0.1)
    for it in tickers:
        it.stop()
    said = np.array(phases.rows)
    true_s = case.cycle_s(said[:, 0] - start_ros_s)
    said = said[(true_s > MOVES_S) & (true_s < RESTS_S)]
    true_s = case.cycle_s(said[:, 0] - start_ros_s)
    result: np.ndarray = np.where(said[:, 2] > 0.0, np.abs(said[:, 1] + begin_s - true_s), np.nan)
    return result


def _raise(error: Exception) -> None:
    raise error


def pid_of(node: str) -> int:
    """Return the process id of a node."""
    uri = rosgraph.Master('/bench').lookupNode(node)
    return int(ServerProxy(uri).getPid('/bench')[2])  # type: ignore[index, arg-type]


def measure(folder: str) -> None:
    """Print the table."""
    run, begin_s = reference(folder)
    rospy.wait_for_service(f'/{GHOST}/follow', 60.0)
    follow_ghost(live_reference(XmlParser().parse(CONFIG), run))
    phases, pid = Phases(), pid_of(f'/{GHOST}')
    print('| live cell | known | error, median | p95 | at most | CPU of the node |\n'
          '|---|---|---|---|---|---|')
    for case in CASES:
        before, since_s = process_sample(pid), time.monotonic()
        errors = 1000.0 * drive(case, phases, begin_s)
        after, took_s = process_sample(pid), time.monotonic() - since_s
        assert before is not None and after is not None
        known = errors[np.isfinite(errors)]
        print(f'| {case.name} | {len(known) / len(errors):.0%} | {np.median(known):.0f} ms '
              f'| {np.quantile(known, 0.95):.0f} ms | {known.max():.0f} ms '
              f'| {(after.cpu_s - before.cpu_s) / took_s:.1%} of a core |', flush=True)


def main() -> None:
    """Run the cell, and measure."""
    command = ['rosrun', 'process_visualizer', 'cell', 'run', CONFIG, '--no-rviz', '--devices',
               DEVICES]
    with tempfile.TemporaryDirectory() as folder:
        cell = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
        try:
            wait_for_master(30)
            rospy.init_node('live_ghost_bench', disable_signals=True)
            measure(folder)
        finally:
            cell.terminate()
            cell.wait()


if __name__ == '__main__':
    main()
