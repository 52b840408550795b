# SPDX-License-Identifier: BSD-3-Clause
"""Clouds of depth sensors for a page: cropped as in RViz, thinned, and a few per second."""
from __future__ import annotations

from struct import Struct
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell, Device, RegionOfInterest, TopicFunction, Vector3
from process_visualizer.cell.rosparams import set_values
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import FramePlaces, PageSpan, Place, resampled
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.placements import Placements, constant
from process_visualizer.robot.rotations import matrix_from_quaternion

CLOUDS_HZ = 5.0
MAX_POINTS = 5_000
"""Maximum number of points of a cloud; a larger one is thinned to one point per cube."""
_FINEST_M, _COARSER = 0.008, 1.3
_GRAY = 150
_MAX_COLOR_APART_S = 0.1
"""Maximum time between a depth image and the color image with which it is drawn."""


class Points(NamedTuple):
    """Points (n, 3) [m] in a frame, and their colors (n, 3) red green blue."""

    frame: str
    positions: np.ndarray
    colors: np.ndarray


def cloud_entries(cell: Cell, recording: Recording, places: FramePlaces,
                  packed: Packed, span: PageSpan) -> Tuple[List[Dict[str, Any]], List[str]]:
    """Return the clouds as entries of the page, and notes on missing and uncropped ones."""
    entries, notes = [], []
    for device in cell.devices:
        sent = _sent(device, recording)
        if sent is None:
            continue  # no cloud, or only a joined one
        box = device.roi or (None if sent.are_points else _box_of_a_node(device, cell.frame))
        clouds = []
        problem = 'it was not recorded'
        for time_s, points in _clouds(sent, span):
            moved = _in_cell(points, box, places, time_s)
            if isinstance(moved, str):
                problem = moved
                continue
            slim = thinned(moved)
            clouds.append((time_s, slim))
        if not clouds:
            notes.append(f'the cloud of {device.name} is missing: {problem}')
            continue
        if box is None and not sent.are_points:
            notes.append(f'the cloud of {device.name} is all that the camera saw: the '
                         'configuration has no box for it, or one of a package that is not '
                         'trusted')
        entries.append({
            'device': device.name, 'times': packed.times(np.array([it for it, _ in clouds])),
            'clouds': [{'positions': packed.scaled(it.positions),
                        'colors': packed.plain(it.colors)} for _, it in clouds]})
    return entries, notes


class _Sent(NamedTuple):
    """The messages of a sensor: clouds, or depth images with their camera infos and colors."""

    depths: 'SentMessages'
    infos: 'SentMessages'
    colors: 'SentMessages'
    are_points: bool = False


def _sent(device: Device, recording: Recording) -> Optional[_Sent]:
    """Return the recorded data of a sensor's cloud; None if it has no cloud of its own.

    A cloud computed from images is usually not recorded, but the images are. If the configuration
    does not give the functions of the topics, their contents do; then colors and intrinsics are
    used only if they are in the depth image's frame: others are from another camera.
    """
    def of(topic: Optional[str], message_class: Any) -> SentMessages:
        return SentMessages(recording, topic, message_class)

    def named(function: TopicFunction) -> Optional[str]:
        topic = device.topic_for(function)
        return None if topic is None else topic.name

    if device.has_images:
        return _Sent(of(named(TopicFunction.DEPTH_IMAGE), Image),
                     of(named(TopicFunction.CAMERA_INFO), CameraInfo),
                     of(named(TopicFunction.COLOR_IMAGE), Image))
    cloud = named(TopicFunction.POINTCLOUD)
    if cloud is None:
        return None
    points = of(cloud, PointCloud2)
    if not len(points.times_s):
        images = [of(it.name, Image) for it in device.topics]
        depth = next((it for it in images if it.encoding in _DEPTHS), None)
        infos = [of(it.name, CameraInfo) for it in device.topics]
        if depth is not None:
            beside = depth.topic.rpartition('/')[0]
            alike = [it for it in infos if len(it.times_s) and it.frame == depth.frame]
            return _Sent(depth, min(alike, key=lambda it: it.topic.rpartition('/')[0] != beside,
                                    default=of(None, CameraInfo)),
                         next((it for it in images
                               if it.encoding in _COLORS and it.frame == depth.frame),
                              of(None, Image)))
    return _Sent(points, of(None, CameraInfo), of(None, Image), are_points=True)


