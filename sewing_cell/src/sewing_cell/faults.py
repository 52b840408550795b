# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a cycle, each with its own beginning; everything else stays unchanged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Optional, Tuple

import numpy as np

from sewing_cell.cycle import EDGE_COUNTS_PER_M, EDGE_MAXIMUM, SewingCycle, Times, ToolState
from sewing_cell.layout import ARMS, Arm
from sewing_cell.schedule import between, smooth_step

#: The default size of each fault, in its unit.
SIZES: Dict[str, float] = {
    "edge_drift": 100.0,  # counts/s of an edge
    "friction": 12.0,  # N of additional pull
    "slip": 50.0,  # counts by which the edge jumps as the gripper loses hold of the cover
    "sensor_offset": 40.0,  # counts of an edge
    "late_feed": 0.6,  # s by which the feed starts late
    "dwell": 0.2,  # s for which everything stands still
    "feed_wobble": 0.012,  # m/s of the feed
    "calibration": 0.003,  # m by which a tool is displaced
    "force_noise": 12.0,  # factor of the noise
}
KINDS = tuple(SIZES)

_WOBBLE_HZ, _SLIP_S, _FRICTION_S = 3.0, 0.15, 0.5
_SLIP_SHARE = 0.4  # share of the pull that is lost
_FORCE_NOISE_N = 0.25
_LATEST_SHARE = 0.7  # of the seam, so that the effect is visible


@dataclass(frozen=True)
class Fault:
    """A fault: its kind, its start in the cycle [s], its size, and its arm.

    ``cycle`` is the number of the cycle, from 0; None: every cycle.
    """

    kind: str
    start_s: float
    size: float
    arm: str
    cycle: Optional[int] = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"fault is '{self.kind}'; give one of {', '.join(KINDS)}")

    def changed(
        self,
        start_s: Optional[float] = None,
        size: Optional[float] = None,
        arm: Optional[str] = None,
        cycle: Optional[int] = None,
    ) -> Fault:
        """Return the fault with the given values in place of its own."""
        return Fault(
            self.kind,
            self.start_s if start_s is None else start_s,
            self.size if size is None else size,
            self.arm if arm is None else arm,
            self.cycle if cycle is None else cycle,
        )


def drawn_fault(kind: str, cycle: SewingCycle, seed: int) -> Fault:
    """Return a fault with start, size and arm drawn from the seed.  Raises ValueError."""
    if kind not in KINDS:
        raise ValueError(f"fault is '{kind}'; give one of {', '.join(KINDS)}")
    random = np.random.default_rng([seed, 7, KINDS.index(kind)])
    sew = cycle.schedule.sew
    share = random.uniform(0.15, _LATEST_SHARE)
    start_s = {"calibration": 0.0, "late_feed": sew.begin}.get(
        kind, sew.begin + share * (sew.end - sew.begin)
    )
    size = SIZES[kind] * (1.0 if kind == "dwell" else random.uniform(1.0, 1.3))
    return Fault(kind, float(start_s), float(size), ARMS[int(random.integers(2))].name)


class FaultyCycle(SewingCycle):
    """A sewing cycle with one fault."""

    def __init__(
        self, fault: Fault, quality: str = "good", seed: int = 0, period_s: float = 20.0
    ) -> None:
        super().__init__(quality, seed, period_s)
        self.fault = fault

    def truth(self, arm: Arm, time_s: Times) -> ToolState:
        """Return the true state without the fault, plus the tool's displacement."""
        state = super().truth(arm, time_s)
        if self._concerns("calibration", arm):
            beside = np.where(self._since(time_s) >= 0.0, self.fault.size, 0.0)[..., None]
            return ToolState(state.position + beside * np.array([1.0, 0.0, 0.0]), state.velocity)
        return state

    def wrench(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Return the wrench, with the noise of the fault."""
        wrench = super().wrench(arm, time_s)
        if self._concerns("force_noise", arm):
            factor = np.where(self._since(time_s) >= 0.0, self.fault.size - 1.0, 0.0)
            channels = 40 + 10 * arm.side + np.arange(3)
            noise = self._noise(channels, np.asarray(time_s)[..., None])
            wrench[..., :3] += _FORCE_NOISE_N * np.asarray(factor)[..., None] * noise
        return wrench

    def edge_error(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Return the error without the fault, plus the cover's own motion [m]."""
        since = self._since(time_s)
        error = super().edge_error(arm, time_s)
        if self._concerns("edge_drift", arm):
            error = error + self.fault.size * np.maximum(since, 0.0) / EDGE_COUNTS_PER_M
        if self._concerns("slip", arm):
            error = error + self.fault.size * self._rise(since, _SLIP_S) / EDGE_COUNTS_PER_M
        return error

    def edge(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Return the edge without the fault, plus the offset of the sensor."""
        reading = super().edge(arm, time_s)
        if self._concerns("sensor_offset", arm):
            shifted = reading + np.where(self._since(time_s) >= 0.0, self.fault.size, 0.0)
            return np.clip(np.rint(shifted), 0, EDGE_MAXIMUM).astype(int)
        return reading

    def feed_rate(self, time_s: Times) -> np.ndarray:
        """Return the feed rate, with a late start or an uneven feed."""
        rate = super().feed_rate(time_s)
        since = self._since(time_s)
        if self.fault.kind == "late_feed":
            return np.where((since >= 0.0) & (since < self.fault.size), 0.0, rate)
        if self.fault.kind == "feed_wobble":
            wave = np.sin(2 * np.pi * _WOBBLE_HZ * since)
            wobble = np.where((since >= 0.0) & (rate > 0.0), self.fault.size * wave, 0.0)
            return np.maximum(rate + wobble, 0.0)
        return rate

    def _split(self, time_s: Times) -> Tuple[np.ndarray, np.ndarray]:
        """Return the cycle's number and the time in it [s], which stops during a dwell."""
        cycle, phase_s = super()._split(time_s)
        if self.fault.kind == "dwell":
            phase_s = phase_s - np.clip(self._since(time_s), 0.0, self.fault.size)
        return cycle, phase_s

    def _force_world(self, arm: Arm, time_s: Times) -> np.ndarray:
        force = super()._force_world(arm, time_s)
        since = self._since(time_s)
        if self._concerns("friction", arm):
            force[..., 1] -= self.fault.size * self._rise(since, _FRICTION_S) * self._feeds(time_s)
        if self._concerns("slip", arm):
            force[..., 1] *= 1.0 - _SLIP_SHARE * self._rise(since, _SLIP_S)
        return force

    def _concerns(self, kind: str, arm: Arm) -> bool:
        return self.fault.kind == kind and self.fault.arm == arm.name

    def _since(self, time_s: Times) -> np.ndarray:
        """Time since the fault's start in the cycle [s]; far below 0 in other cycles."""
        cycle, phase_s = super()._split(time_s)
        since = phase_s - self.fault.start_s
        if self.fault.cycle is None:
            return since
        return np.where(cycle == self.fault.cycle, since, -1e6)

    @staticmethod
    def _rise(since: np.ndarray, within_s: float) -> np.ndarray:
        return between(since, 0.0, within_s, smooth_step).value

    def _feeds(self, time_s: Times) -> np.ndarray:
        """1 while the machine feeds, less during its ramps."""
        _, phase_s = self._split(time_s)
        sew = self.schedule.sew
        return self._feed(phase_s).rate * (sew.end - sew.begin) * 0.87
