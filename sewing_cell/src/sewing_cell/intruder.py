# SPDX-License-Identifier: BSD-3-Clause
"""Something in the cell that no model knows: a box put down, or something of a hand's size."""

from __future__ import annotations

from typing import Mapping

import numpy as np

from sewing_cell import depth_noise, pinhole, scene

_PERIOD_S = 8.0  # of the hand's way in and out


class Way:
    """A thing's size [m] and colour, and its centre in ``world`` [m] outside and inside."""

    def __init__(self, size: tuple[float, float, float], outside: tuple[float, float, float],
                 inside: tuple[float, float, float], colour: tuple[int, int, int]) -> None:
        self.size, self.colour = np.array(size), colour
        self._outside, self._inside = np.array(outside), np.array(inside)

    def centre(self, time_s: float) -> np.ndarray:
        """Where it is, (3,) [m]: it moves in and out evenly, and without a jerk."""
        share = 0.5 - 0.5 * np.cos(2 * np.pi * time_s / _PERIOD_S)
        return self._outside + share * (self._inside - self._outside)


_ON_SUPPLY = (-0.45, 0.90, 0.105)

#: A box on the supply table, and a hand that comes near the upper robot's gripper.
INTRUDERS: Mapping[str, Way] = {
    "box": Way((0.30, 0.20, 0.15), _ON_SUPPLY, _ON_SUPPLY, (196, 160, 104)),
    "hand": Way((0.20, 0.10, 0.06), (-1.0, 0.15, 0.30), (-0.78, 0.15, 0.22), (222, 170, 140)),
}


class Intruder:
    """One of ``INTRUDERS`` in the Kinect's pictures; the same seed gives the same noise."""

    def __init__(self, kind: str, seed: int = 0) -> None:
        self._way = INTRUDERS[kind]
        self._random = np.random.default_rng([seed, 7])
        directions = pinhole.rays()
        self._directions = np.where(np.abs(directions) < 1e-9, 1e-9, directions)

    def box(self, time_s: float) -> scene.Box:
        """Its place at a time."""
        centre, half = self._way.centre(time_s), self._way.size / 2
        return scene.Box(centre - half, centre + half, self._way.colour)

    def draw(self, colour: np.ndarray, depth_mm: np.ndarray, time_s: float,
             camera: np.ndarray = pinhole.POSITION) -> None:
        """Draw it into a colour (480, 640, 3) and a depth (480, 640) picture where it is in front.

        ``camera`` (3,) is where they are taken, in ``world`` [m].
        """
        box = self.box(time_s)
        where = _around(box, camera)
        depth, face = scene.intersect(box, camera, self._directions[where])
        behind = depth_mm[where].astype(float) / 1000
        seen = np.isfinite(depth) & ((depth < behind) | (behind == 0))
        measured = depth_noise.measured(np.where(seen, depth, 1.0), self._random)
        np.copyto(depth_mm[where], measured, where=seen)
        shades = scene.LIGHT[face][..., None] * np.array(box.colour)
        np.copyto(colour[where], shades.astype(np.uint8), where=seen[..., None])


def _around(box: scene.Box, camera: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns of the picture in which a box is."""
    ends = np.stack([box.lower, box.upper])
    corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
    pixels = pinhole.project(corners, camera)[:, :2]
    first = np.clip(np.floor(pixels.min(axis=0)), 0, None).astype(int)
    last = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, None).astype(int)
    return slice(first[1], last[1]), slice(first[0], last[0])
