# SPDX-License-Identifier: BSD-3-Clause
"""The simulated Kinect's pictures show the cell in the right place."""

from __future__ import annotations

import numpy as np
import pytest

from sewing_cell import layout, pinhole
from sewing_cell.camera import Camera, CameraFrame, DepthNoise
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import UPPER
from sewing_cell.scene import INTRUDERS

RATE_HZ = 30.0
SEWING = 240  # number of a picture while the machine sews
THREAD = np.array([236.0, 222.0, 190.0])
COVER_Z = layout.SEWING_PLANE_Z + layout.COVER_THICKNESS


@pytest.fixture(scope="module")
def cycle() -> SewingCycle:
    return SewingCycle("good", seed=1)


@pytest.fixture(scope="module")
def camera(cycle: SewingCycle) -> Camera:
    return Camera(cycle, RATE_HZ, seed=1)


def is_leather(frame: CameraFrame) -> np.ndarray:
    """Pixels with the upper cover's hue: brown, neither gray nor wood nor metal."""
    red, green, blue = (frame.color[..., i].astype(float) for i in range(3))
    return (red > 1.35 * green) & (green > 1.3 * blue) & (red > 120)


def world_points(frame: CameraFrame) -> np.ndarray:
    """Points (480, 640, 3) in ``world`` from the depth and the camera's pose."""
    v, u = np.mgrid[: pinhole.HEIGHT, : pinhole.WIDTH]
    depth = frame.depth / 1000.0
    optical = [
        (u - 319.5) / 525.0 * depth,
        (v - 239.5) / 525.0 * depth,
        depth,
    ]
    return np.stack(optical, axis=-1) @ pinhole.WORLD_FROM_OPTICAL.T + pinhole.POSITION


