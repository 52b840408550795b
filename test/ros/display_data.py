# SPDX-License-Identifier: BSD-3-Clause
"""Messages for every display type of RViz that shows a topic, drawn at the origin of a frame."""
from __future__ import annotations

import math
import struct
from typing import Any, Callable, Dict, List

import numpy as np
import rospy
from geometry_msgs.msg import (
    AccelStamped,
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TwistStamped,
    Vector3,
    WrenchStamped,
)
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from nav_msgs.msg import GridCells, OccupancyGrid, Odometry, Path
from sensor_msgs.msg import (
    CameraInfo,
    ChannelFloat32,
    FluidPressure,
    Illuminance,
    Image,
    JointState,
    LaserScan,
    PointCloud,
    PointCloud2,
    PointField,
    Range,
    RelativeHumidity,
    Temperature,
)
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker, MarkerArray

JOINT = 'turn'
_UP = Quaternion(0.0, -math.sqrt(0.5), 0.0, math.sqrt(0.5))  # an arrow along x points to the viewer
IMAGE_COLORS = {'Camera': (0, 128, 255), 'Image': (0, 255, 128)}
_WIDTH, _HEIGHT, _FOCAL_LENGTH = 32, 24, 100.0
_CORNERS = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]


class DisplayData:
    """Publishes for every display type, five times a second, below a namespace.

    A display's topics and the frame of its messages are named like its type in small letters.
    """

    def __init__(self, namespace: str) -> None:
        self._publishers: List[Any] = []
        for name, make in _STREAMS.items():
            self._add(f'{namespace}/{name.lower()}/data', make(), name.lower())
        for name in ('camera', 'depthcloud'):
            self._add(f'{namespace}/{name}/camera_info', _camera_info(), name)
        self._add(f'{namespace}/depthcloud/color', _image('rgb8', b'\xff\x80\x00'), 'depthcloud')
        self._server = InteractiveMarkerServer(f'{namespace}/interactivemarkers')
        self._server.insert(_interactive_marker(), lambda _feedback: None)
        self._server.applyChanges()
        self._timer = rospy.Timer(rospy.Duration.from_sec(0.2), self._publish)

    def close(self) -> None:
        """Publish no more."""
        self._timer.shutdown()

    def _add(self, topic: str, message: Any, frame: str) -> None:
        publisher = rospy.Publisher(topic, type(message), queue_size=2)
        self._publishers.append((publisher, message, frame))

    def _publish(self, event: Any) -> None:
        for publisher, message, frame in self._publishers:
            for one in getattr(message, 'markers', [message]):
                one.header.frame_id, one.header.stamp = frame, event.current_real
            publisher.publish(message)


def _accel() -> AccelStamped:
    message = AccelStamped()
    message.accel.linear = Vector3(0.15, 0.0, 0.0)
    return message


def _twist() -> TwistStamped:
    message = TwistStamped()
    message.twist.linear = Vector3(0.15, 0.0, 0.0)
    return message


def _wrench() -> WrenchStamped:
    message = WrenchStamped()
    message.wrench.force = Vector3(0.15, 0.0, 0.0)
    return message


def _effort() -> JointState:
    return JointState(name=[JOINT], position=[0.0], velocity=[0.0], effort=[0.2])


def _grid_cells() -> GridCells:
    return GridCells(cell_width=0.2, cell_height=0.2, cells=[Point(0.0, 0.0, 0.0)])


def _laser_scan() -> LaserScan:
    return LaserScan(angle_min=-1.0, angle_max=1.0, angle_increment=0.25, range_min=0.0,
                     range_max=10.0, ranges=[0.2] * 9, intensities=[1.0] * 9)


def _pose() -> Pose:
    return Pose(Point(), _UP)


def _odometry() -> Odometry:
    message = Odometry()
    message.pose.pose = _pose()
    return message


def _path() -> Path:
    message = Path()
    for x, y in _CORNERS:
        stamped = PoseStamped()
        stamped.header.frame_id = 'path'
        stamped.pose.position = Point(x, y, 0.0)
        stamped.pose.orientation.w = 1.0
        message.poses.append(stamped)
    return message


