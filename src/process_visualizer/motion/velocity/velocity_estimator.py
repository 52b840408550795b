# SPDX-License-Identifier: BSD-3-Clause
"""The velocity of a tool from poses that arrive at uneven times."""
from __future__ import annotations

from collections import deque
from typing import Deque, NamedTuple, Optional, Sequence

from process_visualizer.motion.rotations import (
    NO_ROTATION,
    Quaternion,
    Triple,
    Vector,
    rotated,
    rotation_vector_between,
)

GAP_S = 1.0  # greater ones between two poses end what a velocity is found from


class _Sample(NamedTuple):
    time_s: float
    position: Triple
    quaternion: Quaternion
    wall_s: float


class ScaledClock:
    """Adds up elapsed time multiplied by the playback rate: the r of the thesis' equation 5.1.

    In playback the messages of one second of recording arrive in 1/r seconds. A rate below zero
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
    """Velocity as the least-squares slope of the positions of a short window.

    A difference of two positions (thesis equation 5.1) is zero when a driver repeats a position,
    and a spike when two messages arrive at once (thesis figure 6.15). Here

    - a repeated position is set aside until it has been repeated for half a window: before that
      it is a repetition, after that the point stands still;
    - the samples always span a window, so that bunched time stamps have little weight.

    The estimate is that of the middle of the window: the delay is half a window. The time may run
    backwards, as positions are a function of it; a step of more than gap_s starts anew.
    """

    def __init__(self, window_s: float = 0.1, gap_s: float = GAP_S, max_samples: int = 250) -> None:
        """Take the window [s], the greatest gap [s] between samples, and a bound of memory.

        Raises:
            ValueError: the window is not above zero, or the gap is not above the window.
        """
        if not 0.0 < window_s < gap_s:
            raise ValueError(f'0 < window < gap is needed, not 0 < {window_s} < {gap_s}')
        self._window_s = window_s
        self._gap_s = gap_s
        self._samples: Deque[_Sample] = deque(maxlen=max_samples)
        self._newest_s: Optional[float] = None

    def reset(self) -> None:
        """Forget all samples: after a discontinuity (a new segment of playback)."""
        self._samples.clear()
        self._newest_s = None

    def add(self, time_s: float, position: Vector, quaternion: Quaternion = NO_ROTATION,
            wall_s: float = 0.0) -> None:
        """Add a pose at a time [s]: position (3,) [m], quaternion (4,) x y z w; all finite.

        The wall time [s] is carried along for wall_s().
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
        while len(samples) > 2 and abs(samples[1].time_s - time_s) >= self._window_s:
            samples.popleft()

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s], or None before the samples span half a window."""
        if not self._is_known():
            return None
        return slope([sample.time_s for sample in self._samples],
                     [sample.position for sample in self._samples])

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the frame of the poses, or None as above."""
        if not self._is_known():
            return None
        return slope_of_rotations([sample.time_s for sample in self._samples],
                                  [sample.quaternion for sample in self._samples])

    def wall_s(self) -> float:
        """Return the wall time [s] of the estimate: the mean of the window's samples."""
        return sum(sample.wall_s for sample in self._samples) / max(len(self._samples), 1)

    def _is_known(self) -> bool:
        times = [sample.time_s for sample in self._samples]
        return len(times) > 1 and max(times) - min(times) >= 0.5 * self._window_s

    def _is_repetition(self, sample: _Sample, last: _Sample) -> bool:
        """Return whether a pose repeats the last one, for less than half a window."""
        return (sample.position == last.position and sample.quaternion == last.quaternion
                and abs(sample.time_s - last.time_s) < 0.5 * self._window_s)


def slope(times_s: Sequence[float], vectors: Sequence[Triple]) -> Triple:
    """Return the least-squares slope (3,) of two vectors (3,) or more over their times [s]."""
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

    It is the slope of the rotation vectors from the middle one, which is exact for a constant
    axis and has an error of second order in the angle otherwise.
    """
    middle = quaternions[len(quaternions) // 2]
    return rotated(middle, slope(times_s, [rotation_vector_between(middle, quaternion)
                                           for quaternion in quaternions]))
