# SPDX-License-Identifier: BSD-3-Clause
"""Current objects of a sensor as expected boxes: their poses, and the omitted ones."""
from __future__ import annotations

import math
from typing import Any, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import RegionOfInterest, SoughtObjects
from process_visualizer.health.device_state import Level
from process_visualizer.health.expected_objects import MARGIN_M, Expectation, expectation
from process_visualizer.health.near_objects import SeenObject, seen_objects
from process_visualizer.msg import DetectedObject, DetectedObjects

HERE = Location('cell.xml', 7)
WIDE = 'needs a box that is so wide that it would hide other things; write boxes into the file, ' \
       'each in a frame along which it is narrow'


def seen(number: int = 1, **other: Any) -> SeenObject:
    return SeenObject(number, 'arm/hand', 0.31, (0.4, 0.2, 0.1), Level.WARNING,
                      (1.0, 2.0, 0.5))._replace(**other)


def sought(*expected: RegionOfInterest) -> SoughtObjects:
    return SoughtObjects(0.5, 0.2, 0.03, 0.5, None, None, expected, HERE)


def look(*objects: SeenObject, expected: Tuple[RegionOfInterest, ...] = ()) -> Expectation:
    return expectation([objects], sought(*expected), 'world')


def test_a_box_is_the_object_with_a_margin() -> None:
    (box,) = look(seen()).boxes
    assert (box.frame, box.location) == ('world', HERE)
    assert box.center == pytest.approx((1.0, 2.0, 0.5))
    assert box.size == pytest.approx((0.46, 0.26, 0.16))


@pytest.mark.parametrize('yaw_rad, size', [
    (math.pi / 2, (0.26, 0.46, 0.16)), (-math.pi / 2, (0.26, 0.46, 0.16)),
    (math.pi / 4, (0.486, 0.486, 0.16))])
def test_a_box_holds_an_object_that_is_turned(yaw_rad: float,
                                              size: Tuple[float, float, float]) -> None:
    (box,) = look(seen(yaw_rad=yaw_rad)).boxes
    assert box.size == pytest.approx(size)


coordinates = st.floats(-20.0, 20.0)
lengths = st.floats(0.0, 1.05)  # less than 1.5 in any direction


@given(st.tuples(coordinates, coordinates, coordinates), st.tuples(lengths, lengths, lengths),
       st.floats(-math.pi, math.pi))
