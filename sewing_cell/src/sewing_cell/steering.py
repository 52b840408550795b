# SPDX-License-Identifier: BSD-3-Clause
"""Wandering edges of the covers under the sensors, and the robots' steering, which corrects them.

Lateral displacements are in m, positive towards the right of the seam, which is world -x.
Everything is a pure function of the cycle's number and the time in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sewing_cell.schedule import ProfileValue, Schedule, between, product, window

QUALITIES = ("good", "poor")

_CYCLES = 64  # the disturbances repeat after this number of cycles
_WAVES = 3
_AMPLITUDES = np.array([1.8e-3, 1.1e-3, 0.6e-3])
_LAG_S = 0.25
_WINDOW_EDGE_S = 1.0
_DRIFT = 8e-3
_DRIFT_S = 3.0
_DRIFT_CORRECTED = 0.3  # share of a drift that the robot can still correct
_DRIFT_OF_OTHER_COVER = 0.25


@dataclass(frozen=True)
class SteeringFault:
    """The errors of a poor seam: arrays over the cycles."""

    start_s: np.ndarray
    drift: np.ndarray


class Steering:
    """The edge of one cover: its disturbance, the robot's correction, and the remaining error."""

    def __init__(self, schedule: Schedule, quality: str, seed: int, side: int) -> None:
        if quality not in QUALITIES:
            raise ValueError(f"quality is '{quality}'; give one of {', '.join(QUALITIES)}")
        self._sew = schedule.sew
        random = np.random.default_rng([seed, 2, 1 + side])
        shape = (_CYCLES, _WAVES)
        self._amplitude = _AMPLITUDES * random.uniform(0.6, 1.0, shape)
        self._pulsation = 2 * np.pi * random.uniform(0.1, 0.4, shape)
        self._phase = random.uniform(0, 2 * np.pi, shape)
        self._fault = _faults(schedule, quality, seed, side)

    def correction(self, cycle: np.ndarray, time_s: np.ndarray) -> ProfileValue:
        """Lateral motion of the robot, which follows the disturbance with a lag."""
        wander, drift = self._wander(cycle, time_s, _LAG_S), self._drift(cycle, time_s)
        return ProfileValue(
            -wander.value - _DRIFT_CORRECTED * drift.value,
            -wander.rate - _DRIFT_CORRECTED * drift.rate,
        )

    def error(self, cycle: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the displacement of the edge under the sensor, after the correction."""
        disturbance = self._wander(cycle, time_s, 0.0).value + self._drift(cycle, time_s).value
        return disturbance + self.correction(cycle, time_s).value

    def fault_level(self, cycle: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the severity of a poor seam, 0 to 1 (for the worse of the covers)."""
        return np.abs(self._drift(cycle, time_s).value) / _DRIFT

    def _wander(self, cycle: np.ndarray, time_s: np.ndarray, lag_s: float) -> ProfileValue:
        row = np.asarray(cycle) % _CYCLES
        pulsation, amplitude = self._pulsation[row], self._amplitude[row]
        angle = pulsation * (np.asarray(time_s)[..., None] - lag_s) + self._phase[row]
        waves = ProfileValue(
            (amplitude * np.sin(angle)).sum(axis=-1),
            (amplitude * pulsation * np.cos(angle)).sum(axis=-1),
        )
        return product(waves, self._while_sewing(time_s))

    def _drift(self, cycle: np.ndarray, time_s: np.ndarray) -> ProfileValue:
        row = np.asarray(cycle) % _CYCLES
        start = self._fault.start_s[row]
        drift = product(
            between(time_s, start, start + _DRIFT_S), self._while_sewing(time_s)
        )
        return ProfileValue(
            self._fault.drift[row] * drift.value, self._fault.drift[row] * drift.rate
        )

    def _while_sewing(self, time_s: np.ndarray) -> ProfileValue:
        return window(time_s, self._sew.begin, self._sew.end, _WINDOW_EDGE_S)


def _faults(schedule: Schedule, quality: str, seed: int, side: int) -> SteeringFault:
    """Return start and size of the covers' drift; both sides draw the same random numbers."""
    random = np.random.default_rng([seed, 3])
    sew = schedule.sew
    start_s = sew.begin + (sew.end - sew.begin) * random.uniform(0.2, 0.5, _CYCLES)
    worse_side = random.choice([-1, 1], _CYCLES)
    direction = random.choice([-1.0, 1.0], _CYCLES)
    share = np.where(worse_side == side, 1.0, _DRIFT_OF_OTHER_COVER)
    return SteeringFault(start_s, _DRIFT * direction * share * (quality == "poor"))
