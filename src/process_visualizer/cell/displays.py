# SPDX-License-Identifier: BSD-3-Clause
"""The display types of RViz 1.14: the key of their topic and their default properties.

Facts from the RViz sources (noetic-devel); a key that is missing in a file keeps RViz's default.
"""
from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Dict, Optional


@dataclass(frozen=True)
class DisplayType:
    """An RViz display: ``default_topic`` is below the device's name; None if there is no default.

    ``device_names`` are further properties whose values are names below the device's name.
    """

    topic_key: Optional[str]
    message_type: Optional[str] = None
    default_topic: Optional[str] = None
    properties: Dict[str, Any] = field(default_factory=dict)
    device_names: Dict[str, str] = field(default_factory=dict)

    @property
    def needs_topic(self) -> bool:
        """Return whether a configuration must name the topic."""
        return self.topic_key is not None and self.default_topic is None


def _stream(message_type: str, default_topic: Optional[str] = None,
            **properties: Any) -> DisplayType:
    keys = {'Unreliable': False, 'Queue Size': 10}
    keys.update({name.replace('_', ' '): value for name, value in properties.items()})
    return DisplayType('Topic', message_type, default_topic, keys)


def _markers(message_type: str, default_topic: str) -> DisplayType:
    return DisplayType('Marker Topic', message_type, default_topic,
                       {'Queue Size': 100, 'Namespaces': {}})


_CLOUD = {'Style': 'Points', 'Size_(Pixels)': 4, 'Color_Transformer': 'RGB8',
          'Position_Transformer': 'XYZ', 'Decay_Time': 0}

DISPLAY_TYPES: Dict[str, DisplayType] = {
    'AccelStamped': _stream('geometry_msgs/AccelStamped'),
    # "Value" is what RViz loads first of all. An Effort display subscribes only when its topic is
    # loaded while it is enabled already, and "Enabled" is loaded last.
    'Effort': replace(_stream('sensor_msgs/JointState', Value=True),
                      device_names={'Robot Description': 'robot_description'}),
    'FluidPressure': _stream('sensor_msgs/FluidPressure'),
    'GridCells': _stream('nav_msgs/GridCells'),
    'Illuminance': _stream('sensor_msgs/Illuminance'),
    'LaserScan': _stream('sensor_msgs/LaserScan'),
    'Odometry': _stream('nav_msgs/Odometry'),
    'Path': _stream('nav_msgs/Path'),
    'PointCloud': _stream('sensor_msgs/PointCloud'),
    'PointCloud2': _stream('sensor_msgs/PointCloud2', 'points', **_CLOUD),
    'PointStamped': _stream('geometry_msgs/PointStamped'),
    'Polygon': _stream('geometry_msgs/PolygonStamped'),
    'Pose': _stream('geometry_msgs/PoseStamped'),
    'PoseArray': _stream('geometry_msgs/PoseArray'),
    'PoseWithCovariance': _stream('geometry_msgs/PoseWithCovarianceStamped'),
    'Range': _stream('sensor_msgs/Range'),
    'RelativeHumidity': _stream('sensor_msgs/RelativeHumidity'),
    'Temperature': _stream('sensor_msgs/Temperature'),
    'TwistStamped': _stream('geometry_msgs/TwistStamped'),
    'WrenchStamped': _stream('geometry_msgs/WrenchStamped'),
    'Map': DisplayType('Topic', 'nav_msgs/OccupancyGrid', None, {'Unreliable': False}),
    'Marker': _markers('visualization_msgs/Marker', 'marker'),
    'MarkerArray': _markers('visualization_msgs/MarkerArray', 'marker_array'),
    'InteractiveMarkers': DisplayType('Update Topic', 'visualization_msgs/InteractiveMarkerUpdate'),
    'Image': DisplayType('Image Topic', 'sensor_msgs/Image', None,
                         {'Transport Hint': 'raw', 'Queue Size': 2, 'Unreliable': False}),
    'Camera': DisplayType('Image Topic', 'sensor_msgs/Image', None,
                          {'Transport Hint': 'raw', 'Queue Size': 2, 'Unreliable': False,
                           'Image Rendering': 'background and overlay'}),
    'DepthCloud': DisplayType('Depth Map Topic', 'sensor_msgs/Image', None,
                              {'Depth Map Transport Hint': 'raw', 'Color Transport Hint': 'raw',
                               'Queue Size': 5}),
    'RobotModel': DisplayType('Robot Description', None, 'robot_description',
                              {'TF Prefix': '', 'Visual Enabled': True,
                               'Collision Enabled': False, 'Update Interval': 0}),
    'TF': DisplayType(None, properties={'Frames': {'All Enabled': True}}),
    'Axes': DisplayType(None),
    'Grid': DisplayType(None),
    'Group': DisplayType(None),
}
