"""The velocity of a point from positions that arrive at uneven times."""
from __future__ import annotations

from collections import deque
from typing import Deque, Optional, Sequence, Tuple, Union

import numpy as np

Sample = Tuple[float, float, float, float]  # time [s], position [m]


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

    def __init__(self, window_s: float = 0.1, gap_s: float = 1.0, max_samples: int = 250) -> None:
        """Take the window [s], the greatest gap [s] between samples, and a bound of memory.

        Raises:
            ValueError: the window is not above zero, or the gap is not above the window.
        """
        if not 0.0 < window_s < gap_s:
            raise ValueError(f'0 < window < gap is needed, not 0 < {window_s} < {gap_s}')
        self._window_s = window_s
        self._gap_s = gap_s
        self._samples: Deque[Sample] = deque(maxlen=max_samples)
        self._newest_s: Optional[float] = None

    def reset(self) -> None:
        """Forget all samples: after a discontinuity (a new segment of playback)."""
        self._samples.clear()
        self._newest_s = None

    def add(self, time_s: float, position: Union[Sequence[float], np.ndarray]) -> None:
        """Add a position (3,) [m] at a time [s]; both must be finite."""
        if self._newest_s is not None and abs(time_s - self._newest_s) > self._gap_s:
            self.reset()
        self._newest_s = time_s
        sample = (time_s, float(position[0]), float(position[1]), float(position[2]))
        if self._is_repetition(sample):
            return
        self._samples.append(sample)
        while len(self._samples) > 2 and abs(self._samples[1][0] - time_s) >= self._window_s:
            self._samples.popleft()

    def velocity(self) -> Optional[np.ndarray]:
        """Return the velocity (3,) [m/s], or None before the samples span half a window."""
        if len(self._samples) < 2:
            return None
        times, *axes = zip(*self._samples)
        if max(times) - min(times) < 0.5 * self._window_s:
            return None
        mean_s = sum(times) / len(times)
        # A dozen samples: Python's own numbers are faster here than arrays.
        lever = [time_s - mean_s for time_s in times]
        inertia = sum(part * part for part in lever)
        return np.array([
            sum(part * (value - axis[0]) for part, value in zip(lever, axis)) / inertia
            for axis in axes
        ])

    def _is_repetition(self, sample: Sample) -> bool:
        """Tell whether the position repeats the last one, for less than half a window."""
        if not self._samples or sample[1:] != self._samples[-1][1:]:
            return False
        return abs(sample[0] - self._samples[-1][0]) < 0.5 * self._window_s
