# SPDX-License-Identifier: BSD-3-Clause
"""A running cell as drawn by a live page: frames and markers as in RViz."""
from __future__ import annotations

import io
import math
from typing import Any, List, Sequence

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from live_frame_reader import SeenFrame, read_frame
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.nodes.common.markers import (
    STALE_COLOR,
    VectorSample,
    deletion,
    frame_marker,
    text_color,
    text_marker,
    vector_arrow,
)
from process_visualizer.page.live_markers import markers_in
from process_visualizer.page.live_scene import LiveScene, ShownPart, ShownTool
from process_visualizer.robot.arrows import GHOST_COLOR, ArrowStyle
from process_visualizer.robot.kinematics import Placement

TOPIC = '/arm/marker_array'
HALF = math.sqrt(0.5)
GREEN = (0.0, 0.8, 0.1, 1.0)
STYLE = ArrowStyle('v', 'm/s', 3, 1.0, 0.0, 1.0, 0.01, GREEN)
SOURCES = (CurveSource('arm', 'v', 'm/s', (0.0, 0.8, 0.1), Quantity.SPEED, 'pose'),
           CurveSource('arm', 'feed', 'rpm', (1.0, 0.0, 0.0), Quantity.NUMBER, 'feed'))


def packed(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def transform(parent: str, child: str, xyz: Sequence[float] = (0.0, 0.0, 0.0),
              xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> TransformStamped:
    it = TransformStamped()
    it.header.frame_id, it.child_frame_id = parent, child
    it.transform.translation.x, it.transform.translation.y, it.transform.translation.z = xyz
    (it.transform.rotation.x, it.transform.rotation.y, it.transform.rotation.z,
     it.transform.rotation.w) = xyzw
    return it


class Stage:
    """Scene with a robot on a base that is turned by 90 degrees about z."""

    def __init__(self) -> None:
        self.scene = LiveScene('world', [ShownPart('arm', 'arm/link1', 0),
                                         ShownPart('arm', 'arm/base', 1),
                                         ShownPart('arm', 'arm/nowhere', 1)],
                               {'arm': ShownTool('arm/link1', (0.0, 0.0, 1.0))}, ['arm'],
                               SOURCES)
        self.send([transform('world', 'arm/base', (1.0, 0.0, 0.0), (0.0, 0.0, HALF, HALF))],
                  is_static=True)
        self.send([transform('arm/base', '/arm/link1', (2.0, 0.0, 0.5))])
        self.now_s = 0.0

    def send(self, transforms: List[TransformStamped], is_static: bool = False) -> None:
        self.scene.take_transforms(packed(TFMessage(transforms)), is_static)

    def draw(self, *markers: Marker, topic: str = TOPIC) -> None:
        self.scene.take_markers(topic, packed(MarkerArray(list(markers))), self.now_s)

    def frame(self) -> SeenFrame:
        data = self.scene.frame(100.0 + self.now_s, self.now_s)
        return read_frame(self.scene.layout, data)


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_links_are_where_the_newest_transforms_say(stage: Stage) -> None:
    stage.send([transform('arm/base', 'arm/link1', (3.0, 0.0, 0.5))])
    frame = stage.frame()
    position, turn = frame.places['arm/link1']
    assert position == pytest.approx([1.0, 3.0, 0.5])
    assert turn == pytest.approx([0.0, 0.0, HALF, HALF], abs=1e-4)
    assert frame.time_s == 100.0


def test_what_only_static_transforms_place_is_in_the_layout(stage: Stage) -> None:
    frame = stage.frame()
    assert set(frame.places) == {'arm/link1'}
    fixed = [it for it in stage.scene.layout['places'] if 'at' in it]
    assert [it['name'] for it in fixed] == ['arm/base']
    assert fixed[0]['at'] == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, HALF, HALF])
    assert [it['mesh'] for it in stage.scene.layout['parts']] == [0, 1]


def test_a_base_that_is_moved_makes_another_layout(stage: Stage) -> None:
    before = stage.frame().layout
    assert stage.frame().layout == before
    stage.send([transform('world', 'arm/base', (1.5, 0.0, 0.0))], is_static=True)
    frame = stage.frame()
    assert frame.layout == before + 1
    assert frame.places['arm/link1'][0] == pytest.approx([3.5, 0.0, 0.5])


