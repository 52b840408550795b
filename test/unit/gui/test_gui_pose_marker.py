# SPDX-License-Identifier: BSD-3-Clause
"""The marker for dragging a frame: communication with the marker server."""
from __future__ import annotations

import math
from typing import Any, List, Tuple

import pytest
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from marker_server import MarkerServer
from visualization_msgs.msg import InteractiveMarkerFeedback

from process_visualizer.cell.model import Pose
from process_visualizer.gui.ros.rviz_markers import PoseMarker

TURNED = math.sqrt(0.5)


class Stage:
    """Marker of a frame, its server, and the dragged poses."""

    def __init__(self) -> None:
        self.dragged: List[Tuple[str, Pose]] = []
        self.topics: List[str] = []
        self.server = MarkerServer()
        self.marker = PoseMarker(lambda frame, pose: self.dragged.append((frame, pose)),
                                 '/calibration', self._make_server)

    def feed_back(self, event: int, frame: str = 'camera_link') -> None:
        """Send RViz's feedback for a mouse event."""
        self.server.feed_back(event, frame, PoseMessage(
            Point(0.5, 0.0, -1.0), Quaternion(0.0, 0.0, TURNED, TURNED)))

    def _make_server(self, topic: str) -> Any:
        self.topics.append(topic)
        return self.server


@pytest.fixture
def stage() -> Stage:
    found = Stage()
    found.marker.show('world', 'camera_link', Pose((1.0, 2.0, 3.0), (math.pi / 2, 0.0, 0.0)))
    return found


def test_topics_are_advertised_with_the_first_marker() -> None:
    stage = Stage()
    stage.marker.hide()
    stage.marker.move(Pose())
    assert stage.topics == []
    for frame in ('one', 'other'):
        stage.marker.show('world', frame, Pose())
    assert stage.topics == ['/calibration']


def test_a_marker_has_six_degrees_of_freedom(stage: Stage) -> None:
    (marker,) = stage.server.shown.values()
    assert (marker.header.frame_id, marker.description) == ('world', 'camera_link')
    assert marker.pose.position == Point(1.0, 2.0, 3.0)
    assert marker.pose.orientation.z == pytest.approx(TURNED)
    controls = {(control.interaction_mode, tuple(round(part, 3) for part in (
        control.orientation.x, control.orientation.y, control.orientation.z)))
        for control in marker.controls}
    assert len(controls) == 6


def test_dragging_tells_the_pose(stage: Stage) -> None:
    stage.feed_back(InteractiveMarkerFeedback.POSE_UPDATE)
    (frame, pose), = stage.dragged
    assert (frame, pose.xyz) == ('camera_link', (0.5, 0.0, -1.0))
    assert pose.ypr == pytest.approx((math.pi / 2, 0.0, 0.0))


@pytest.mark.parametrize('event', [
    InteractiveMarkerFeedback.MOUSE_DOWN, InteractiveMarkerFeedback.MOUSE_UP,
    InteractiveMarkerFeedback.BUTTON_CLICK, InteractiveMarkerFeedback.KEEP_ALIVE])
def test_only_dragging_does(stage: Stage, event: int) -> None:
    stage.feed_back(event)
    assert stage.dragged == []


def test_it_follows_what_is_set_and_says_nothing_then(stage: Stage) -> None:
    stage.marker.move(Pose((0.0, 0.0, 7.0), (0.0, 0.0, math.pi)))
    pose = stage.server.shown['camera_link'].pose
    assert pose.position == Point(0.0, 0.0, 7.0)
    assert abs(pose.orientation.x) == pytest.approx(1.0)
    assert stage.dragged == []


def test_another_frame_takes_its_place(stage: Stage) -> None:
    stage.marker.show('world', 'base', Pose())
    assert list(stage.server.shown) == ['base']
    stage.feed_back(InteractiveMarkerFeedback.POSE_UPDATE)  # sent earlier, still on its way
    stage.feed_back(InteractiveMarkerFeedback.POSE_UPDATE, 'base')
    assert [frame for frame, _ in stage.dragged] == ['base']


def test_a_marker_that_is_hidden_is_gone(stage: Stage) -> None:
    stage.marker.hide()
    assert stage.server.shown == {}
    assert stage.marker.frame == ''
    stage.marker.move(Pose())
    assert stage.server.shown == {}
