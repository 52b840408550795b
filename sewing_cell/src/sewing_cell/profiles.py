# SPDX-License-Identifier: BSD-3-Clause
"""Smooth courses from 0 to 1, each with its slope; twice continuously differentiable."""

from __future__ import annotations

from typing import Callable, NamedTuple

import numpy as np


class Course(NamedTuple):
    """A value over time and its rate of change per second."""

    value: np.ndarray
    rate: np.ndarray


def smooth_step(progress: np.ndarray) -> Course:
    """Quintic step (minimum jerk, Flash and Hogan 1985); ``rate`` is per unit of progress."""
    u = _clamped(progress)
    return Course(u * u * u * (10 + u * (6 * u - 15)), 30 * (u * (1 - u)) ** 2)


def steady_feed(progress: np.ndarray, ramp: float = 0.13) -> Course:
    """Constant speed but for smooth ramps of length ``ramp`` at both ends (progress 0 to 1)."""
    u = _clamped(progress)
    speed = 1.0 / (1.0 - ramp)
    near = np.minimum(u, 1.0 - u) / ramp
    inside = np.minimum(near, 1.0)
    ramped = speed * ramp * (inside**3 - inside**4 / 2 + np.maximum(near - 1.0, 0.0))
    rate = speed * inside**2 * (3 - 2 * inside)
    return Course(np.where(u < 0.5, ramped, 1.0 - ramped), rate)


def _clamped(progress: np.ndarray) -> np.ndarray:
    """``progress`` within 0 to 1 (np.clip is several times slower for single numbers)."""
    return np.minimum(np.maximum(progress, 0.0), 1.0)


Profile = Callable[[np.ndarray], Course]


def between(time: np.ndarray, begin: float, end: float, profile: Profile = smooth_step) -> Course:
    """``profile`` stretched over ``begin`` to ``end`` [s]; its rate is per second."""
    course = profile((time - begin) / (end - begin))
    return Course(course.value, course.rate / (end - begin))


def window(time: np.ndarray, begin: float, end: float, edge: float) -> Course:
    """1 between ``begin`` and ``end`` [s], with smooth edges of ``edge`` seconds inside them."""
    rise = between(time, begin, begin + edge)
    fall = between(time, end - edge, end)
    return Course(rise.value - fall.value, rise.rate - fall.rate)


def product(left: Course, right: Course) -> Course:
    """The product of two courses."""
    return Course(left.value * right.value, left.rate * right.value + left.value * right.rate)