def test_turns_never_jump_to_the_other_sign(stage: Stage) -> None:
    turns = []
    for angle in np.linspace(0.0, 4.0 * math.pi, 60):
        stage.send([transform('world', 'arm/base', (0, 0, 0), (0, 0, 0, 1)),
                    transform('arm/base', 'arm/link1', (0, 0, 0), [
                        0.0, 0.0, math.sin(angle % (2 * math.pi) / 2),
                        math.cos(angle % (2 * math.pi) / 2)])])
        turns.append(stage.frame().places['arm/link1'][1])
    assert (np.einsum('ij,ij->i', turns[1:], turns[:-1]) > 0.9).all()


def test_rings_and_damaged_transforms_are_nowhere(stage: Stage) -> None:
    stage.send([transform('arm/link1', 'arm/base')])
    assert stage.frame().places == {}
    assert stage.scene.layout['parts'] == []
    stage.send([transform('world', 'arm/base', (math.nan, 0.0, 0.0))])
    stage.scene.take_transforms(b'\xff\xff\xff\xff', False)
    assert stage.frame().places == {}


def test_arrows_and_numbers_are_those_of_rviz(stage: Stage) -> None:
    sample = VectorSample((0.0, 0.3, 0.4), 'arm/link1', 0.0, (0.0, 0.0, 0.1))
    stage.draw(vector_arrow('velocity', STYLE, sample, False),
               text_marker('velocity', 'arm/link1', (0.1, 0.0, 0.0), ' \nv 0.500 m/s', 0.06,
                           text_color(GREEN)))
    frame = stage.frame()
    foot, vector, color = frame.arrows['arm', 'velocity']
    assert foot == pytest.approx([0.0, 0.0, 0.1])
    assert vector == pytest.approx([0.0, 0.3, 0.4], abs=1e-6)
    assert color == (0, 204, 26)
    assert frame.texts['arm', 'speed', 'v'] == ((0, 204, 26), 'v 0.500 m/s')


def test_what_is_old_is_gray_as_in_rviz(stage: Stage) -> None:
    sample = VectorSample((0.0, 0.3, 0.4), 'arm/link1', 0.0)
    stage.draw(vector_arrow('velocity', STYLE, sample, True),
               text_marker('velocity', 'arm/link1', (0.1, 0.0, 0.0), 'v no data for 3.0 s', 0.06,
                           text_color(None)))
    frame = stage.frame()
    gray = tuple(round(255 * it) for it in STALE_COLOR[:3])
    assert frame.arrows['arm', 'velocity'][2] == gray
    assert frame.texts['arm', 'speed', 'v'] == (gray, 'v no data for 3.0 s')


def test_markers_do_not_outlive_the_process_that_drew_them(stage: Stage) -> None:
    sample = VectorSample((0.0, 0.3, 0.4), 'arm/link1', 0.0)
    stage.draw(vector_arrow('velocity', STYLE, sample, False),
               text_marker('velocity', 'arm/link1', (0, 0, 0), 'v', 0.06, GREEN))
    stage.now_s = 1.0
    frame = stage.frame()
    assert np.isnan(frame.arrows['arm', 'velocity'][1]).all()
    assert frame.texts['arm', 'speed', 'v'][1] == ''


def test_a_deletion_removes_the_arrow_and_not_its_number(stage: Stage) -> None:
    sample = VectorSample((0.0, 0.3, 0.4), 'arm/link1', 0.0)
    stage.draw(vector_arrow('velocity', STYLE, sample, False),
               text_marker('velocity', 'arm/link1', (0, 0, 0), 'v', 0.06, GREEN))
    stage.draw(deletion('velocity', 0, 'arm/link1'))
    frame = stage.frame()
    assert np.isnan(frame.arrows['arm', 'velocity'][1]).all()
    assert frame.texts['arm', 'speed', 'v'][1] == 'v'