def test_every_corner_is_inside_by_the_margin_and_less_than_two_millimeters(
        center: Tuple[float, float, float], size: Tuple[float, float, float],
        yaw_rad: float) -> None:
    (box,) = look(seen(center_m=center, size_m=size, yaw_rad=yaw_rad)).boxes
    along, across = (math.cos(yaw_rad), math.sin(yaw_rad)), (-math.sin(yaw_rad), math.cos(yaw_rad))
    corners = [tuple(center[axis] + i * along[axis] * size[0] / 2 + j * across[axis] * size[1] / 2
                     for axis in (0, 1)) + (center[2] + k * size[2] / 2,)
               for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    for axis in range(3):
        for sign in (-1, 1):
            side = box.center[axis] + sign * box.size[axis] / 2
            farthest = max(sign * it[axis] for it in corners)
            assert -1e-8 <= sign * side - farthest - MARGIN_M < 0.0011
            assert 1000.0 * side == pytest.approx(round(1000.0 * side), abs=1e-6)


def test_the_box_holds_all_that_was_seen_of_an_object() -> None:
    looks = [[seen(center_m=(1.01, 2.0, 0.5)), seen(2, center_m=(5.0, 0.0, 0.0))],
             [seen(is_seen=False, size_m=(3.0, 3.0, 3.0))],
             [seen()]]
    found = expectation(looks, sought(), 'world')
    assert [it.number for it, _box in found.added] == [1]  # the other one has gone
    assert found.left_out == ()
    assert found.boxes[0].center == pytest.approx((1.005, 2.0, 0.5))
    assert found.boxes[0].size == pytest.approx((0.47, 0.26, 0.16))


@pytest.mark.parametrize('before, now, reason', [
    ({}, {'speed_m_s': 0.06}, 'moves'), ({'speed_m_s': 0.06}, {}, 'moves'),
    ({'center_m': (1.06, 2.0, 0.5)}, {}, 'moves'), ({}, {'is_seen': False}, 'is hidden'),
    ({'is_confirmed': False}, {'is_confirmed': False}, 'is new and not confirmed'),
    ({}, {'size_m': (math.nan, 0.1, 0.1)}, 'has no valid box'),
    ({}, {'center_m': (math.inf, 0.1, 0.1)}, 'has no valid box'),
    ({}, {'size_m': (-0.1, 0.1, 0.1)}, 'has no valid box'),
    ({}, {'size_m': (0.6, 0.4, 1.75)}, 'may be a person; if not, write its box into the file'),
    ({}, {'size_m': (3.0, 2.5, 2.0)}, WIDE),
    ({}, {'size_m': (3.0, 0.1, 2.0), 'yaw_rad': math.pi / 4}, WIDE)])
def test_what_is_left_out_is_named_with_the_reason(before: Any, now: Any, reason: str) -> None:
    found = expectation([[seen(**before)], [seen(**now), seen(2)]], sought(), 'world')
    assert [it.number for it, _box in found.added] == [2]
    assert [(it.number, why) for it, why in found.left_out] == [(1, reason)]


def test_walls_along_the_axes_are_expected() -> None:
    found = look(seen(size_m=(4.0, 0.1, 2.0)),
                 seen(2, size_m=(0.1, 3.0, 2.0), center_m=(3.0, 0.5, 1.0)))
    assert [it.number for it, _box in found.added] == [1, 2]


def test_the_noise_of_a_thing_at_rest_is_no_motion() -> None:
    looks = [[seen(center_m=(1.04, 2.0, 0.5), speed_m_s=0.04)], [seen()]]
    assert len(expectation(looks, sought(), 'world').boxes) == 1


def test_what_is_expected_already_is_not_added_again() -> None:
    (box,) = look(seen()).boxes
    slightly_larger = seen(size_m=(0.42, 0.22, 0.12))
    found = look(slightly_larger, seen(2, center_m=(1.1, 2.0, 0.5)), expected=(box,))
    assert [(it.number, why) for it, why in found.left_out] == [(1, 'is expected already')]
    assert [it.number for it, _box in found.added] == [2]
    elsewhere = RegionOfInterest('table', box.center, box.size, HERE)  # a frame that may move
    assert len(look(seen(), expected=(elsewhere,)).boxes) == 1


def test_nothing_seen() -> None:
    assert expectation([], sought(), 'world') == expectation([[]], sought(), 'world') == ((), ())


def test_the_lines_say_size_and_distance() -> None:
    found = look(seen(), seen(2, link=''), seen(3, is_seen=False))
    assert found.added_lines() == ["object 1: 40 × 20 × 10 cm, 0.31 m from arm's hand",
                                   'object 2: 40 × 20 × 10 cm']
    assert found.left_out_lines() == [
        "object 3 is hidden: 40 × 20 × 10 cm, 0.31 m from arm's hand"]


def test_a_message_has_all_that_is_needed() -> None:
    message = DetectedObject(number=4, is_seen=True, is_confirmed=False)
    message.pose.position.x, message.pose.position.y, message.pose.position.z = 1.0, 2.0, 3.0
    message.pose.orientation.z, message.pose.orientation.w = math.sin(0.25), math.cos(0.25)
    message.velocity.x, message.velocity.y, message.velocity.z = 2.0, 3.0, 6.0
    (found,) = seen_objects(DetectedObjects(objects=[message]))
    assert (found.center_m, found.yaw_rad) == ((1.0, 2.0, 3.0), pytest.approx(0.5))
    assert (found.speed_m_s, found.is_seen, found.is_confirmed) == (pytest.approx(7.0), True, False)