def _point_cloud() -> PointCloud:
    return PointCloud(points=[Point32(x, y, 0.0) for x, y in _CORNERS],
                      channels=[ChannelFloat32('intensity', [0.0, 1.0, 2.0, 3.0])])


def _point_cloud2() -> PointCloud2:
    fields = [PointField(name, 4 * i, PointField.FLOAT32, 1)
              for i, name in enumerate(('x', 'y', 'z', 'rgb'))]
    rows = b''.join(struct.pack('<fffI', x, y, 0.0, 0xffaa00) for x, y in _CORNERS)
    return PointCloud2(height=1, width=4, fields=fields, point_step=16, row_step=64, data=rows,
                       is_dense=True)


def _polygon() -> PolygonStamped:
    message = PolygonStamped()
    message.polygon.points = [Point32(x, y, 0.0) for x, y in _CORNERS]
    return message


def _pose_with_covariance() -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.pose.pose = _pose()
    message.pose.covariance = (1e-3 * np.eye(6)).flatten().tolist()
    return message


def _range() -> Range:
    return Range(field_of_view=0.5, min_range=0.0, max_range=1.0, range=0.3)


def _map() -> OccupancyGrid:
    message = OccupancyGrid(data=[0, 100] * 8)
    message.info.width = message.info.height = 4
    message.info.resolution = 0.1
    message.info.origin.position = Point(-0.2, -0.2, 0.0)
    message.info.origin.orientation.w = 1.0
    return message


def _marker() -> Marker:
    message = Marker(ns='test', type=Marker.CUBE, color=ColorRGBA(1.0, 0.5, 0.0, 1.0))
    message.scale = Vector3(0.2, 0.2, 0.2)
    message.pose.orientation.w = 1.0
    return message


def _interactive_marker() -> InteractiveMarker:
    message = InteractiveMarker(name='box', scale=0.3)
    message.header.frame_id = 'interactivemarkers'
    message.pose.orientation.w = 1.0
    control = InteractiveMarkerControl(always_visible=True, markers=[_marker()])
    control.orientation.w = 1.0
    message.controls.append(control)
    return message


def _image(encoding: str, pixel: bytes) -> Image:
    return Image(width=_WIDTH, height=_HEIGHT, encoding=encoding, step=_WIDTH * len(pixel),
                 data=pixel * (_WIDTH * _HEIGHT))


def _camera_info() -> CameraInfo:
    k = [_FOCAL_LENGTH, 0, _WIDTH / 2, 0, _FOCAL_LENGTH, _HEIGHT / 2, 0, 0, 1]
    return CameraInfo(width=_WIDTH, height=_HEIGHT, K=k, R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                      P=[*k[:3], 0, *k[3:6], 0, *k[6:], 0], distortion_model='plumb_bob',
                      D=[0.0] * 5)


_STREAMS: Dict[str, Callable[[], Any]] = {
    'AccelStamped': _accel,
    'Camera': lambda: _image('rgb8', bytes(IMAGE_COLORS['Camera'])),
    'DepthCloud': lambda: _image('16UC1', struct.pack('<H', 1000)),
    'Effort': _effort,
    'FluidPressure': lambda: FluidPressure(fluid_pressure=1e5),
    'GridCells': _grid_cells,
    'Illuminance': lambda: Illuminance(illuminance=300.0),
    'Image': lambda: _image('rgb8', bytes(IMAGE_COLORS['Image'])),
    'LaserScan': _laser_scan,
    'Map': _map,
    'Marker': _marker,
    'MarkerArray': lambda: MarkerArray(markers=[_marker()]),
    'Odometry': _odometry,
    'Path': _path,
    'PointCloud': _point_cloud,
    'PointCloud2': _point_cloud2,
    'PointStamped': PointStamped,
    'Polygon': _polygon,
    'Pose': lambda: PoseStamped(pose=_pose()),
    'PoseArray': lambda: PoseArray(poses=[_pose()]),
    'PoseWithCovariance': _pose_with_covariance,
    'Range': _range,
    'RelativeHumidity': lambda: RelativeHumidity(relative_humidity=0.5),
    'Temperature': lambda: Temperature(temperature=20.0),
    'TwistStamped': _twist,
    'WrenchStamped': _wrench,
}
