# SPDX-License-Identifier: BSD-3-Clause
"""Clouds on a page: positions and colors of the points, and the omitted ones."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import genpy
import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import TransformStamped
from page_reader import PageReader
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Float32, Header
from tf2_msgs.msg import TFMessage

from process_visualizer.commands.command_line import main
from process_visualizer.msg import DetectedObject, DetectedObjects
from process_visualizer.page.clouds import (
    MAX_POINTS,
    Points,
    points_of_cloud,
    points_of_images,
    thinned,
)

CELL = '''<visualizer>
  <device type="depth_sensor" name="camera"><base frame="camera" xyz="0 0 2"/>{}
    <roi frame="table" xyz="0 0 0.1" size="1 1 0.4"/></device>
  <device type="other" name="table"><base frame="table" xyz="1 0 0.5"/>
    <variable topic="/feed" frame="table" label="feed" axis="0 0 1"/></device>
</visualizer>'''
CLOUD = '<topic ns="/" name="points" type="pointcloud"/>'
IMAGES = ''.join(f'<topic ns="/" name="{name}" type="{name}"/>' for name in (
    'depth_image', 'color_image', 'camera_info'))
BEGIN_S = 100.0


def cloud(points: List[List[float]], colors: List[int], is_bigendian: bool = False) -> PointCloud2:
    order = '>' if is_bigendian else '<'
    rows = np.zeros(len(points), np.dtype([(it, order + 'f4') for it in 'xyz'] + [
        ('rgb', order + 'u4'), ('tag', 'u1')]))
    for row, point in enumerate(points):
        rows[row] = (*point, colors[row], 7)
    fields = [PointField(name, 4 * row, PointField.FLOAT32, 1)
              for row, name in enumerate(('x', 'y', 'z', 'rgb'))]
    return PointCloud2(header=Header(frame_id='optical'), height=1, width=len(points),
                       fields=fields, is_bigendian=is_bigendian, point_step=17,
                       row_step=17 * len(points), data=rows.tobytes())


def optical() -> TransformStamped:
    """A camera that looks down: its z axis points to the floor."""
    found = TransformStamped(child_frame_id='optical')
    found.header.frame_id = 'camera'
    found.transform.rotation.x = 1.0
    return found


def shared(folder: Path, topics: str, messages: Dict[str, Any], *words: str, cell: str = CELL,
           frames_topic: str = '/tf_static',
           extra: Optional[Callable[[rosbag.Bag], None]] = None) -> Dict[str, Any]:
    config, bag, page = (folder / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(cell.format(topics), encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        file.write(frames_topic, TFMessage([optical()]), genpy.Time.from_sec(BEGIN_S))
        for number in range(30):
            stamp = genpy.Time.from_sec(BEGIN_S + 0.1 * number)
            file.write('/feed', Float32(0.1), stamp)
            for topic, message in messages.items():
                file.write(topic, message, stamp)
        if extra is not None:
            extra(file)
    assert main(['share', str(bag), '--config', str(config), *words, '-o', str(page)]) == 0
    reader = PageReader(page.read_text(encoding='utf-8'))
    run: Dict[str, Any] = reader.data['runs'][0]
    run['objects']['times'] = reader.column(run['objects']['times'])
    for it in run['clouds']:
        it['times'] = reader.column(it['times'])
        it['clouds'] = [(reader.column(row['positions']), reader.column(row['colors'], 3))
                        for row in it['clouds']]
    return run


@pytest.mark.parametrize('is_bigendian', [False, True])
def test_points_of_a_cloud_are_cropped_and_colored(tmp_path: Path, is_bigendian: bool) -> None:
    inside, beside, unmeasured = [1.2, -0.3, 1.4], [2.2, 0.0, 1.4], [np.nan] * 3
    run = shared(tmp_path, CLOUD, {'/points': cloud(
        [beside, inside, unmeasured], [0, 0x102030, 0], is_bigendian)}, '--clouds')
    found, = run['clouds']
    assert found['device'] == 'camera'
    assert np.diff(found['times']).min() >= 0.19  # five per second
    for positions, colors in found['clouds']:
        assert positions == pytest.approx(np.array([[1.2, 0.3, 0.6]]), abs=1e-5)
        assert colors.tolist() == [[0x10, 0x20, 0x30]]


@pytest.mark.parametrize(('encoding', 'kind', 'unit'), [
    ('16UC1', '<u2', 1000), ('32FC1', '<f4', 1)])
def test_points_of_images(tmp_path: Path, encoding: str, kind: str, unit: int) -> None:
    depth = np.zeros((4, 6), kind)
    depth[1, 4] = 1.4 * unit
    color = np.zeros((8, 12, 3), np.uint8)
    color[2:4, 8:10] = (30, 20, 10)
    run = shared(tmp_path, IMAGES, {
        '/depth_image': Image(header=Header(frame_id='optical'), height=4, width=6,
                              encoding=encoding, step=6 * depth.itemsize, data=depth.tobytes()),
        '/color_image': Image(height=8, width=12, encoding='bgr8', step=36, data=color.tobytes()),
        '/camera_info': CameraInfo(K=[2.0, 0.0, 2.5, 0.0, 2.0, 1.5, 0.0, 0.0, 1.0])}, '--clouds')
    positions, colors = run['clouds'][0]['clouds'][0]
    assert positions == pytest.approx(np.array([[1.05, 0.35, 0.6]]), abs=1e-5)
    assert colors.tolist() == [[10, 20, 30]]


COMPUTED = '''<visualizer>
  <device type="depth_sensor" name="camera"><base frame="camera" xyz="0 0 2"/>
    <topic ns="color" name="camera_info"/><topic ns="depth" name="camera_info"/>
    <topic ns="color" name="image"/><topic ns="depth" name="image"/>
    <topic ns="/camera" name="roi_points" type="pointcloud" record="False"/>
    <node pkg="own" type="crop" name="crop">{}</node></device>
  <device type="other" name="table"><base frame="table" xyz="1 0 0.5"/>
    <variable topic="/feed" frame="table" label="feed" axis="0 0 1"/></device>
</visualizer>'''


@pytest.mark.parametrize('box, inside, is_told', [
    ('<rosparam>{center: [0, 0, 0.1], size: [1, 1, 0.4], frame: /table}</rosparam>', 1, False),
    ('<rosparam param="center">[1, 0, 0.6]</rosparam><rosparam param="size">[1, 1, 0.4]</rosparam>',
     1, False),
    ('<param name="center" value="here"/>', 2, True), ('', 2, True)])
@pytest.mark.parametrize('color_frame', ['optical', 'other_camera'])
def test_a_cloud_that_was_computed_is_that_of_the_recorded_images(
        tmp_path: Path, color_frame: str, box: str, inside: int, is_told: bool) -> None:
    """Also if it is unknown which image is which, and if the box is a node parameter.

    A color image of another camera shows other things at the same pixels.
    """
    depth = np.zeros((4, 6), '<u2')
    depth[1, 4] = 1400
    depth[0, 0] = 1900
    color = np.full((4, 6, 3), 40, np.uint8)
    inner = CameraInfo(header=Header(frame_id='optical'),
                       K=[2.0, 0.0, 2.5, 0.0, 2.0, 1.5, 0.0, 0.0, 1.0])
    run = shared(tmp_path, box, {
        '/color/image': Image(header=Header(frame_id=color_frame), height=4, width=6,
                              encoding='rgb8', step=18, data=color.tobytes()),
        '/color/camera_info': CameraInfo(header=Header(frame_id=color_frame),
                                         K=[9.0, 0.0, 9.5, 0.0, 9.0, 9.5, 0.0, 0.0, 1.0]),
        '/depth/image': Image(header=Header(frame_id='optical'), height=4, width=6,
                              encoding='16UC1', step=12, data=depth.tobytes()),
        '/depth/camera_info': inner}, '--clouds', cell=COMPUTED,
        frames_topic='/process_visualizer/static_frames')
    positions, colors = run['clouds'][0]['clouds'][0]
    assert len(positions) == inside
    assert (colors == (40 if color_frame == 'optical' else 150)).all()
    assert np.abs(positions - (1.05, 0.35, 0.6)).max(axis=1).min() < 1e-5
    assert any('the cloud of camera is all that the camera saw' in it
               for it in run['notes']) == is_told


def test_clouds_are_there_only_where_they_are_asked_for(tmp_path: Path) -> None:
    run = shared(tmp_path, CLOUD, {'/points': cloud([[1.2, -0.3, 1.4]], [0])})
    assert run['clouds'] == []


def test_a_cloud_that_cannot_be_placed_says_why(tmp_path: Path) -> None:
    lost = cloud([[1.2, -0.3, 1.4]], [0])
    lost.header.frame_id = 'nowhere'
    run = shared(tmp_path, CLOUD, {'/points': lost}, '--clouds')
    assert 'the cloud of camera is missing: it is not known where its frame nowhere is' in \
        run['notes']
    (tmp_path / 'b').mkdir()
    run = shared(tmp_path / 'b', CLOUD, {}, '--clouds')
    assert 'the cloud of camera is missing: it was not recorded' in run['notes']


def test_a_large_cloud_is_thinned_evenly() -> None:
    positions = np.random.default_rng(1).uniform(0.0, 1.0, (60_000, 3))
    slim = thinned(Points('', positions, np.zeros((60_000, 3), np.uint8)))
    assert 0.3 * MAX_POINTS < len(slim.positions) == len(slim.colors) <= MAX_POINTS
    assert np.ptp(slim.positions, axis=0) == pytest.approx(np.ones(3), abs=0.1)


@pytest.mark.parametrize('change', [
    {'point_step': 0}, {'data': b''}, {'fields': []}, {'width': 0},
    {'fields': [PointField('x', 4000, 7, 1), PointField('y', 0, 7, 1), PointField('z', 0, 7, 1)]}])
def test_a_cloud_without_points_is_none(change: Dict[str, Any]) -> None:
    it = cloud([[1.0, 2.0, 3.0]], [0])
    for name, value in change.items():
        setattr(it, name, value)
    assert points_of_cloud(it) is None


def depth_image(**changes: Any) -> Image:
    it = Image(header=Header(frame_id='/optical'), height=4, width=6, encoding='16UC1', step=12,
               data=np.full((4, 6), 1400, '<u2').tobytes())
    for name, value in changes.items():
        setattr(it, name, value)
    return it


INFO = CameraInfo(K=[2.0, 0.0, 2.5, 0.0, 2.0, 1.5, 0.0, 0.0, 1.0])


def test_a_pixel_is_where_the_camera_saw_it() -> None:
    found = points_of_images(depth_image(), None, INFO)
    assert found is not None and found.frame == 'optical' and len(found.positions) == 24
    column, row = np.meshgrid(np.arange(6), np.arange(4))
    pixels = np.stack(((column - 2.5) * 0.7, (row - 1.5) * 0.7, np.full((4, 6), 1.4)), axis=2)
    assert found.positions == pytest.approx(pixels.reshape(-1, 3))
    swapped = depth_image(is_bigendian=1, data=np.full((4, 6), 1400, '>u2').tobytes())
    other = points_of_images(swapped, None, INFO)
    assert other is not None and np.array_equal(other.positions, found.positions)


@pytest.mark.parametrize('change', [
    {'encoding': 'rgb8'}, {'step': 11}, {'data': b'short'}, {'width': 0, 'step': 0}])
def test_a_depth_image_without_points_is_none(change: Dict[str, Any]) -> None:
    assert points_of_images(depth_image(**change), None, INFO) is None
    assert points_of_images(depth_image(), None, CameraInfo()) is None


@pytest.mark.parametrize('color', [
    Image(height=4, width=6, encoding='bayer_rggb8', step=6, data=bytes(24)),
    Image(height=4, width=6, encoding='rgb8', step=18, data=b'short')])
def test_a_color_image_that_cannot_be_read_leaves_points_gray(color: Image) -> None:
    found = points_of_images(depth_image(), color, INFO)
    assert found is not None and found.colors.tolist() == [[150, 150, 150]] * 24


def test_a_color_image_of_another_moment_is_not_used(tmp_path: Path) -> None:
    red = np.full((4, 6, 3), (0, 0, 255), np.uint8).tobytes()
    run = shared(tmp_path, IMAGES, {'/depth_image': depth_image(), '/camera_info': INFO},
                 '--clouds', extra=lambda file: file.write('/color_image', Image(
                     height=4, width=6, encoding='bgr8', step=18, data=red),
                     genpy.Time.from_sec(BEGIN_S)))
    colors = [set(map(tuple, it[1].tolist())) for it in run['clouds'][0]['clouds']]
    assert colors[0] == {(255, 0, 0)} and colors[-1] == {(150, 150, 150)}


def test_a_box_whose_frame_is_unknown_says_so(tmp_path: Path) -> None:
    run = shared(tmp_path, CLOUD, {'/points': cloud([[1.2, -0.3, 1.4]], [0])}, '--clouds',
                 cell=CELL.replace('roi frame="table"', 'roi frame="belt"'))
    assert 'the cloud of camera is missing: it is not known where the frame belt of its box is' \
        in run['notes']


def test_a_cloud_of_another_version_of_the_type_is_not_read(tmp_path: Path) -> None:
    run = shared(tmp_path, CLOUD, {'/points': Float32(1.0)}, '--clouds')
    assert 'the cloud of camera is missing: it was not recorded' in run['notes']


def test_recorded_objects_are_shown_until_the_sensor_is_silent(tmp_path: Path) -> None:
    def record(bag: rosbag.Bag) -> None:
        for time_s, x in ((0.5, 0.3), (0.9, 0.4)):
            message = DetectedObjects(objects=[DetectedObject(number=1, is_seen=True)])
            message.header.frame_id = 'world'
            found = message.objects[0]
            found.pose.position.x, found.pose.orientation.w = x, 1.0
            found.size.x = found.size.y = found.size.z = 0.2
            bag.write('/camera/objects', message, genpy.Time.from_sec(BEGIN_S + time_s))
    run = shared(tmp_path, CLOUD, {}, extra=record)
    assert [[it['at'][0] for it in row] for row in run['objects']['rows']] == [[0.3], [0.4], []]
    times_s = run['objects']['times']
    assert times_s == pytest.approx([0.5, 0.9, 1.7], abs=0.1 + 1e-9)
    assert run['objects']['rows'][0][0]['text'] == 'object 1: 20 x 20 x 20 cm'
    assert shared(tmp_path, CLOUD, {})['objects']['rows'] == []
