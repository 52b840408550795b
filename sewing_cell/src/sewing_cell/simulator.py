# SPDX-License-Identifier: BSD-3-Clause
"""The node ``simulator``: publishes every driver topic of the sewing cell, without hardware.

Each group of topics has its rate and its thread.  Message number k of a topic is the cell at
k / rate seconds after the start, so that runs with the same seed carry the same data.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Callable

import rospy

from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.common.process_end import spin_to_end, start_node
from sewing_cell.cycle import SewingCycle
from sewing_cell.driver_groups import (
    KINECTS,
    ForceDriver,
    JointDriver,
    KinectDriver,
    MachineDriver,
    publish_truth,
)
from sewing_cell.faults import FaultyCycle, drawn_fault
from sewing_cell.simulator_parameters import ParameterError, SimulatorParameters
from sewing_cell.ticker import Ticker

_FIRST_TICK_S = 0.1  # until all the threads run
_SWITCH_INTERVAL_S = 0.0005  # drawing an image must not hold up the joints' thread
_REPORT_EVERY_S = 10.0
_TOLERATED_SHARE = 0.02  # of messages left out on a busy computer


class Simulator:
    """The simulated drivers and the threads they run in."""

    def __init__(self, node: NodeHandle, parameters: SimulatorParameters) -> None:
        self._node = node
        cycle = _cycle(parameters)
        if isinstance(cycle, FaultyCycle):
            publish_truth(node, cycle)
        self._tickers: list[Ticker] = []
        self._add("joint", parameters.joint_rate, lambda rate: JointDriver(node, cycle, rate))
        self._add("force", parameters.force_rate, lambda rate: ForceDriver(node, cycle, rate))
        self._add("sensor", parameters.sensor_rate, lambda rate: MachineDriver(node, cycle, rate))
        for kinect in KINECTS if parameters.second_kinect else KINECTS[:1]:
            driver = partial(KinectDriver, node, cycle, seed=parameters.seed, kinect=kinect,
                             intruder=parameters.intruder)
            self._add("image", parameters.image_rate, driver)

    def _add(
        self, name: str, rate_hz: float, driver: Callable[[float], Callable[[int, float], None]]
    ) -> None:
        """Give a driver its thread, unless its rate is 0."""
        if rate_hz > 0:
            skipped = _Skipped(self._node, name, rate_hz)
            self._tickers.append(
                Ticker(self._node, name, rate_hz, driver(rate_hz), skipped, _fail)
            )

    def start(self) -> None:
        """Begin to publish."""
        start_s = self._node.monotonic_s() + _FIRST_TICK_S
        for ticker in self._tickers:
            ticker.start(start_s)

    def stop(self) -> None:
        """End publishing; wait for a moment until messages that are under way are published."""
        for ticker in self._tickers:
            ticker.stop(timeout_s=0.0)
        for ticker in self._tickers:
            ticker.stop()


def _cycle(parameters: SimulatorParameters) -> SewingCycle:
    """The cycle that is asked for, with its fault."""
    good = SewingCycle(parameters.quality, parameters.seed, parameters.period)
    if not parameters.fault:
        return good
    fault = drawn_fault(parameters.fault, good, parameters.seed)
    fault = fault.changed(
        parameters.fault_start, parameters.fault_size, parameters.fault_arm, parameters.fault_cycle
    )
    return FaultyCycle(fault, parameters.quality, parameters.seed, parameters.period)


class _Skipped:
    """Says how many messages a group could not publish in time, when they are many."""

    def __init__(self, node: NodeHandle, name: str, rate_hz: float) -> None:
        self._node, self._name, self._rate_hz = node, name, rate_hz
        self._count, self._since_s = 0, node.monotonic_s()

    def __call__(self, count: int) -> None:
        self._count += count
        duration_s = self._node.monotonic_s() - self._since_s
        if duration_s < _REPORT_EVERY_S:
            return
        share = self._count / (duration_s * self._rate_hz)
        if share > _TOLERATED_SHARE:
            self._node.warn(
                f"Computer too slow: {100 * share:.0f} % of {self._name} messages skipped at "
                f"{self._rate_hz:g} Hz; lower ~{self._name}_rate"
            )
        self._count, self._since_s = 0, self._node.monotonic_s()


def _fail(error: Exception) -> None:
    """End the node when one of its threads cannot go on, except while it is ending anyway."""
    if not rospy.is_shutdown():
        rospy.signal_shutdown(f"the simulator failed: {error!r}")
        raise error


def main() -> int:
    """Run the node; the exit code is 1 when a parameter cannot be used."""
    start_node("simulator")
    try:
        parameters = SimulatorParameters.read(rospy.get_param)
    except ParameterError as error:
        rospy.logfatal(f"simulator: parameter {error}")
        return 1
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    simulator = Simulator(NodeHandle(), parameters)
    simulator.start()
    rospy.loginfo(f"simulator: sewing a {parameters.quality} seam, seed {parameters.seed}")
    return spin_to_end(simulator.stop)
