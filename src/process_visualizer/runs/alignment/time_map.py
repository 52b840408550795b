# SPDX-License-Identifier: BSD-3-Clause
"""A monotone, piecewise linear map between the times of a reference and of a run."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np

_MIN_STEP_S = 1e-6
"""Minimum spacing of the points of a map [s], which keeps the map invertible."""


class TimeMap(NamedTuple):
    """``run_s[i]`` corresponds to ``reference_s[i]`` (n,) [s]; both ascend; n is at least 1.

    Before the first and after the last point both clocks run equally fast.
    """

    reference_s: np.ndarray
    run_s: np.ndarray

    def to_run(self, reference_s: np.ndarray) -> np.ndarray:
        """Return the times of the run (m,) [s] at times of the reference (m,)."""
        return _mapped(np.asarray(reference_s, float), self.reference_s, self.run_s)

    def to_reference(self, run_s: np.ndarray) -> np.ndarray:
        """Return the times of the reference (m,) [s] at times of the run (m,)."""
        return _mapped(np.asarray(run_s, float), self.run_s, self.reference_s)


def time_map(reference_s: np.ndarray, run_s: np.ndarray) -> TimeMap:
    """Return the map through points (n,), which are made to ascend where they do not."""
    return TimeMap(_rising(reference_s), _rising(run_s))


def shift(run_s: float) -> TimeMap:
    """Return the map that puts a time of the run at the reference's zero."""
    return TimeMap(np.zeros(1), np.array([run_s]))


def joined(first: TimeMap, second: TimeMap) -> TimeMap:
    """Return the map from the reference of the first map to the run of the second.

    The run of the first map is the reference of the second.
    """
    between_s = np.union1d(first.run_s, second.reference_s)
    return time_map(first.to_reference(between_s), second.to_run(between_s))


def _rising(times_s: np.ndarray) -> np.ndarray:
    steps = _MIN_STEP_S * np.arange(len(times_s))
    result: np.ndarray = np.maximum.accumulate(times_s - steps) + steps
    return result


def _mapped(times_s: np.ndarray, known_s: np.ndarray, others_s: np.ndarray) -> np.ndarray:
    inside = np.interp(times_s, known_s, others_s)
    before = np.minimum(times_s - known_s[0], 0.0)
    behind = np.maximum(times_s - known_s[-1], 0.0)
    result: np.ndarray = inside + before + behind
    return result
