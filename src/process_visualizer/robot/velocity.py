# SPDX-License-Identifier: BSD-3-Clause
"""The velocity of a tool, from poses as they arrive."""
from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import Deque, Iterable, NamedTuple, Optional, Sequence

from process_visualizer.robot.late_arrivals import SILENCE_S, UNSURE_S
from process_visualizer.robot.rotations import (
    NO_ROTATION,
    Quaternion,
    Triple,
    Vector,
    rotated,
    rotation_vector_between,
)

GAP_S = 1.0  # a greater gap between two poses starts a new estimate
TIE_S = 1e-6
"""Tolerance at the beginning of a window: many periods divide a window exactly, and a stamp as
float64 seconds since 1970 is exact to a quarter of this."""


class _Sample(NamedTuple):
    time_s: float
    position: Triple
    quaternion: Quaternion
    wall_s: float


class ScaledClock:
    """Integrates elapsed time times the playback rate, the r of the thesis' equation 5.1.

    In playback the messages of one second of recording arrive within 1/r seconds. A negative rate
    (playing backwards) makes the time run backwards.
    """

    def __init__(self) -> None:
        self._time_s = 0.0
        self._last_s: Optional[float] = None

    def advance(self, now_s: float, rate: float) -> float:
        """Return the scaled time [s]; the rate holds for the time since the last call."""
        if self._last_s is not None:
            self._time_s += (now_s - self._last_s) * rate
        self._last_s = now_s
        return self._time_s


class VelocityEstimator:
    """Velocity as the least-squares slope of positions over a short window.

    A difference of two positions (thesis equation 5.1) is zero when a driver repeats a position,
    and a spike when two messages arrive at once (thesis figure 6.15). Therefore:

    - A repeated position is ignored until it has been repeated for half a window: until then it
      counts as a repetition, afterwards the point is at rest.
    - The samples always span a window, so that bunched time stamps have little weight.

    The estimate is for the middle of the window: the delay is half a window. The time may run
    backwards, as positions are a function of it; a step of more than gap_s starts a new estimate.
    """

    def __init__(self, window_s: float = 0.1, gap_s: float = GAP_S, max_samples: int = 250) -> None:
        """Set the window [s], the maximum gap between samples [s], and their maximum number.

        Raises:
            ValueError: not 0 < window < gap.
        """
        if not 0.0 < window_s < gap_s:
            raise ValueError(f'0 < window < gap is needed, not 0 < {window_s} < {gap_s}')
        self._window_s = window_s
        self._gap_s = gap_s
        self._samples: Deque[_Sample] = deque(maxlen=max_samples)
        self._newest_s: Optional[float] = None

    def reset(self) -> None:
        """Forget all samples, after a discontinuity (a new segment of playback)."""
        self._samples.clear()
        self._newest_s = None

    def add(self, time_s: float, position: Vector, quaternion: Quaternion = NO_ROTATION,
            wall_s: float = 0.0) -> None:
        """Add a pose at a time [s]: position (3,) [m], quaternion (4,) x y z w; all finite.

        The wall time [s] is only kept for wall_s().
        """
        if self._newest_s is not None and abs(time_s - self._newest_s) > self._gap_s:
            self.reset()
        self._newest_s = time_s
        x, y, z = position
        sample = _Sample(time_s, (float(x), float(y), float(z)), quaternion, wall_s)
        samples = self._samples
        if samples and self._is_repetition(sample, samples[-1]):
            return
        samples.append(sample)
        while len(samples) > 2 and abs(samples[1].time_s - time_s) >= self._window_s - TIE_S:
            samples.popleft()

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s], or None before the samples span half a window."""
        if not self._is_known():
            return None
        return slope([sample.time_s for sample in self._samples],
                     [sample.position for sample in self._samples])

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the poses' frame, or None as above."""
        if not self._is_known():
            return None
        return slope_of_rotations([sample.time_s for sample in self._samples],
                                  [sample.quaternion for sample in self._samples])

    def wall_s(self) -> float:
        """Return the wall time [s] of the estimate: the mean of the window's samples."""
        return sum(sample.wall_s for sample in self._samples) / max(len(self._samples), 1)

    def _is_known(self) -> bool:
        times = [sample.time_s for sample in self._samples]
        return len(times) > 1 and max(times) - min(times) >= 0.5 * self._window_s - TIE_S

    def _is_repetition(self, sample: _Sample, last: _Sample) -> bool:
        """Return whether a pose repeats the last one, for less than half a window."""
        return (sample.position == last.position and sample.quaternion == last.quaternion
                and abs(sample.time_s - last.time_s) < 0.5 * self._window_s - TIE_S)