def _box_of_a_node(device: Device, frame: str) -> Optional[RegionOfInterest]:
    """Return the box to which a device's node crops, from its parameters center, size, frame."""
    for node in device.nodes:
        given = set_values(node.children)
        center, size = (_vector(given.get(name)) for name in ('/center', '/size'))
        if center is not None and size is not None:
            return RegionOfInterest(str(given.get('/frame', frame)).lstrip('/'), center, size,
                                    node.location)
    return None


def _vector(value: Any) -> Optional[Vector3]:
    """Return a parameter if it consists of three finite numbers."""
    if not isinstance(value, list) or len(value) != 3 or any(
            isinstance(it, bool) or not isinstance(it, (int, float)) for it in value):
        return None
    x, y, z = map(float, value)
    return (x, y, z) if np.isfinite((x, y, z)).all() else None


def _clouds(sent: _Sent, span: PageSpan) -> Iterator[Tuple[float, Points]]:
    """Yield a sample of a device's clouds, with the times [s] at which they were recorded."""
    shown = -1
    for moment_s in np.arange(span.begin_s, span.end_s, 1.0 / CLOUDS_HZ).tolist():
        row = sent.depths.row(moment_s)
        if row < 0 or row == shown:
            continue
        shown, message = row, sent.depths.message(row)
        time_s = float(sent.depths.times_s[row])
        if message is None:
            continue
        if sent.are_points:
            found = points_of_cloud(message)
        else:
            color_row = sent.colors.nearest(time_s)
            near = color_row >= 0 and \
                abs(sent.colors.times_s[color_row] - time_s) <= _MAX_COLOR_APART_S
            info = sent.infos.message(max(sent.infos.row(time_s), 0)) \
                if len(sent.infos.times_s) else None
            found = None if info is None else points_of_images(
                message, sent.colors.message(color_row) if near else None, info)
        if found is not None:
            yield time_s, found


class SentMessages:
    """The messages of a topic, by the times [s] at which they were recorded."""

    def __init__(self, recording: Recording, topic: Optional[str], message_class: Any) -> None:
        """Read a topic (None: no messages); messages with another definition are left out."""
        index = recording.index
        numbers = [] if topic is None else [
            it for it in index.connections_of(topic)
            if index.connections[it].md5sum in ('*', message_class._md5sum)]
        self.topic = topic or ''
        self._recording, self._class = recording, message_class
        self._positions = index.positions_of(tuple(numbers))
        self.times_s = (index.time_ns[self._positions] - recording.begin_ns) / 1e9

    def row(self, time_s: float) -> int:
        """Return the row of the last message at a time; -1 before the first."""
        return int(np.searchsorted(self.times_s, time_s, side='right')) - 1

    def nearest(self, time_s: float) -> int:
        """Return the row of the nearest message; -1 if there is none."""
        return int(np.abs(self.times_s - time_s).argmin()) if len(self.times_s) else -1

    def message(self, row: int) -> Any:
        """Return a message; None if it cannot be read."""
        try:
            return self._class().deserialize(bytes(
                self._recording.message(int(self._positions[row]))))
        except (BagDamaged, genpy.DeserializationError):
            return None  # the recording reports the damage


    @property
    def encoding(self) -> str:
        """The encoding of the first image; '' if there is none."""
        first = self._first()
        return str(first.encoding) if isinstance(first, Image) else ''

    @property
    def frame(self) -> str:
        """The frame of the first message, which has a header; '' if there is none."""
        first = self._first()
        return '' if first is None else str(first.header.frame_id).strip('/')

    def _first(self) -> Any:
        return self.message(0) if len(self.times_s) else None