def test_camera_looks_down_with_its_top_towards_the_robots() -> None:
    right, down, forward = pinhole.WORLD_FROM_OPTICAL.T
    np.testing.assert_allclose(right, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(down, [-1, 0, 0], atol=0.03)
    np.testing.assert_allclose(forward, [0, 0, -1], atol=0.03)
    np.testing.assert_allclose(pinhole.POSITION, [-0.53, 0.045, 1.90], atol=1e-12)


def test_projection_is_the_inverse_of_the_rays() -> None:
    depth = np.random.default_rng(0).uniform(0.5, 4, (pinhole.HEIGHT, pinhole.WIDTH, 1))
    u, v, back = np.moveaxis(pinhole.project(pinhole.POSITION + depth * pinhole.rays()), -1, 0)
    np.testing.assert_allclose(u, np.broadcast_to(np.arange(640), u.shape), atol=1e-6)
    np.testing.assert_allclose(v, np.broadcast_to(np.arange(480)[:, None], v.shape), atol=1e-6)
    np.testing.assert_allclose(back, depth[..., 0], atol=1e-9)


@pytest.mark.parametrize("number", [0, 10, SEWING, 400, 480, 540, 599, 600, 12345])
def test_shapes_and_types(camera: Camera, number: int) -> None:
    frame = camera.render(number)
    assert (frame.color.shape, frame.color.dtype) == ((480, 640, 3), np.uint8)
    assert (frame.depth.shape, frame.depth.dtype) == ((480, 640), np.uint16)
    assert frame.color.flags.c_contiguous
    assert frame.depth.max() < 4000


def test_frames_belong_to_the_caller(camera: Camera) -> None:
    first = camera.render(SEWING)
    kept = CameraFrame(first.color.copy(), first.depth.copy())
    first.color[:] = 0
    first.depth[:] = 0
    again = camera.render(SEWING)
    np.testing.assert_array_equal(again.color, kept.color)
    np.testing.assert_array_equal(again.depth, kept.depth)


@pytest.mark.parametrize("number", [20, 100, SEWING, 380])
def test_cover_lies_in_the_sewing_plane(camera: Camera, number: int) -> None:
    """Depth, intrinsics and the camera's pose give the cover's height to a centimeter."""
    frame = camera.render(number)
    on_cover = is_leather(frame) & (frame.depth > 0)
    height = world_points(frame)[on_cover, 2]
    assert on_cover.sum() > 10000
    assert abs(np.median(height) - COVER_Z) < 0.01
    assert np.percentile(np.abs(height - COVER_Z), 98) < 0.02


@pytest.mark.parametrize("number", [20, 80, 100, SEWING, 380])
def test_cover_is_where_the_cycle_says(
    camera: Camera, cycle: SewingCycle, number: int
) -> None:
    frame = camera.render(number)
    pair = cycle.covers(number / RATE_HZ)[0]
    x_min, x_max, y_min, y_max = layout.COVER_BOX
    on_plane = pinhole.POSITION + pinhole.rays() * pinhole.plane_rows(COVER_Z)[0][:, None, None]
    x, y = on_plane[..., 0] - pair.x - pair.steering[0], on_plane[..., 1] - pair.y
    inside = (x > x_min + 0.01) & (x < x_max - 0.01) & (y > y_min + 0.01) & (y < y_max - 0.01)
    beside = (x < x_min - 0.03) | (x > x_max + 0.03) | (y < y_min - 0.03) | (y > y_max + 0.03)
    leather = is_leather(frame)
    near_cover = (np.abs(y) < 1.0) & (on_plane[..., 1] < 0.55)
    # Pixels inside that are not leather: the robot's wrist above it, the machine's arm, and the
    # seam.
    assert leather[inside].mean() > 0.8
    assert leather[beside & near_cover].mean() < 0.01


def test_covers_move_with_the_feed(camera: Camera, cycle: SewingCycle) -> None:
    def rear_edge(number: int) -> float:
        leather = is_leather(camera.render(number))
        row = leather[300, 200:]  # beside the robot, and to the right of the supply table
        return float(200 + np.argmax(row))

    numbers = (150, 360)
    moved_px = rear_edge(numbers[1]) - rear_edge(numbers[0])
    y = [cycle.covers(number / RATE_HZ)[0].y for number in numbers]
    expected_px = (y[0] - y[1]) * pinhole.FOCAL_LENGTH_PX / (1.90 - COVER_Z)
    assert moved_px == pytest.approx(expected_px, abs=3)
    assert moved_px > 80


def test_seam_appears_on_the_sewn_part(camera: Camera, cycle: SewingCycle) -> None:
    def thread_pixels(number: int) -> int:
        seam = [[layout.NEEDLE[0], layout.NEEDLE[1] - ahead, COVER_Z] for ahead in (0.1, 0.4)]
        (u_0, v_0, _), (u_1, _, _) = pinhole.project(np.array(seam)).tolist()
        region = camera.render(number).color[int(v_0) - 4 : int(v_0) + 5, int(u_0) : int(u_1)]
        return int((np.abs(region - THREAD).max(axis=-1) < 10).sum())

    assert cycle.covers(130 / RATE_HZ)[0].sewn < 0.01
    assert thread_pixels(130) == 0
    assert thread_pixels(390) > 30


def test_seed_decides_the_noise(cycle: SewingCycle, camera: Camera) -> None:
    same, other = Camera(cycle, RATE_HZ, seed=1), Camera(cycle, RATE_HZ, seed=2)
    np.testing.assert_array_equal(same.render(5).depth, camera.render(5).depth)
    np.testing.assert_array_equal(same.render(5).color, camera.render(5).color)
    assert np.any(other.render(5).depth != camera.render(5).depth)


def test_robot_hides_what_is_below(camera: Camera, cycle: SewingCycle) -> None:
    """At the upper robot's flange, the camera sees a surface that is nearer than the cover."""
    tool = cycle.truth(UPPER, SEWING / RATE_HZ).position
    u, v, depth = pinhole.project(tool)
    frame = camera.render(SEWING)
    seen = frame.depth[int(round(v)), int(round(u))] / 1000.0
    assert 0.0 < depth - seen < 0.2


def measured(depth_m: np.ndarray) -> np.ndarray:
    noise = DepthNoise(depth_m.shape, np.random.default_rng(0))
    return noise.measured(depth_m.astype(np.float32))


def test_depth_has_the_steps_of_a_kinect() -> None:
    depth_mm = measured(np.full((200, 200), 1.85))
    levels = np.unique(depth_mm[depth_mm > 0])
    assert 2 <= levels.size <= 6
    assert np.all(np.diff(levels.astype(int)) >= 9)
    assert np.all(np.diff(levels.astype(int)) <= 11)
    assert abs(depth_mm[depth_mm > 0].mean() - 1850) < 2
    assert 0 < (depth_mm == 0).mean() < 0.002


def test_shadow_lies_beside_near_things() -> None:
    depth = np.full((100, 100), 3.0)
    depth[:, 60:] = 1.5
    hidden = (measured(depth) == 0).mean(axis=0)
    assert (hidden[50:60] == 1).all()
    assert (hidden[:40] < 0.05).all()
    assert (hidden[60:] < 0.05).all()


def test_what_is_out_of_reach_has_a_depth_that_fits() -> None:
    assert measured(np.full((2, 2), np.inf)).min() > 50000


def test_a_second_camera_sees_the_same_cover_from_its_place(cycle: SewingCycle) -> None:
    place = pinhole.position(layout.SECOND_CAMERA_XYZ)
    frame = Camera(cycle, RATE_HZ, seed=2, place=place).render(SEWING)
    points = world_points(frame) + place - pinhole.POSITION
    on_cover = is_leather(frame) & (frame.depth > 0)
    pair = cycle.covers(SEWING / RATE_HZ)[0]
    assert on_cover.sum() > 10000
    assert abs(np.median(points[on_cover, 2]) - COVER_Z) < 0.01
    x_min, x_max, y_min, y_max = layout.COVER_BOX
    x, y = points[on_cover, 0] - pair.x - pair.steering[0], points[on_cover, 1] - pair.y
    assert np.percentile(x, [1, 99]) == pytest.approx([x_min, x_max], abs=0.02)
    assert y.min() == pytest.approx(y_min, abs=0.02)  # the other end is beyond the first camera


@pytest.mark.parametrize("kind", INTRUDERS)
def test_an_intruder_is_seen_where_it_is(kind: str, cycle: SewingCycle, camera: Camera) -> None:
    number = 120  # of the picture: the hand is inside
    before = camera.render(number)
    intruder = INTRUDERS[kind]
    after = Camera(cycle, RATE_HZ, seed=1, intruder=intruder).render(number)
    changed = before.depth != after.depth
    center = intruder.center(number / RATE_HZ)
    u, v, _ = pinhole.project(center).astype(int)
    assert changed[v, u] and (before.color[v, u] != after.color[v, u]).any()
    depth_m = after.depth[changed & (after.depth > 0)] / 1000
    top_m = pinhole.POSITION[2] - center[2] - intruder.size[2] / 2
    assert abs(np.median(depth_m) - top_m) < 0.02
    area = np.prod(intruder.size[:2]) * (pinhole.FOCAL_LENGTH_PX / top_m) ** 2
    assert changed.sum() > 0.8 * area
