# SPDX-License-Identifier: BSD-3-Clause
"""The node ``simulator``: publishes every driver topic of the sewing cell, without hardware.

Each group of topics has its own rate and thread.  Message number k of a topic shows the cell
k / rate seconds after the start, so that runs with the same seed have the same data.
"""
from __future__ import annotations

import sys
import threading
from dataclasses import dataclass
from functools import partial
from typing import Any, Callable, Optional, Sequence, TypeVar

import rospy

from process_visualizer.nodes.common.node_handle import NodeHandle, spin_to_end, start_node
from process_visualizer.parameters.reading import ParameterError
from sewing_cell.cycle import SewingCycle
from sewing_cell.driver_groups import (
    KINECTS,
    ForceDriver,
    JointDriver,
    KinectDriver,
    MachineDriver,
    publish_truth,
)
from sewing_cell.faults import KINDS, FaultyCycle, drawn_fault
from sewing_cell.layout import ARMS
from sewing_cell.scene import INTRUDERS
from sewing_cell.schedule import Schedule
from sewing_cell.steering import QUALITIES

_MAX_HZ = 1000.0

GetParameter = Callable[[str, Any], Any]
_Number = TypeVar("_Number", int, float)


@dataclass(frozen=True)
class SimulatorParameters:
    """Rates in Hz (0: that group is off), the cycle's period in s, the quality and the seed.

    ``fault`` is one of ``faults.KINDS``, or empty.  Its start in the cycle [s], its size and its
    arm are drawn from the seed if they are None.  Without ``fault_cycle``, every cycle has it.
    ``intruder`` is one of ``scene.INTRUDERS``, or None.
    """

    joint_rate: float
    force_rate: float
    sensor_rate: float
    image_rate: float
    period: float
    quality: str
    seed: int
    fault: str = ""
    fault_start: Optional[float] = None
    fault_size: Optional[float] = None
    fault_arm: Optional[str] = None
    fault_cycle: Optional[int] = None
    second_kinect: bool = False
    intruder: Optional[str] = None

    @classmethod
    def read(cls, get: GetParameter) -> SimulatorParameters:
        """Read with ``get(name, default)``, such as rospy.get_param.  Raises ParameterError."""
        return cls(
            joint_rate=_rate(get, "~joint_rate", 125.0),
            force_rate=_rate(get, "~force_rate", 94.0),
            sensor_rate=_rate(get, "~sensor_rate", 50.0),
            image_rate=_rate(get, "~image_rate", 30.0),
            period=_period(get),
            quality=_quality(get),
            seed=_seed(get),
            fault=_one_of(get, "~fault", KINDS) or "",
            fault_start=_optional(get, "~fault_start", float),
            fault_size=_optional(get, "~fault_size", float),
            fault_arm=_one_of(get, "~fault_arm", tuple(arm.name for arm in ARMS)),
            fault_cycle=_optional(get, "~fault_cycle", int),
            second_kinect=_boolean(get, "~second_kinect"),
            intruder=_one_of(get, "~intruder", tuple(INTRUDERS)),
        )


def _boolean(get: GetParameter, name: str) -> bool:
    value = get(name, False)
    if not isinstance(value, bool):
        raise ParameterError(f"{name} is {value!r}; give true or false")
    return value


def _rate(get: GetParameter, name: str, default: float) -> float:
    rate = _number(get, name, default, float)
    if not 0.0 <= rate <= _MAX_HZ:
        raise ParameterError(
            f"{name} is {rate} Hz; give 0 (off) or up to {_MAX_HZ:.0f} Hz"
        )
    return rate


def _period(get: GetParameter) -> float:
    period = _number(get, "~period", 20.0, float)
    try:
        return Schedule(period).period_s
    except ValueError as error:
        raise ParameterError(f"~period: {error}") from error


def _quality(get: GetParameter) -> str:
    quality = get("~quality", "good")
    if quality not in QUALITIES:
        raise ParameterError(f"~quality is '{quality}'; give one of {', '.join(QUALITIES)}")
    return str(quality)


def _one_of(get: GetParameter, name: str, names: Sequence[str]) -> Optional[str]:
    """Return one of the names; None for an empty text, the default of the launch file."""
    value = get(name, "")
    if value == "":
        return None
    if value not in names:
        raise ParameterError(f"{name} is '{value}'; give one of {', '.join(names)}")
    return str(value)


