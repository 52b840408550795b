# SPDX-License-Identifier: BSD-3-Clause
"""Runs of the simulated sewing cell at a known speed and start, without a bag in between."""
from __future__ import annotations

from typing import Callable, List, NamedTuple, Optional

import numpy as np

from process_visualizer.runs.event import passages_s
from process_visualizer.runs.run import Channel, ChannelKind, Run, RunEvent, ToolMotion
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

JOINT_HZ, FORCE_HZ, SENSOR_HZ = 125.0, 94.0, 50.0
REST_S, TAIL_S, PROCESS_S = 6.0, 4.0, 18.9
CYCLES = 64


class SimulatedRun(NamedTuple):
    """A run, and its time [s] for each time of the process: ``start_s + speed * time``."""

    run: Run
    start_s: float
    speed: float

    def true_s(self, process_s: np.ndarray) -> np.ndarray:
        """Return the times of the run at times of the process [s]."""
        return self.start_s + self.speed * process_s


def simulated_run(seed: int, speed: float = 1.0, start_s: float = REST_S,
                  cycle: Optional[SewingCycle] = None) -> SimulatedRun:
    """Return a run; before and after the process the cell rests.

    Args:
        seed: determines the noise, and the wandering of the edges.
        speed: seconds of the run for a second of the process.
        start_s: beginning of the process.
        cycle: a cycle with a fault.
    """
    maker = _Maker(cycle or SewingCycle('good', seed), seed % CYCLES, speed, start_s)
    channels = [channel for arm in ARMS for channel in maker.robot(arm)]
    channels += maker.machine()
    run = Run(f'run {seed}', maker.duration_s, tuple(channels),
              tuple(maker.motion(arm) for arm in ARMS), _events(channels[-1]))
    return SimulatedRun(run, start_s, speed)


def varied_run(seed: int, cycle: Optional[SewingCycle] = None, speed: float = 0.03,
               start_s: float = 2.0) -> SimulatedRun:
    """Return a run with speed and start drawn from the seed within these limits."""
    random = np.random.default_rng([seed, 9])
    return simulated_run(seed, random.uniform(1.0 - speed, 1.0 + speed),
                         REST_S + random.uniform(-start_s, start_s), cycle)


class _Maker:
    def __init__(self, cycle: SewingCycle, number: int, speed: float, start_s: float) -> None:
        self._cycle, self._number, self._speed, self._start_s = cycle, number, speed, start_s
        self.duration_s = start_s + PROCESS_S * speed + TAIL_S

    def _times_s(self, rate_hz: float) -> np.ndarray:
        return np.arange(0.0, self.duration_s, 1.0 / rate_hz)

    def _process_s(self, times_s: np.ndarray) -> np.ndarray:
        inside = np.clip((times_s - self._start_s) / self._speed, 0.0, PROCESS_S)
        result: np.ndarray = inside + self._number * self._cycle.schedule.period_s
        return result

    def motion(self, arm: Arm) -> ToolMotion:
        times_s = self._times_s(JOINT_HZ)
        return ToolMotion(arm.name, times_s,
                          self._cycle.truth(arm, self._process_s(times_s)).position)

    def robot(self, arm: Arm) -> List[Channel]:
        times_s = self._times_s(JOINT_HZ)
        at_s = self._process_s(times_s)
        moving = (times_s > self._start_s) & (times_s < self._start_s + PROCESS_S * self._speed)
        speed = np.linalg.norm(self._cycle.truth(arm, at_s).velocity, axis=1) * moving
        found = [Channel(arm.name, 'tool speed', 'm/s', ChannelKind.SPEED, times_s,
                         speed / self._speed)]
        found += [Channel(arm.name, f'joint {number}', 'rad', ChannelKind.JOINT, times_s, column)
                  for number, column in enumerate(self._cycle.joints(arm, at_s).T, start=1)]
        return found + [self._channel(
            arm.name, 'tool force', 'N', ChannelKind.FORCE, FORCE_HZ,
            lambda s: np.linalg.norm(self._cycle.wrench(arm, s)[:, :3], axis=1))]

    def machine(self) -> List[Channel]:
        edges = [self._channel('machine', f'edge {arm.name}', '', ChannelKind.VARIABLE, SENSOR_HZ,
                               lambda s, arm=arm: self._cycle.edge(arm, s)) for arm in ARMS]
        return [*edges, self._channel('machine', 'feed', 'm/s', ChannelKind.VARIABLE, SENSOR_HZ,
                                      lambda s: self._cycle.feed_rate(s) / self._speed)]

    def _channel(self, device: str, label: str, unit: str, kind: ChannelKind, rate_hz: float,
                 value: Callable[[np.ndarray], np.ndarray]) -> Channel:
        times_s = self._times_s(rate_hz)
        return Channel(device, label, unit, kind, times_s,
                       np.asarray(value(self._process_s(times_s)), float))


def _events(feed: Channel) -> 'tuple[RunEvent, ...]':
    found = [RunEvent(name, float(time_s))
             for name, threshold, is_above in (('needle starts', 0.01, True),
                                               ('needle stops', 0.005, False))
             for time_s in passages_s(feed.times_s, feed.values, threshold, is_above, 0.005)]
    return tuple(sorted(found, key=lambda it: it.time_s))