def test_numbers_are_in_the_order_of_the_curves_and_notes_have_a_place(stage: Stage) -> None:
    stage.draw(text_marker('arm', 'arm/base', (0.0, 0.0, 1.0), 'arm: robot_proc has ended', 0.1,
                           (1.0, 0.7, 0.1, 1.0)), topic='/scene_watch/marker_array')
    stage.draw(text_marker('variable/feed', 'arm/link1', (0, 0, 0), 'feed 3 rpm', 0.06, GREEN))
    stage.draw(text_marker('velocity', 'arm/link1', (0, 0, 0), 'v', 0.06, GREEN))
    stage.frame()
    texts = stage.scene.layout['texts']
    assert [(it['device'], it['quantity'], it['label']) for it in texts] == [
        ('arm', 'speed', 'v'), ('arm', 'number', 'feed'), ('arm', 'note', '')]
    assert stage.scene.layout['places'][texts[2]['place']]['name'] == 'arm/base'
    assert texts[2]['foot'] == [0.0, 0.0, 1.0]
    assert texts[1]['foot'] == [0.0, 0.0, 0.0], 'without an arrow it stands by itself'
    assert 'foot' not in texts[0]


def test_numbers_that_a_devices_own_node_draws_belong_to_their_arrows(stage: Stage) -> None:
    stage.draw(text_marker('edge', 'arm/link1', (0, 0, 0), 'edge 263', 0.06, GREEN))
    stage.draw(vector_arrow('edge', STYLE, VectorSample((0.0, 0.3, 0.4), 'arm/link1', 0.0), False))
    frame = stage.frame()
    assert frame.texts['arm', 'number', 'edge'][1] == 'edge 263'
    assert list(frame.arrows) == [('arm', 'edge')]
    assert 'foot' not in stage.scene.layout['texts'][0]


def test_a_marker_in_an_unknown_frame_comes_when_its_frame_does(stage: Stage) -> None:
    stage.draw(text_marker('variable/feed', 'needle', (0, 0, 0), 'feed 3', 0.06, GREEN))
    assert stage.frame().texts == {}
    stage.send([transform('world', 'needle')], is_static=True)
    assert stage.frame().texts['arm', 'number', 'feed'][1] == 'feed 3'


def test_the_reference_stands_beside_the_robot_while_it_is_drawn(stage: Stage) -> None:
    shape = Placement((0.0, 0.0, 0.2))
    stage.scene = LiveScene('world', [ShownPart('arm', 'arm/link1', 7)], {}, ['arm'], SOURCES,
                            {'arm': [('arm/link1', shape), ('arm/link1', Placement())]})
    stage.send([transform('world', 'arm/base', (1.0, 0.0, 0.0))], is_static=True)
    ghost = [frame_marker('arm/ghost', number, 'arm/base', GHOST_COLOR) for number in (0, 1, 2)]
    for it in ghost:
        it.type, it.scale.x = Marker.CUBE, 1.0
        it.pose.position.x, it.pose.position.z = 5.0, 0.2
    stage.draw(*ghost, text_marker('arm/deviation', 'arm/base', (0, 0, 0), 'Δ 3.2 mm', 0.06,
                                   GREEN), topic='/ghost/marker_array')
    frame = stage.frame()
    assert [it['mesh'] for it in stage.scene.layout['ghost']] == [7]
    assert frame.places['arm/ghost arm/link1'][0] == pytest.approx([6.0, 0.0, 0.0])
    assert frame.texts['arm', 'deviation', 'Δ'][1] == 'Δ 3.2 mm'
    stage.now_s = 1.0
    assert np.isnan(stage.frame().places['arm/ghost arm/link1'][0]).all()
    clear = Marker(action=Marker.DELETEALL)
    stage.draw(clear, topic='/ghost/marker_array')
    assert stage.frame().places == {}


def test_long_texts_end_at_a_whole_letter(stage: Stage) -> None:
    stage.draw(text_marker('velocity', 'arm/link1', (0, 0, 0), 'x' + 200 * 'µ', 0.06, GREEN))
    assert stage.frame().texts['arm', 'speed', 'v'][1] == 'x' + 127 * 'µ'


def test_the_number_of_markers_is_limited(stage: Stage) -> None:
    for number in range(300):
        stage.draw(text_marker(f'variable/{number}', 'arm/link1', (0, 0, 0), 'v', 0.06, GREEN))
    assert len(stage.frame().texts) == 200


@given(st.binary(max_size=300))
def test_any_bytes_are_taken_as_markers(data: bytes) -> None:
    marker = text_marker('velocity', 'arm/link1', (0, 0, 0), 'v', 0.06, GREEN)
    whole = packed(MarkerArray([marker, marker]))
    markers_in(data)
    assert len(markers_in(whole[:len(whole) // 2] + data)) <= 2
