# SPDX-License-Identifier: BSD-3-Clause
"""The depth processor: a new header on serialized clouds, the age of the last one, bad input."""
from __future__ import annotations

from io import BytesIO
from typing import List, Sequence

import pytest
import rospy
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Image, PointCloud2, PointField
from simulated_node import SimulatedNode

from process_visualizer.msg import PlayerState
from process_visualizer.nodes.depth_processor import (
    SILENT_AFTER_S,
    DepthProcessor,
    SerializedPointCloud2,
    restamp,
)
from process_visualizer.ros_names import PLAYER_STATE_TOPIC

UINT32 = st.integers(0, 2**32 - 1)
FRAME_ID = st.text(alphabet='abc_/æ', max_size=20)


def serialize(message: PointCloud2) -> bytes:
    """Return the serialized message."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def make_cloud(frame_id: str, data: bytes = b'') -> PointCloud2:
    """Return a cloud with one field."""
    cloud = PointCloud2(fields=[PointField(name='x', datatype=PointField.FLOAT32)], data=data)
    cloud.header.frame_id = frame_id
    return cloud


@given(seq=UINT32, secs=UINT32, nsecs=st.integers(0, 10**9 - 1), frame_id=FRAME_ID,
       data=st.binary(max_size=100))
def test_changes_only_stamp_and_slashes(seq: int, secs: int, nsecs: int, frame_id: str,
                                        data: bytes) -> None:
    cloud = make_cloud(frame_id, data)
    cloud.header.seq = seq
    cloud.header.stamp = rospy.Time(1, 2)
    restamped = b''.join(restamp(serialize(cloud), lambda _: rospy.Time(secs, nsecs)))
    cloud.header.stamp = rospy.Time(secs, nsecs)
    cloud.header.frame_id = frame_id.lstrip('/')
    assert restamped == serialize(cloud)


def test_is_told_the_stamp() -> None:
    cloud = make_cloud('camera')
    cloud.header.stamp = rospy.Time(12, 34)
    assert b''.join(restamp(serialize(cloud), lambda stamp: stamp)) == serialize(cloud)


def test_the_rest_is_not_copied() -> None:
    message = serialize(make_cloud('camera', b'data'))
    _, rest = restamp(message, lambda stamp: stamp)
    assert rest.obj is message


@pytest.mark.parametrize('size', [0, 15, 16, 21])
def test_rejects_what_is_shorter_than_its_header(size: int) -> None:
    with pytest.raises(ValueError, match=f'^{size} bytes'):
        restamp(serialize(make_cloud('camera'))[:size], lambda stamp: stamp)


def test_serializes_its_parts() -> None:
    buffer = BytesIO()
    SerializedPointCloud2(b'abc', memoryview(b'def')).serialize(buffer)
    assert buffer.getvalue() == b'abcdef'


def test_passes_for_a_point_cloud() -> None:
    for attribute in ('_type', '_md5sum', '_full_text'):
        assert getattr(SerializedPointCloud2, attribute) == getattr(PointCloud2, attribute)


def depth_proc(topic: str = '/kinect/roi_points') -> SimulatedNode:
    """Return the node of a device kinect."""
    node = SimulatedNode('/kinect/depth_proc', {'/kinect/depth_proc/topic': topic})
    DepthProcessor(node, 'kinect')
    return node


def clouds(node: SimulatedNode) -> List[PointCloud2]:
    """Return the published clouds."""
    return [PointCloud2().deserialize(it._buff) for it in node.sent('points')]


def stamped(stamp: rospy.Time) -> PointCloud2:
    cloud = make_cloud('/camera', b'data')
    cloud.header.stamp = stamp
    return cloud


def test_old_clouds_are_moved_to_the_present_and_are_else_as_they_were() -> None:
    node = depth_proc()
    cloud = stamped(rospy.Time(5))
    node.send('/kinect/roi_points', cloud)
    found, = clouds(node)
    assert (found.header.stamp, found.header.frame_id) == (node.now(), 'camera')
    found.header = cloud.header
    assert found == cloud


def test_stamps_of_today_are_kept() -> None:
    node = depth_proc()
    sent = []
    for _ in range(3):
        sent.append(node.now())
        node.advance(0.04)
        node.send('/kinect/roi_points', stamped(sent[-1]))
    assert [it.header.stamp for it in clouds(node)] == sent


def test_its_own_topic_is_the_input_if_no_other_is_named() -> None:
    node = SimulatedNode('/kinect/depth_proc')
    DepthProcessor(node, 'kinect')
    node.send('/kinect/depth_proc/input', stamped(node.now()))
    assert len(clouds(node)) == 1


@pytest.mark.parametrize('topic', [5, ['/a'], '', '/' + 'a' * 300])
def test_what_is_no_topic_is_refused_in_a_sentence(topic: object) -> None:
    node = SimulatedNode('/kinect/depth_proc')
    node.set_param('~topic', topic)
    with pytest.raises(ValueError, match=r'a topic is expected|is not a name|at most 255'):
        DepthProcessor(node, 'kinect')


def test_the_age_of_the_last_cloud_grows_but_not_while_playback_is_paused() -> None:
    node = depth_proc()
    node.advance(1.05)
    assert node.sent('points_age') == []
    play(node, 0.1, is_paused=False)
    node.send('/kinect/roi_points', stamped(node.now()))
    play(node, 2.0, is_paused=False)
    assert [it.data for it in node.sent('points_age')][-1] == pytest.approx(2.0, abs=0.25)
    assert len(node.sent('points_age')) == 10
    play(node, 4.0)
    assert [it.data for it in node.sent('points_age')][-1] == pytest.approx(2.0, abs=0.25)


def test_what_rviz_has_of_an_earlier_process_is_cleared_until_the_first_cloud() -> None:
    node = SimulatedNode('/kinect/depth_proc', {'/kinect/depth_proc/topic': '/kinect/roi_points',
                                                '/kinect/depth_proc/frame': '/world'})
    DepthProcessor(node, 'kinect')
    greeting = node.greetings['/kinect/points']
    written = BytesIO()
    greeting().serialize(written)
    empty = PointCloud2().deserialize(written.getvalue())
    assert (empty.header.frame_id, empty.header.stamp) == ('world', node.now())
    assert (empty.width, empty.data) == (0, b'')
    # without them RViz would not color later clouds
    assert [it.name for it in empty.fields] == ['x', 'y', 'z', 'rgb', 'intensity']
    node.send('/kinect/roi_points', stamped(node.now()))
    assert greeting() is None


def test_a_cloud_of_another_recording_or_of_the_live_cell_is_cleared() -> None:
    node = SimulatedNode('/kinect/depth_proc', {'/kinect/depth_proc/topic': '/kinect/roi_points',
                                                '/kinect/depth_proc/frame': '/world'})
    DepthProcessor(node, 'kinect')
    node.send('/kinect/roi_points', stamped(node.now()))
    node.advance(0.5)
    play(node, 0.5, files=['one.bag'])
    assert [it.data for it in clouds(node)] == [b'data', b'']
    node.send('/kinect/roi_points', stamped(node.now()))
    play(node, 0.5, files=['one.bag'])  # the same player, paused elsewhere
    assert clouds(node)[-1].data == b'data'
    play(node, 0.5, files=['another.bag'])  # at once, as on a fast computer
    assert [it.data for it in clouds(node)] == [b'data', b'', b'data', b'']
    ages = len(node.sent('points_age'))
    play(node, 1.0, files=['another.bag'])
    assert len(node.sent('points_age')) == ages  # there is no cloud


def test_without_a_frame_nothing_is_cleared() -> None:
    assert depth_proc().greetings['/kinect/points']() is None


def play(node: SimulatedNode, duration_s: float, is_paused: bool = True,
         files: Sequence[str] = ()) -> None:
    """Let a player send for some time that it plays, or is paused, from now on."""
    since = node.now()
    for _ in range(round(10 * duration_s)):
        node.send(PLAYER_STATE_TOPIC, PlayerState(stamp=node.now(), rate=1.0, paused=is_paused,
                                                  since=since, files=list(files)))
        node.advance(0.1)


def test_a_cloud_that_is_left_from_the_live_cell_grows_old_in_paused_playback() -> None:
    node = depth_proc()
    node.send('/kinect/roi_points', stamped(node.now()))
    node.advance(1.0)
    play(node, 4.0)
    assert node.sent('points_age')[-1].data == pytest.approx(5.0, abs=0.25)
    node.send('/kinect/roi_points', stamped(node.now()))  # of the recording
    play(node, 4.0)
    assert node.sent('points_age')[-1].data == pytest.approx(0.0, abs=0.25)
    node.advance(10.0)  # live again: first no message, then one
    assert node.sent('points_age')[-1].data == pytest.approx(9.0, abs=0.25)
    node.send('/kinect/roi_points', stamped(node.now()))
    node.advance(2.0)
    assert node.sent('points_age')[-1].data == pytest.approx(2.0, abs=0.25)
    play(node, 3.0)
    assert node.sent('points_age')[-1].data == pytest.approx(5.0, abs=0.25)


def test_a_wrong_type_is_named_with_its_publisher_and_the_node_lives() -> None:
    node = depth_proc('cloud')
    node.send('cloud', Image())
    assert node.log == [('error', 'kinect: /kinect/cloud carries sensor_msgs/Image (published by '
                                  '/driver), but the clouds must be sensor_msgs/PointCloud2')]
    assert clouds(node) == []
    node.send('cloud', stamped(node.now()))
    assert len(clouds(node)) == 1


def test_a_cloud_without_all_of_its_header_is_named() -> None:
    node = depth_proc()
    broken = SerializedPointCloud2(b'short')
    node.send('/kinect/roi_points', broken)
    assert clouds(node) == []
    (level, text), = node.log
    assert level == 'error' and text.startswith('kinect: /kinect/roi_points: 5 bytes are not')


@pytest.mark.parametrize('is_silent', [True, False])
def test_silence_is_told_once(is_silent: bool) -> None:
    node = depth_proc()
    if not is_silent:
        node.send('/kinect/roi_points', stamped(node.now()))
    node.advance(SILENT_AFTER_S - 0.1)
    assert node.log == []
    node.advance(3 * SILENT_AFTER_S)
    assert node.log == is_silent * [
        ('warn', 'kinect: No cloud has been received on /kinect/roi_points yet')]
