# SPDX-License-Identifier: BSD-3-Clause
"""The simulated sewing cycle: the measurements of every driver of the cell, as functions of time.

They are pure functions of the time in s since the start, of the seed and of the quality.  Times
may be arrays ``(...)``; vectors then have the shape ``(..., n)``.
"""
from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Union

import numpy as np

from sewing_cell import layout
from sewing_cell.layout import ARMS, Arm
from sewing_cell.schedule import (
    Phase,
    Profile,
    ProfileValue,
    Schedule,
    between,
    smooth_step,
    steady_feed,
    window,
)
from sewing_cell.steering import Steering

if TYPE_CHECKING:
    import numpy.typing as npt  # in numpy since 1.20

_SIZE = 65521  # prime, so that the stride never enters a short loop
_STRIDE = 9973
_TICKS_PER_SECOND = 1000


class Noise:
    """Standard normal noise; the same seed, channel and time give the same value."""

    def __init__(self, seed: int) -> None:
        self._table = np.random.default_rng([seed, 1]).standard_normal(_SIZE)

    def __call__(self, channel: npt.ArrayLike, time_s: npt.ArrayLike) -> np.ndarray:
        """Noise of ``channel`` (whole numbers) at ``time_s``; both are broadcast."""
        tick = np.rint(np.asarray(time_s) * _TICKS_PER_SECOND).astype(np.int64)
        return self._table[(tick + np.asarray(channel) * _STRIDE) % _SIZE]


#: One time or many, in s since the start.
Times = Union[float, np.ndarray]

EDGE_SETPOINT = 255
EDGE_MAXIMUM = 511
EDGE_COUNTS_PER_M = 25e3

_SEAM_LENGTH = layout.SEAM_START_XY[1] - layout.SEAM_END_XY[1]
_SUPPLY_Y, _STAGE_Y, _GONE_Y = 2.20, 1.44, -1.25
_GRIP_TO_TOOL = np.array([0.0, 0.0, layout.GRIP_HEIGHT])

_FEED_FORCE_N, _FAULT_FORCE_N, _STITCH_FORCE_N = 15.0, 32.0, 1.5
_COVER_WEIGHT_N, _FORCE_NOISE_N, _TORQUE_NOISE_NM = 2.5, 0.25, 0.01
_LATERAL_STIFFNESS_N_PER_M = 900.0
_STITCHES_PER_M = 150.0
_FEED_NOISE_M_PER_S, _EDGE_NOISE = 0.0008, 1.5


class ToolState(NamedTuple):
    """Position [m] and velocity [m/s] of a tool in ``world``, shape (..., 3)."""

    position: np.ndarray
    velocity: np.ndarray


class CoverPair(NamedTuple):
    """A pair of covers: the point under the grippers, and the sewn length.

    ``y`` and ``x`` are in ``world`` [m]; ``steering`` is the lateral shift (world x) of the
    upper and the lower cover; ``sewn`` the length of the seam in the cover.
    """

    x: float
    y: float
    steering: tuple[float, float]
    sewn: float