def _optional(get: GetParameter, name: str, kind: type[_Number]) -> Optional[_Number]:
    return None if get(name, "") == "" else _number(get, name, kind(0), kind)


def _seed(get: GetParameter) -> int:
    seed = _number(get, "~seed", 0, int)
    if seed < 0:
        raise ParameterError(f"~seed is {seed}; give a whole number from 0 up")
    return seed


def _number(get: GetParameter, name: str, default: _Number, kind: type[_Number]) -> _Number:
    value = get(name, default)
    accepted = (int,) if kind is int else (int, float)
    if isinstance(value, bool) or not isinstance(value, accepted):
        what = "whole number" if kind is int else "number"
        raise ParameterError(f"{name} is {value!r}; give a {what}")
    return kind(value)


class Ticker:
    """Calls ``action(tick, late_s)`` at ``start_s + tick / rate_hz`` of the node's monotonic clock.

    ``tick`` is 0, 1, ..., and ``late_s`` is the delay since it was due.  Missed ticks are skipped
    and reported to ``on_skip(count)``.  An exception ends the ticking and is passed to
    ``on_failure``.
    """

    def __init__(
        self,
        node: NodeHandle,
        name: str,
        rate_hz: float,
        action: Callable[[int, float], None],
        on_skip: Callable[[int], None],
        on_failure: Callable[[Exception], None],
    ) -> None:
        self._node, self._rate_hz, self._start_s = node, rate_hz, 0.0
        self._action, self._on_skip, self._on_failure = action, on_skip, on_failure
        self._tick, self._stopped = 0, False
        self._acting = threading.RLock()  # an action may stop its own ticker
        self._worker = node.worker(self._step, name)

    def start(self, start_s: float) -> None:
        """Begin ticking; tick 0 is due at ``start_s`` of the monotonic clock."""
        self._start_s = start_s
        self._worker.wake()

    def stop(self, timeout_s: float = 0.3) -> None:
        """Stop at once, and wait for the end of a running action, at most ``timeout_s``."""
        self._stopped = True
        if self._acting.acquire(timeout=timeout_s):
            self._acting.release()

    def _step(self) -> Optional[float]:
        """Act if a tick is due; return the time to wait [s], None forever."""
        with self._acting:
            if self._stopped:
                return None
            now_s = self._node.monotonic_s()
            if now_s >= self._due_s():
                try:
                    self._act(now_s)
                except Exception as error:
                    self._stopped = True
                    self._on_failure(error)
            return max(0.0, self._due_s() - self._node.monotonic_s())

    def _act(self, now_s: float) -> None:
        newest = int((now_s - self._start_s) * self._rate_hz)
        if newest > self._tick:
            self._on_skip(newest - self._tick)
            self._tick = newest
        self._action(self._tick, now_s - self._due_s())
        self._tick += 1

    def _due_s(self) -> float:
        return self._start_s + self._tick / self._rate_hz


_FIRST_TICK_S = 0.1  # time for all threads to start
_SWITCH_INTERVAL_S = 0.0005  # drawing an image must not hold up the joints' thread
_REPORT_EVERY_S = 10.0
_TOLERATED_SHARE = 0.02  # share of messages skipped on a busy computer


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
        """Stop publishing; wait briefly for messages that are being published."""
        for ticker in self._tickers:
            ticker.stop(timeout_s=0.0)
        for ticker in self._tickers:
            ticker.stop()


def _cycle(parameters: SimulatorParameters) -> SewingCycle:
    """Return the requested cycle, with its fault."""
    good = SewingCycle(parameters.quality, parameters.seed, parameters.period)
    if not parameters.fault:
        return good
    fault = drawn_fault(parameters.fault, good, parameters.seed)
    fault = fault.changed(
        parameters.fault_start, parameters.fault_size, parameters.fault_arm, parameters.fault_cycle
    )
    return FaultyCycle(fault, parameters.quality, parameters.seed, parameters.period)


class _Skipped:
    """Warns about skipped messages of a group, if there are many."""

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
    """End the node when one of its threads fails, unless the node is already ending."""
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
