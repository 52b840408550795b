# SPDX-License-Identifier: BSD-3-Clause
"""The Kinect's pictures of the simulated cell: color and registered depth, 640 x 480.

The static background is drawn once, in a few variants of noise; a frame copies one of them and
draws the covers and the robots into the copy.
"""
from __future__ import annotations

from functools import partial
from typing import Callable, NamedTuple, Optional

import numpy as np

from sewing_cell import layout, pinhole, scene
from sewing_cell.cycle import CoverPair, SewingCycle
from sewing_cell.layout import ARMS, Arm
from sewing_cell.mesh_picture import Picture, measure
from sewing_cell.scene import Intruder, draw_robot, link_poses

_NOISE_STEPS = 0.35
_HOLE_SHARE = 4e-4


class DepthNoise:
    """The errors of pictures of one shape, drawn once in a few variants; each frame gets one."""

    def __init__(self, shape: tuple[int, int], random: np.random.Generator,
                 variants: int = 1) -> None:
        self._noise_steps = [_noise(shape, random) for _ in range(variants)]

    def measured(self, depth_m: np.ndarray, variant: int = 0) -> np.ndarray:
        """Return the measured depth in mm (uint16), 0 in shadows and holes.

        ``depth_m`` is the true depth, float32.
        """
        return measure(depth_m, self._noise_steps[variant])


def _noise(shape: tuple[int, int], random: np.random.Generator) -> np.ndarray:
    """Noise of the disparity in steps, NaN in holes."""
    noise = np.float32(_NOISE_STEPS) * random.standard_normal(shape, dtype=np.float32)
    noise[random.random(shape) < _HOLE_SHARE] = np.nan
    return noise


class Lookahead:
    """Rows of ``function(times)`` by tick, computed a block at a time.

    numpy needs nearly the same time for a single row and a block of rows.  ``function`` takes
    times (n,) in s and returns an array whose first dimension is n.
    """

    def __init__(
        self, function: Callable[[np.ndarray], np.ndarray], rate_hz: float, size: int = 25
    ) -> None:
        self._function, self._rate_hz, self._size = function, rate_hz, size
        self._block = -1
        self._rows: list = []

    def __call__(self, tick: int) -> list:
        """Return the row of ``tick`` as a list (a number if the function returns numbers)."""
        block, row = divmod(tick, self._size)
        if block != self._block:
            ticks = np.arange(block * self._size, (block + 1) * self._size)
            self._rows = self._function(ticks / self._rate_hz).tolist()
            self._block = block
        return self._rows[row]


_VARIANTS = 4
_COLOR_NOISE = 2.5
_TEXEL_M = 0.002
_LOWER_MARGIN_M = 0.012  # by which the lower cover is larger, so that its rim is visible
_SEAM_INSET = layout.NEEDLE[0] - layout.SEAM_START_XY[0]
_SEAM_BEGIN = layout.NEEDLE[1] - layout.SEAM_START_XY[1]
_STITCH_M = 0.012
_THREAD = (236, 222, 190)
_ABOVE_M = 0.01  # anything higher than this above a cover occludes it


class CameraFrame(NamedTuple):
    """Color (480, 640, 3) uint8 and depth (480, 640) uint16 in mm, 0 where there is no depth."""

    color: np.ndarray
    depth: np.ndarray


def _pixels(color: np.ndarray) -> np.ndarray:
    """View of uint8 (..., 3) with one element per pixel: much faster to copy and to mask."""
    return color.view("V3")[..., 0]


class Cover:
    """One cover's leather and the plane in which it lies."""

    def __init__(self, height_m: float, margin_m: float, tone: tuple[int, int, int],
                 random: np.random.Generator, camera: np.ndarray) -> None:
        x_min, x_max, y_min, y_max = layout.COVER_BOX
        self.box = (x_min, x_max + margin_m, y_min, y_max + margin_m)
        self.height_m = height_m
        self.texture = _pixels(_leather(self.box, tone, random))
        self._camera_y = camera[1]
        depth, self._row_x = pinhole.plane_rows(height_m, camera)
        self._row_y_per_column = depth / pinhole.FOCAL_LENGTH_PX
        self.plane_depth = np.repeat(depth[:, None], pinhole.WIDTH, axis=1).astype(np.float32)

    def locate(self, x: float, y: float) -> tuple[slice, slice, np.ndarray, np.ndarray]:
        """Return the image rows and columns of the cover at ``x``, ``y``, and their texels.

        The columns of texels are outside the texture for pixels beside the cover.
        """
        x_min, x_max, y_min, y_max = self.box
        # x falls along the rows, y falls along the columns
        first = int(np.searchsorted(-self._row_x, -(x + x_max)))
        rows = slice(first, int(np.searchsorted(-self._row_x, -(x + x_min))))
        scale = self._row_y_per_column[rows].astype(np.float32)
        center_y = self._camera_y
        columns = _columns(center_y - y - y_max, center_y - y - y_min, scale)
        across = ((self._row_x[rows] - x - x_min) / _TEXEL_M).astype(np.int32)
        u = np.arange(columns.start, columns.stop, dtype=np.float32) - pinhole.CENTER_U
        along = (center_y - y - y_min) / _TEXEL_M - (scale / _TEXEL_M)[:, None] * u
        return rows, columns, across, np.floor(along).astype(np.int32)