class SewingCycle:
    """Both robots repeatedly guide pairs of leather covers through the sewing machine.

    Raises ValueError for an unknown quality, a negative seed, or a period out of range.
    """

    def __init__(self, quality: str = "good", seed: int = 0, period_s: float = 20.0) -> None:
        if seed < 0:
            raise ValueError(f"seed is {seed}; give a whole number from 0 up")
        self.schedule = Schedule(period_s)
        self._noise = Noise(seed)
        times = np.linspace(self.schedule.sew.begin, self.schedule.sew.end, 200)
        self._seam_times = (_SEAM_LENGTH * self._feed(times).value, times)
        self._steering = {
            arm.name: Steering(self.schedule, quality, seed, arm.side) for arm in ARMS
        }

    def truth(self, arm: Arm, time_s: Times) -> ToolState:
        """Exact position and velocity of the tool, without noise or rounding."""
        cycle, time_s = self._split(time_s)
        path = self._path(time_s)
        correction = self._steering[arm.name].correction(cycle, time_s)
        lift = layout.GRIP_HEIGHT + path.value[..., 2]
        x = path.value[..., 0] - correction.value
        z = layout.SEWING_PLANE_Z + arm.side * lift
        position = np.stack([x, path.value[..., 1], z], axis=-1)
        velocity = path.rate * np.array([1.0, 1.0, arm.side])
        velocity[..., 0] -= correction.rate
        return ToolState(position, velocity)

    def joints(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Joint angles theta_1 to theta_6 [rad], shape (..., 6)."""
        return arm.joints(self.truth(arm, time_s).position)

    def tool_frame(self, arm: Arm, time_s: Times) -> np.ndarray:
        """x y z [m] and rotation vector [rad] of the tool in link0, shape (..., 6)."""
        position = arm.to_base(self.truth(arm, time_s).position)
        rotation = np.broadcast_to(arm.tool_vector, position.shape)
        return np.concatenate([position, rotation], axis=-1)

    def wrench(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Force [N] and torque [Nm] on the tool in the force frame, shape (..., 6).

        The machine pulls the cover in the sewing direction, a little more with each stitch; the
        cover weighs on the gripper and resists the steering.  The force acts at the gripper's
        tip, which causes the torque.
        """
        force = self._force_world(arm, time_s)
        lever = -arm.side * _GRIP_TO_TOOL
        wrench = np.concatenate(
            [arm.to_force_frame(force), arm.to_force_frame(np.cross(lever, force))], axis=-1
        )
        scale = np.repeat([_FORCE_NOISE_N, _TORQUE_NOISE_NM], 3)
        channels = 10 * (2 + arm.side) + np.arange(6)
        return wrench + scale * self._noise(channels, np.asarray(time_s)[..., None])

    def edge(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Reading of the arm's edge sensor, whole numbers 0 to 511; above 255: right of the line.

        Right is as seen along the feed: world -x.
        """
        noise = _EDGE_NOISE * self._noise(2 + arm.side, time_s)
        reading = EDGE_SETPOINT + EDGE_COUNTS_PER_M * self.edge_error(arm, time_s) + noise
        return np.clip(np.rint(reading), 0, EDGE_MAXIMUM).astype(int)

    def edge_error(self, arm: Arm, time_s: Times) -> np.ndarray:
        """Return the distance of the cover's edge to the right of its line at the needle [m]."""
        return self._steering[arm.name].error(*self._split(time_s))

    def feed_rate(self, time_s: Times) -> np.ndarray:
        """The machine's estimate of its feed rate [m/s], never negative."""
        _, phase_s = self._split(time_s)
        speed = self._feed(phase_s).rate * _SEAM_LENGTH
        noise = _FEED_NOISE_M_PER_S * self._noise(5, time_s)
        return np.maximum(speed + np.where(speed > 0, noise, 0.0), 0.0)

    def covers(self, time_s: float) -> tuple[CoverPair, ...]:
        """The pairs of covers in the cell: the pair being sewn, and the next pair."""
        cycle, phase_s = self._split(time_s)
        corrections = [self._steering[arm.name].correction(cycle, phase_s) for arm in ARMS]
        steering = (-float(corrections[0].value), -float(corrections[1].value))
        sewn = _SEAM_LENGTH * float(self._feed(phase_s).value)
        x, y = self._cover_path(phase_s)
        next_y = self._next_cover_y(phase_s)
        return (
            CoverPair(x, y, steering, sewn),
            CoverPair(layout.FETCH_XY[0], next_y, (0.0, 0.0), 0.0),
        )

    def seam_offset(self, time_s: float, along_m: np.ndarray) -> np.ndarray:
        """Distance of the seam from its line in the upper cover [m], positive towards its edge.

        ``along_m`` is measured from the seam's start; the cover is the one being sewn.
        """
        cycle, _ = self._split(time_s)
        return -self._steering["upper"].error(cycle, np.interp(along_m, *self._seam_times))

    def _split(self, time_s: Times) -> tuple[np.ndarray, np.ndarray]:
        """Number of the cycle and the time in it [s]."""
        time_s = np.asarray(time_s, dtype=float)
        cycle = np.floor_divide(time_s, self.schedule.period_s)
        return cycle.astype(int), time_s - cycle * self.schedule.period_s

    def _feed(self, phase_s: np.ndarray) -> ProfileValue:
        """The sewn share of the seam, 0 to 1, and its rate per second."""
        return between(phase_s, self.schedule.sew.begin, self.schedule.sew.end, steady_feed)

    def _path(self, phase_s: np.ndarray) -> ProfileValue:
        """x, y and lift of the tools without steering, shape (..., 3): a sum of moves."""
        lift = layout.LIFT_HEIGHT
        start = np.array([*layout.FETCH_XY, lift])
        grip = np.array([*layout.FETCH_XY, 0.0])
        seam_start = np.array([*layout.SEAM_START_XY, 0.0])
        seam_end = np.array([*layout.SEAM_END_XY, 0.0])
        free = np.array([*layout.SEAM_END_XY, lift])
        plan = self.schedule
        moves: tuple[tuple[Phase, np.ndarray, Profile], ...] = (
            (plan.grip, grip - start, smooth_step),
            (plan.bring, seam_start - grip, smooth_step),
            (plan.sew, seam_end - seam_start, steady_feed),
            (plan.release, free - seam_end, smooth_step),
            (plan.go_back, start - free, smooth_step),
        )
        value = np.zeros(np.shape(phase_s) + (3,)) + start
        rate = np.zeros(np.shape(phase_s) + (3,))
        for phase, step, profile in moves:
            course = between(phase_s, phase.begin, phase.end, profile)
            value += step * course.value[..., None]
            rate += step * course.rate[..., None]
        return ProfileValue(value, rate)

    def _cover_path(self, phase_s: np.ndarray) -> tuple[float, float]:
        """x and y of the covers being sewn: with the tools, then out of the cell."""
        plan = self.schedule
        held = self._path(np.minimum(phase_s, plan.sew.end)).value
        away = between(phase_s, plan.take_away.begin, plan.take_away.end).value
        return float(held[0]), float(held[1] + (_GONE_Y - layout.SEAM_END_XY[1]) * away)

    def _next_cover_y(self, phase_s: np.ndarray) -> float:
        plan = self.schedule
        staged = between(phase_s, plan.stage.begin, plan.stage.end).value
        presented = between(phase_s, plan.present.begin, plan.present.end).value
        way = (_STAGE_Y - _SUPPLY_Y) * staged + (layout.FETCH_XY[1] - _STAGE_Y) * presented
        return float(_SUPPLY_Y + way)

    def _force_world(self, arm: Arm, time_s: Times) -> np.ndarray:
        cycle, phase_s = self._split(time_s)
        plan, steering = self.schedule, self._steering[arm.name]
        held = window(phase_s, plan.grip.end, plan.sew.end, 0.4).value
        feed = self._feed(phase_s)
        pulling = feed.rate * (plan.sew.end - plan.sew.begin)
        stitch = np.sin(2 * np.pi * _STITCHES_PER_M * _SEAM_LENGTH * feed.value)
        pull = _FEED_FORCE_N + _FAULT_FORCE_N * steering.fault_level(cycle, phase_s)
        force = np.zeros(np.shape(time_s) + (3,))
        force[..., 0] = _LATERAL_STIFFNESS_N_PER_M * steering.correction(cycle, phase_s).value
        force[..., 1] = -pulling * (pull + _STITCH_FORCE_N * stitch)
        force[..., 2] = -_COVER_WEIGHT_N * held
        return force