_FIELD_TYPES = {PointField.INT8: 'i1', PointField.UINT8: 'u1', PointField.INT16: 'i2',
                PointField.UINT16: 'u2', PointField.INT32: 'i4', PointField.UINT32: 'u4',
                PointField.FLOAT32: 'f4', PointField.FLOAT64: 'f8'}


def points_of_cloud(cloud: PointCloud2) -> Optional[Points]:
    """Return the measured points of a cloud; None if it has no x, y and z."""
    order = '>' if cloud.is_bigendian else '<'
    fields = {it.name: it for it in cloud.fields if it.datatype in _FIELD_TYPES
              and it.offset + np.dtype(_FIELD_TYPES[it.datatype]).itemsize <= cloud.point_step}
    count = min(cloud.width * cloud.height,
                len(cloud.data) // cloud.point_step if cloud.point_step else 0)
    if not {'x', 'y', 'z'} <= fields.keys() or not count:
        return None
    rows = np.frombuffer(cloud.data, np.uint8, count * cloud.point_step).reshape(count, -1)

    def column(name: str) -> np.ndarray:
        field = fields[name]
        kind = np.dtype(order + _FIELD_TYPES[field.datatype])
        part = rows[:, field.offset:field.offset + kind.itemsize]
        return np.ascontiguousarray(part).view(kind)[:, 0]
    positions = np.stack([column(it).astype(float) for it in 'xyz'], axis=1)
    colors = np.full((count, 3), _GRAY, np.uint8)
    name = next((it for it in ('rgb', 'rgba') if it in fields), None)
    if name is not None and column(name).itemsize == 4:
        packed = column(name).view(order + 'u4')
        colors = np.stack([packed >> shift & 255 for shift in (16, 8, 0)], 1).astype(np.uint8)
    known = np.isfinite(positions).all(axis=1)
    return Points(cloud.header.frame_id.strip('/'), positions[known], colors[known])


_DEPTHS = {'16UC1': ('u2', 1e-3), 'mono16': ('u2', 1e-3), '32FC1': ('f4', 1.0)}
_COLORS = {'rgb8': (0, 1, 2), 'bgr8': (2, 1, 0)}
"""Types and units [m] of depths, and the positions of red, green and blue, by encoding."""


def points_of_images(depth: Image, color: Optional[Image], info: CameraInfo) -> Optional[Points]:
    """Return the points of a depth image that is registered to the color camera.

    Distortion is not corrected. None if the encoding is neither 16UC1 or mono16 [mm] nor
    32FC1 [m], or if the image or the intrinsics are invalid.
    """
    if depth.encoding not in _DEPTHS or not info.K[0] or not info.K[4]:
        return None
    kind, scale_m = _DEPTHS[depth.encoding]
    type_ = np.dtype(('>' if depth.is_bigendian else '<') + kind)
    pixels = _pixels(depth, type_, 1)
    if pixels is None:
        return None
    distances_m = pixels[:, :, 0].astype(float) * scale_m
    known = np.isfinite(distances_m) & (distances_m > 0.0)
    row, column = np.nonzero(known)
    z = distances_m[known]
    x = (column - info.K[2]) / info.K[0] * z
    y = (row - info.K[5]) / info.K[4] * z
    colors = np.full((len(z), 3), _GRAY, np.uint8)
    order = _COLORS.get('' if color is None else color.encoding)
    painted = None if color is None or order is None else _pixels(color, np.dtype('u1'), 3)
    if painted is not None:
        height, width = painted.shape[:2]
        colors = painted[row * height // depth.height, column * width // depth.width][:, order]
    return Points(depth.header.frame_id.strip('/'), np.stack((x, y, z), axis=1), colors)


def _pixels(image: Image, kind: 'np.dtype[Any]', channels: int) -> Optional[np.ndarray]:
    """Return rows, columns and channels of an image; None if its data is too short."""
    width = image.width * channels * kind.itemsize
    if image.step < width or len(image.data) < image.step * image.height or not width:
        return None
    rows = np.frombuffer(image.data, np.uint8, image.step * image.height)
    return np.ascontiguousarray(rows.reshape(image.height, image.step)[:, :width]).view(
        kind).reshape(image.height, image.width, channels)


def _in_cell(points: Points, roi: Optional[RegionOfInterest], places: FramePlaces,
             time_s: float) -> 'Points | str':
    """Return the points inside the box, in the global frame, or the reason if they are unknown."""
    place = places.find(points.frame)
    if place is None:
        return f'it is not known where its frame {points.frame} is'
    positions = _at(place, time_s).then(_fixed(points.positions)).positions
    if roi is None:
        return Points('', positions, points.colors)
    box = places.find(roi.frame)
    if box is None:
        return f'it is not known where the frame {roi.frame} of its box is'
    inside = _at(box, time_s).inverse().then(_fixed(positions)).positions - np.array(roi.center)
    kept = (np.abs(inside) <= 0.5 * np.array(roi.size)).all(axis=1)
    return Points('', positions[kept], points.colors[kept])


def _at(place: Place, time_s: float) -> Placements:
    """Return the pose of a frame as in tf, which interpolates between messages."""
    return constant(place) if isinstance(place, Placement) else resampled(
        place._replace(is_between=True), np.array([time_s]))


def _fixed(positions: np.ndarray) -> Placements:
    return Placements(positions, np.array([(0.0, 0.0, 0.0, 1.0)]))


def thinned(points: Points) -> Points:
    """Return at most `MAX_POINTS` of the points: one per cube, with the smallest possible cubes."""
    edge_m = _FINEST_M
    kept = np.arange(len(points.positions))
    while len(kept) > MAX_POINTS:
        cubes = np.floor(points.positions / edge_m).astype(np.int64)
        _, kept = np.unique(cubes, axis=0, return_index=True)
        edge_m *= _COARSER
    return Points(points.frame, points.positions[kept], points.colors[kept])


# Clouds as bytes, for a live page.

CLOUD = 3
"""First byte of an encoded cloud; see `cloud_message`."""
MAX_LIVE_POINTS = 4000
"""Maximum number of points in all clouds of a page together."""
_HEAD = Struct('<BxHId6f')
_STEPS_OF_16_BITS = 65_535
_FAR_M = 1e3


def live_points(data: bytes, most: int) -> Optional[Points]:
    """Return at most ``most`` points of a serialized sensor_msgs/PointCloud2, evenly sampled.

    Return None if the message is damaged or has no positions.
    """
    try:
        points = points_of_cloud(PointCloud2().deserialize(data))
    except genpy.DeserializationError:
        return None
    if points is None:
        return None
    near = np.flatnonzero((np.abs(points.positions) < _FAR_M).all(axis=1))
    rows = near[::max(-(-len(near) // most), 1)]
    return Points(points.frame, points.positions[rows], points.colors[rows])


def placed(points: Points, place: Placement) -> Points:
    """Return points in the outer frame; ``place`` is the pose of their own frame in it."""
    turn = np.array(matrix_from_quaternion(place.quaternion))
    return Points('', points.positions @ turn.T + np.array(place.position), points.colors)


def cloud_message(time_s: float, clouds: Sequence[Points]) -> bytes:
    """Return clouds encoded as bytes.

    A header (kind, 0, number of points, time, lowest corner and size of the bounding box [m]), then
    the positions as 16-bit fractions of the box, then the colors.
    """
    positions = np.concatenate([np.empty((0, 3)), *(it.positions for it in clouds)])
    colors = np.concatenate([np.empty((0, 3), np.uint8), *(it.colors for it in clouds)])
    low = positions.min(axis=0) if len(positions) else np.zeros(3)
    size = positions.max(axis=0) - low if len(positions) else np.zeros(3)
    share = np.divide(positions - low, size, out=np.zeros_like(positions), where=size > 0.0)
    return b''.join([
        _HEAD.pack(CLOUD, 0, len(positions), time_s, *low.tolist(), *size.tolist()),
        np.rint(_STEPS_OF_16_BITS * share).astype('<u2').tobytes(), colors.tobytes()])
