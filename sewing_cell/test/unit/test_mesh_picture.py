# SPDX-License-Identifier: BSD-3-Clause
"""Meshes are drawn in the right place by the C++ library."""

from __future__ import annotations

import numpy as np
import pytest

from sewing_cell import pinhole
from sewing_cell.kinematics import rotation_matrix
from sewing_cell.mesh_picture import Mesh, Picture, box_mesh, joined

RED, GREEN = (200, 0, 0), (0, 200, 0)
IN_FRONT = np.eye(4)


def optical_rays() -> np.ndarray:
    """Each pixel's ray in the camera, per m of depth, (480, 640, 3)."""
    return pinhole.rays() @ pinhole.WORLD_FROM_OPTICAL


def drawn(*meshes: Mesh) -> Picture:
    picture = Picture.empty()
    for mesh in meshes:
        picture.draw(mesh, IN_FRONT)
    return picture


def wall(depth_m: float, color: tuple[int, int, int]) -> Mesh:
    return box_mesh(np.array([-0.3, -0.2, depth_m]), np.array([0.3, 0.2, depth_m + 0.1]), color)


def box_depth(size: np.ndarray, rotation: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Depth at which each ray enters a box, inf beside it: the slabs of its three axes."""
    rays, eye = optical_rays() @ rotation, -center @ rotation
    first, second = (-size / 2 - eye) / rays, (size / 2 - eye) / rays
    enter = np.minimum(first, second).max(axis=-1)
    leave = np.maximum(first, second).min(axis=-1)
    return np.where(enter <= leave, enter, np.inf)


@pytest.mark.parametrize("seed", range(8))
def test_a_turned_box_has_the_depth_that_its_rays_meet(seed: int) -> None:
    random = np.random.default_rng(seed)
    size = random.uniform(0.05, 0.6, 3)
    center = np.array([0.0, 0.0, 1.5]) + random.uniform(-0.4, 0.4, 3)
    rotation = rotation_matrix(random.normal(size=3))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, center
    picture = Picture.empty()
    picture.draw(box_mesh(-size / 2, size / 2, RED), pose)
    expected = box_depth(size, rotation, center)
    assert np.isfinite(expected).sum() > 500
    # At the outline, rounding decides whether a pixel belongs to the box.
    differs = np.isfinite(picture.depth) != np.isfinite(expected)
    assert differs.sum() <= 3
    both = np.isfinite(picture.depth) & np.isfinite(expected)
    np.testing.assert_allclose(picture.depth[both], expected[both], atol=2e-5)


def test_a_surface_of_many_triangles_has_no_holes() -> None:
    random = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60), indexing="ij"), -1)
    grid[1:-1, 1:-1] += random.uniform(-0.01, 0.01, (58, 58, 2))
    points = np.concatenate([grid, np.full((60, 60, 1), 1.0)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.concatenate([np.stack([a, d, c], -2), np.stack([a, c, b], -2)]).reshape(-1, 3, 3)
    np.testing.assert_allclose(drawn(Mesh.of(corners, RED)).depth, 1.0, atol=1e-6)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_what_is_nearer_is_seen(order: tuple[int, int]) -> None:
    walls = (wall(1.0, RED), wall(2.0, GREEN))
    picture = drawn(*(walls[number] for number in order))
    assert picture.depth[240, 320] == pytest.approx(1.0)
    assert tuple(picture.color[240, 320]) == RED
    assert tuple(drawn(joined(list(walls))).color[240, 320]) == RED


def test_what_looks_away_or_is_behind_the_camera_is_not_drawn() -> None:
    front = wall(1.0, RED)
    from_inside = Mesh(np.ascontiguousarray(front.corners[:, ::-1]), front.colors)
    assert drawn(from_inside).depth[240, 320] == pytest.approx(1.1)
    for depth_m in (-1.0, -0.05):
        assert not np.isfinite(drawn(wall(depth_m, RED)).depth).any()


def test_faces_that_look_aside_are_darker() -> None:
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrix(np.array([0.0, 1.0, 0.0]))
    pose[:3, 3] = 0.0, 0.0, 1.0
    picture = Picture.empty()
    picture.draw(box_mesh(np.full(3, -0.2), np.full(3, 0.2), RED), pose)
    reds = np.unique(picture.color[np.isfinite(picture.depth)][:, 0])
    assert len(reds) == 2 and 100 < reds[0] < reds[1] < 200


def test_arrays_that_the_library_cannot_read_are_refused() -> None:
    with pytest.raises(AssertionError):
        Picture(np.full((480, 640), np.inf), np.zeros((480, 640, 3), np.uint8)).draw(
            wall(1.0, RED), IN_FRONT)