class Camera:
    """Pictures of a sewing cycle, ``rate_hz`` per second; the same seed gives the same pictures.

    ``place`` (3,) is the position of the camera in ``world`` [m].
    """

    def __init__(self, cycle: SewingCycle, rate_hz: float = 30.0, seed: int = 0,
                 place: np.ndarray = pinhole.POSITION,
                 intruder: Optional[Intruder] = None) -> None:
        self._cycle, self._rate_hz, self._place = cycle, rate_hz, place
        self._intruder = intruder
        self._robots = [Lookahead(partial(_poses, cycle, arm, place), rate_hz) for arm in ARMS]
        random = np.random.default_rng([seed, 4])
        height, lower = layout.COVER_THICKNESS, -layout.COVER_THICKNESS
        plane = layout.SEWING_PLANE_Z
        self._covers = (
            Cover(plane + height, 0.0, (150, 98, 60), random, place),
            Cover(plane + lower, _LOWER_MARGIN_M, (104, 66, 42), random, place),
        )
        still = scene.still_picture(place)
        self._still_depth = still.depth
        self._still_colors = [_with_noise(still.color, random) for _ in range(_VARIANTS)]
        self._noise = DepthNoise(still.depth.shape, random, _VARIANTS)
        self._free = [still.depth > cover.plane_depth - _ABOVE_M for cover in self._covers]

    def render(self, number: int) -> CameraFrame:
        """Return picture ``number`` of the cycle, from 0; both arrays belong to the caller."""
        time_s, variant = number / self._rate_hz, number % _VARIANTS
        picture = Picture(self._still_depth.copy(), self._still_colors[variant].copy())
        for pair in self._cycle.covers(time_s):
            for layer in (1, 0):
                self._draw_cover(picture, layer, pair)
            if pair.sewn > 0:
                self._draw_seam(picture, pair, time_s)
        for poses in self._robots:
            draw_robot(picture, np.array(poses(number)))
        if self._intruder is not None:
            self._intruder.draw(picture, time_s, self._place)
        return CameraFrame(picture.color, self._noise.measured(picture.depth, variant))

    def _draw_cover(self, picture: Picture, layer: int, pair: CoverPair) -> None:
        cover = self._covers[layer]
        rows, columns, across, along = cover.locate(pair.x + pair.steering[layer], pair.y)
        if along.size == 0:
            return
        length = cover.texture.shape[1]
        on_cover = (along >= 0) & (along < length) & self._free[layer][rows, columns]
        texels = across[:, None] * length + along
        leather = cover.texture.ravel().take(texels, mode="clip")
        np.copyto(_pixels(picture.color)[rows, columns], leather, where=on_cover)
        np.copyto(picture.depth[rows, columns], cover.plane_depth[rows, columns], where=on_cover)

    def _draw_seam(self, picture: Picture, pair: CoverPair, time_s: float) -> None:
        """Draw the thread on the sewn part of the upper cover: stitches with gaps between them."""
        along = np.arange(0.0, pair.sewn, _TEXEL_M)
        along = along[np.mod(along, _STITCH_M) < 0.75 * _STITCH_M]
        x = pair.x + pair.steering[0] + _SEAM_INSET - self._cycle.seam_offset(time_s, along)
        y = pair.y + _SEAM_BEGIN + along
        z = np.full_like(along, self._covers[0].height_m)
        pixels = np.rint(pinhole.project(np.stack([x, y, z], axis=-1), self._place))
        pixels = pixels.astype(int)
        u, v = pixels[:, 0], pixels[:, 1]
        inside = (u >= 0) & (u < pinhole.WIDTH) & (v >= 0) & (v < pinhole.HEIGHT)
        u, v = u[inside], v[inside]
        free = self._free[0][v, u]
        picture.color[v[free], u[free]] = _THREAD


def _poses(cycle: SewingCycle, arm: Arm, place: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    return link_poses(arm, cycle.joints(arm, times_s), place)


def _columns(first_m: float, last_m: float, scale: np.ndarray) -> slice:
    """Columns between two distances from the image's center, for all rows of ``scale`` [m/px]."""
    edges = np.array([first_m, last_m])[:, None] / scale if scale.size else np.zeros((2, 1))
    low = int(np.clip(np.ceil(edges[0].min() + pinhole.CENTER_U), 0, pinhole.WIDTH))
    high = int(np.clip(np.floor(edges[1].max() + pinhole.CENTER_U) + 1, low, pinhole.WIDTH))
    return slice(low, high)


def _with_noise(color: np.ndarray, random: np.random.Generator) -> np.ndarray:
    noisy = color + _COLOR_NOISE * random.standard_normal(color.shape[:2])[..., None]
    return np.clip(noisy, 0, 255).astype(np.uint8)


def _leather(box: tuple[float, float, float, float], tone: tuple[int, int, int],
             random: np.random.Generator) -> np.ndarray:
    """Texels (x, y, 3) of a cover: grain, and soft clouds that make the leather look natural."""
    shape = (
        int(np.ceil((box[1] - box[0]) / _TEXEL_M)) + 1,
        int(np.ceil((box[3] - box[2]) / _TEXEL_M)),
    )
    grain = 0.055 * random.standard_normal(shape)
    clouds = 0.06 * _smooth_noise(shape, 0.07, random) + 0.05 * _smooth_noise(shape, 0.02, random)
    brightness = 1.0 + grain + clouds
    return np.clip(brightness[..., None] * np.array(tone), 0, 255).astype(np.uint8)


def _smooth_noise(shape: tuple[int, int], size_m: float, random: np.random.Generator) -> np.ndarray:
    """Bilinear noise over texels of ``shape`` with bumps of about ``size_m``."""
    cells = [int(np.ceil(length * _TEXEL_M / size_m)) for length in shape]
    knots = random.standard_normal((cells[0] + 1, cells[1] + 1))
    row, column = (np.linspace(0, count, length) for count, length in zip(cells, shape))
    by_column = np.array([np.interp(column, np.arange(cells[1] + 1), knot) for knot in knots])
    return np.array([np.interp(row, np.arange(cells[0] + 1), line) for line in by_column.T]).T
