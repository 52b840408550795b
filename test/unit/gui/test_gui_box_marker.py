# SPDX-License-Identifier: BSD-3-Clause
"""The box that is dragged in RViz: communication with the marker server."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, List, Tuple

import pytest
from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
from marker_server import MarkerServer
from visualization_msgs.msg import InteractiveMarkerFeedback

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.gui.ros.rviz_markers import BoxMarker

BOX = RegionOfInterest('tool', (1.0, 2.0, 3.0), (0.2, 0.4, 0.6), Location('cell.xml', 1))


class Stage:
    """Box of a device, its server, and the dragged values."""

    def __init__(self) -> None:
        self.dragged: List[Tuple[str, RegionOfInterest]] = []
        self.topics: List[Tuple[str, str]] = []
        self.server = MarkerServer()
        self.box = BoxMarker(lambda device, region: self.dragged.append((device, region)),
                             self._make_server)

    def _make_server(self, topic: str, suffix: str) -> Any:
        self.topics.append((topic, suffix))
        return self.server

    def drag(self, handle: str, x_m: float,
             event: int = InteractiveMarkerFeedback.POSE_UPDATE) -> None:
        message = PoseMessage(position=Point(x_m, 2.0, 3.0))
        message.orientation.w = 1.0
        self.server.feed_back(event, f'kinect {handle}', message)

    def x_m(self, handle: str) -> float:
        """The x coordinate of a handle."""
        return float(self.server.shown[f'kinect {handle}'].pose.position.x)


@pytest.fixture
def stage() -> Stage:
    found = Stage()
    found.box.show('kinect', BOX)
    return found


def test_a_box_has_a_handle_in_its_middle_and_on_each_face(stage: Stage) -> None:
    handles = stage.server.shown
    assert {it.header.frame_id for it in handles.values()} == {'tool'}
    assert len(handles) == 7
    assert handles['kinect +x'].pose.position == Point(1.1, 2.0, 3.0)
    assert len(handles['kinect middle'].controls) == 3
    assert len(handles['kinect +x'].controls) == 1


def test_a_face_is_dragged_and_the_other_handles_follow(stage: Stage) -> None:
    stage.drag('+x', 1.3)
    (device, region), = stage.dragged
    assert (device, region.frame) == ('kinect', 'tool')
    assert (*region.center, *region.size) == pytest.approx((1.1, 2.0, 3.0, 0.4, 0.4, 0.6))
    assert (stage.x_m('-x'), stage.x_m('middle'), stage.x_m('+x')) == pytest.approx(
        (0.9, 1.1, 1.3))


def test_only_dragging_does(stage: Stage) -> None:
    stage.drag('middle', 5.0, InteractiveMarkerFeedback.MOUSE_UP)
    assert stage.dragged == []
    assert stage.x_m('middle') == 1.0


def test_it_follows_the_numbers_of_its_device_only(stage: Stage) -> None:
    stage.box.move('another', replace(BOX, center=(7.0, 2.0, 3.0)))
    assert stage.x_m('-x') == pytest.approx(0.9)
    stage.box.move('kinect', replace(BOX, center=(5.0, 2.0, 3.0)))
    assert stage.x_m('-x') == pytest.approx(4.9)
    assert stage.dragged == []


def test_a_box_that_is_hidden_is_gone(stage: Stage) -> None:
    stage.box.hide()
    assert stage.server.shown == {}
    stage.drag('middle', 5.0)  # sent earlier, still on its way
    stage.box.move('kinect', BOX)
    assert (stage.server.shown, stage.dragged) == ({}, [])


def test_another_device_takes_its_place(stage: Stage) -> None:
    stage.box.show('lidar', BOX)
    assert {name.split()[0] for name in stage.server.shown} == {'lidar'}
    stage.drag('middle', 5.0)
    assert stage.dragged == []


def test_its_topics_are_those_of_the_marker_of_a_frame_with_a_name_of_its_own() -> None:
    stage = Stage()
    stage.box.hide()
    stage.box.move('kinect', BOX)
    assert stage.topics == []
    for _ in range(2):
        stage.box.show('kinect', BOX)
    assert stage.topics == [('/process_visualizer/calibration', '/box')]