def slope(times_s: Sequence[float], vectors: Sequence[Triple]) -> Triple:
    """Return the least-squares slope (3,) of at least two vectors (3,) over their times [s]."""
    mean_s = sum(times_s) / len(times_s)
    # A dozen samples: Python's own numbers are faster here than arrays.
    lever = [time_s - mean_s for time_s in times_s]
    inertia = sum(part * part for part in lever)
    x_0, y_0, z_0 = vectors[0]
    x = y = z = 0.0
    for part, vector in zip(lever, vectors):
        x += part * (vector[0] - x_0)
        y += part * (vector[1] - y_0)
        z += part * (vector[2] - z_0)
    return x / inertia, y / inertia, z / inertia


def slope_of_rotations(times_s: Sequence[float], quaternions: Sequence[Quaternion]) -> Triple:
    """Return the angular velocity (3,) [rad/s] of quaternions (4,) x y z w over their times [s].

    It is the slope of the rotation vectors from the middle quaternion: exact for a constant axis,
    with an error of second order in the angle otherwise.
    """
    middle = quaternions[len(quaternions) // 2]
    return rotated(middle, slope(times_s, [rotation_vector_between(middle, quaternion)
                                           for quaternion in quaternions]))


BLOCK = 20  # messages: intervals over a block are even, although some came late or in bunches
_MEMORY = 16 * BLOCK
_MIN_SAMPLES = 10 * BLOCK
_LATELY = 8 * BLOCK
_MAX_SPREAD = 0.2  # maximum difference of the median block from short ones, relative to these


class SendingPeriod:
    """Estimates the period from arrival times, robust against late and a few lost messages."""

    def __init__(self) -> None:
        self._times: Deque[float] = deque(maxlen=_MEMORY + 1)
        self._countdown = BLOCK
        self._period_s = 0.0

    @property
    def period_s(self) -> float:
        """The period [s]; 0 while it is not reliably known."""
        return self._period_s

    def reset(self) -> None:
        """Forget the times, but not the period: the driver is the same."""
        self._times.clear()

    def add(self, time_s: float) -> None:
        """Add an arrival."""
        self._times.append(time_s)
        self._countdown -= 1
        if self._countdown <= 0 and len(self._times) >= _MIN_SAMPLES:
            self._countdown = BLOCK
            self._update()

    def _update(self) -> None:
        times = list(self._times)
        lately_s = abs(times[-1] - times[-1 - _LATELY]) / _LATELY
        if lately_s < 0.75 * self._period_s:  # too long for a bunch: the driver is faster now
            self._times.clear()
            self._period_s = 0.0
            return
        blocks = sorted(abs(later - sooner) / BLOCK
                        for sooner, later in zip(times, times[BLOCK:]))
        # Short blocks count: lost messages make a block longer.
        short, middle = blocks[len(blocks) // 10], blocks[len(blocks) // 2]
        self._period_s = short if middle - short <= _MAX_SPREAD * short else 0.0


HOLD_S = 0.05
_MAX_BUNCHED = 50  # messages: at most this many later messages are used to date a pose
MIN_PERIOD_SHARE = 0.99  # factor of the measured period: its small errors must not add up
_SET_BACK_S = 0.1  # minimum step back of a clock for a new start


class _Arrival(NamedTuple):
    arrival_s: float
    wall_s: float
    position: Sequence[float]
    quaternion: Quaternion
    time_s: float  # in the recording during playback
    rate: float

    def stamped(self) -> bool:
        """Return whether the pose has a stamp of its measurement."""
        return self.wall_s != self.arrival_s


class ToolVelocity:
    """Determines the time of each pose of a tool, and estimates the velocity.

    Poses without a stamp are sometimes late, and then arrive in bunches. A driver sends no faster
    than its period, so each pose was measured at least a period before the next one; where messages
    are lost, no pose follows closely, and the gap remains a gap. Poses wait for HOLD_S until their
    followers are known.

    If the clock of the arrivals is set back, everything starts anew.
    """

    def __init__(self, window_s: float) -> None:
        """Set the window of the estimate [s]."""
        self._scaled = ScaledClock()
        self._estimator = VelocityEstimator(window_s, gap_s=max(GAP_S, 2.0 * window_s))
        self._period = SendingPeriod()
        self._waiting: Deque[_Arrival] = deque(maxlen=1000)
        self._newest_s = -math.inf
        self._last_arrival_s, self._unsure_s = math.inf, -math.inf  # of poses without stamps

    def add(self, arrival_s: float, wall_s: float, position: Sequence[float],
            quaternion: Quaternion, rate: float = 1.0) -> None:
        """Add a pose.

        Args:
            arrival_s: wall time of its arrival.
            wall_s: its stamp if that is usable, else ``arrival_s``.
            position: (3,) [m] in the base frame.
            quaternion: (4,) x y z w in the base frame, of any length but zero.
            rate: seconds of recording per second, for players other than our own.
        """
        if arrival_s < self._newest_s - _SET_BACK_S:
            self._begin_anew()
        self._newest_s = arrival_s
        self._waiting.append(_Arrival(arrival_s, wall_s, position, quaternion,
                                      self._scaled.advance(wall_s, rate), rate))
        self.settle(arrival_s)

    def settle(self, now_s: float) -> None:
        """Process the poses that have waited long enough."""
        while self._waiting and self._is_settled(self._waiting[0], now_s):
            self._take(self._waiting.popleft())

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the base frame; None while it is unknown."""
        return self._estimator.velocity()

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the base frame; None while it is unknown."""
        return self._estimator.angular_velocity()

    def wall_s(self) -> float:
        """Return the wall time [s] of the velocity: the middle of the window."""
        return self._estimator.wall_s()

    def _begin_anew(self) -> None:
        self._scaled = ScaledClock()
        self._waiting.clear()
        self._estimator.reset()
        self._period.reset()
        self._last_arrival_s, self._unsure_s = math.inf, -math.inf

    def _is_settled(self, sample: _Arrival, now_s: float) -> bool:
        return sample.stamped() or sample.arrival_s <= now_s - HOLD_S

    def _take(self, sample: _Arrival) -> None:
        """Add a pose to the estimate, at its stamp or its estimated time of measurement."""
        self._period.add(sample.time_s)
        time_s = sample.time_s
        if not sample.stamped():
            if self._is_unsure(sample):
                return
            time_s = _measured_s(sample, islice(self._waiting, _MAX_BUNCHED),
                                 self._period.period_s)
        moved_s = (time_s - sample.time_s) / sample.rate if sample.rate else 0.0
        self._estimator.add(time_s, sample.position, sample.quaternion, sample.wall_s + moved_s)

    def _is_unsure(self, sample: _Arrival) -> bool:
        """Return whether a pose came just after a silence, and may be an old one.

        A driver or a network that hung first delivers poses from the beginning of the silence.
        """
        if sample.arrival_s - self._last_arrival_s >= SILENCE_S:
            self._unsure_s = sample.arrival_s + UNSURE_S
        self._last_arrival_s = sample.arrival_s
        return sample.arrival_s < self._unsure_s


def _measured_s(sample: _Arrival, followers: Iterable[_Arrival], period_s: float) -> float:
    """Return the latest possible time [s] of a pose: its followers came whole periods later."""
    step_s = MIN_PERIOD_SHARE * period_s
    latest_s, before_s = sample.time_s, 0.0
    for follower in followers:
        if sample.rate <= 0.0 or follower.rate <= 0.0:
            break
        before_s += step_s
        latest_s = min(latest_s, follower.time_s - before_s)
    return latest_s
