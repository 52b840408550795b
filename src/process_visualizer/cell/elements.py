# SPDX-License-Identifier: BSD-3-Clause
"""The configuration language as a table: its elements, and what each may contain.

The parser uses the table; the XML schema and the tables of the reference are generated from it.
"""
from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

from process_visualizer.ros_names import (
    FLOAT_ARRAY,
    NAMED_JOINTS,
    POSE_STAMPED,
    TF_MESSAGE,
    WRENCH_STAMPED,
)

# The display types of RViz 1.14: the key of their topic and their default properties.
#
# From the RViz sources (noetic-devel); RViz uses its default for a key that a file does not have.

@dataclass(frozen=True)
class DisplayType:
    """A display type of RViz.

    ``default_topic`` is relative to the device's name; None: no default. ``device_names`` are
    further properties whose values are relative to the device's name.
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
    # An Effort display subscribes only if it is already enabled when its topic is loaded. RViz
    # loads "Enabled" last but "Value", which also enables the display, first.
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

PROPERTY_LIMITS: Mapping[str, int] = {
    'Plane Cell Count': 1000, 'Decay Time': 60, 'Queue Size': 100, 'Buffer Length': 1000,
    'Length': 1000, 'History Length': 1000, 'Cloud Decay Time': 60}
"""Maximum values of display properties in untrusted configurations: they cost memory in RViz."""

DEFAULT_FRAME = 'world'
"""The global frame if a configuration names none."""

MESSAGE_TYPES: Mapping[str, Tuple[str, ...]] = {
    'joint_states': (FLOAT_ARRAY, *NAMED_JOINTS),
    'tool_center_frame': (FLOAT_ARRAY, POSE_STAMPED, TF_MESSAGE),
    'force_sensor': (FLOAT_ARRAY, WRENCH_STAMPED),
    'pointcloud': ('sensor_msgs/PointCloud2',),
    'depth_image': ('sensor_msgs/Image',),
    'color_image': ('sensor_msgs/Image',),
    'camera_info': ('sensor_msgs/CameraInfo',),
}
"""The message types that each function of a topic accepts."""


@dataclass(frozen=True)
class Attribute:
    """An attribute: ``kind`` names a converter of the module ``values``."""

    kind: str
    help: str
    default: Optional[str] = None
    required: bool = False
    choices: Tuple[str, ...] = ()


@dataclass(frozen=True)
class Tag:
    """An element: its attributes and children.

    ``single`` children may occur only once. At most one of the attributes ``alternatives`` may be
    given, exactly one if ``needs_alternative``. Text is allowed only if ``text``. ``variants``
    describes children that mean something else here than in ``TAGS``.
    """

    help: str
    attributes: Mapping[str, Attribute]
    children: Tuple[str, ...] = ()
    single: Tuple[str, ...] = ()
    text: bool = False
    alternatives: Tuple[str, ...] = ()
    needs_alternative: bool = False
    variants: Mapping[str, 'Tag'] = field(default_factory=dict)

    def child(self, name: str) -> 'Tag':
        """Return the description of a child.

        Raises:
            KeyError: there is no such tag.
        """
        return self.variants[name] if name in self.variants else TAGS[name]


def _required(kind: str, text: str, choices: Sequence[str] = ()) -> Attribute:
    return Attribute(kind, text, required=True, choices=tuple(choices))


def _optional(kind: str, text: str, default: Optional[str] = None,
              choices: Sequence[str] = ()) -> Attribute:
    return Attribute(kind, text, default, choices=tuple(choices))


CONDITIONS = ('if', 'unless')
"""Attributes that decide whether an element is used at all."""

_CONDITION = {
    'if': _optional('boolean', 'use the element only if this is true'),
    'unless': _optional('boolean', 'use the element only if this is false'),
}
_IFSTATE = _optional('choice', 'start only in this mode; default: in both',
                     choices=('realtime', 'playback'))
_YAW_PITCH_ROLL = "yaw pitch roll in rad, intrinsic z-y'-x'', despite its name"
_POSE = {
    'xyz': _optional('vector', 'position in m', '0 0 0'),
    'rpy': _optional('vector', _YAW_PITCH_ROLL, '0 0 0'),
    'ypr': _optional('vector', 'the same values under their proper name; use only one of the two'),
}

_BOX = {
    'frame': _optional('frame', 'frame of the box; default: the global frame'),
    'xyz': _optional('vector', 'center of the box in m', '0 0 0'),
    'size': _required('size', 'edge lengths of the box in m'),
}

PASSED_ARGUMENT = Tag(
    'A value passed to the file.',
    {'name': _required('name', 'name of the argument in the file'),
     'value': _required('text', 'its value'), **_CONDITION})
"""``<arg>`` in an ``<include>``, a ``<launch>`` or a ``<model>``."""

_STRUCTURE: Dict[str, Tag] = {
    'visualizer': Tag(
        'The root of a configuration.',
        {'frame': _optional('frame', 'name of the global frame', DEFAULT_FRAME)},
        children=('arg', 'include', 'machine', 'device', 'event', 'run', 'phase'),
        single=('run',)),
    'arg': Tag(
        'A value for `$(arg name)`; set on the command line as `name:=value`.',
        {'name': _required('name', 'name of the argument'),
         'default': _optional('text', 'value if none is set'),
         'value': _optional('text', 'fixed value, instead of a default'),
         'doc': _optional('text', 'what it is for'), **_CONDITION},
        alternatives=('value', 'default')),
    'include': Tag(
        'Includes the devices of another file; its `<arg>` elements pass values to it.',
        {'file': _required('text', 'path of the file, relative to this one or with '
                                   '`$(find pkg)`'), **_CONDITION},
        children=('arg',), variants={'arg': PASSED_ARGUMENT}),
    'device': Tag(
        'A device of the cell.',
        {'type': _required('choice', 'type of the device', ('robot', 'depth_sensor', 'other')),
         'name': _required('name', 'name of the device and namespace of its nodes'),
         'machine': _optional('text', 'name of the `<machine>` on which its nodes run in real-time '
                                      'mode: those that the program starts for it, and its '
                                      '`<node>` elements without a `machine`; default: this '
                                      'computer'),
         **_CONDITION},
        children=('base', 'model', 'tool', 'node', 'launch', 'topic', 'rviz', 'force', 'arrow',
                  'variable', 'roi', 'fusion', 'objects', 'param', 'rosparam'),
         single=('base', 'model', 'tool', 'force', 'roi', 'fusion', 'objects')),
    'event': Tag(
        'A moment of the process: a number on a topic crosses a threshold.',
        {'name': _required('text', 'name of the event, such as `needle starts`'),
         'topic': _required('topic', 'the topic'),
         'field': _optional('field', 'the number in the message', 'data'),
         'above': _optional('number', 'the event occurs when the number rises above this'),
         'below': _optional('number', 'the event occurs when the number falls below this'),
         'hysteresis': _optional('length', 'how far the number must return past the threshold '
                                           'before the event can occur again', '0'),
         'for': _optional('length', 'seconds for which the number must stay beyond the threshold; '
                                    'a contact that bounces for less than 0.05 s counts once '
                                    'in any case', '0'),
         **_CONDITION},
        alternatives=('above', 'below'), needs_alternative=True),
    'run': Tag(
        'Defines one run of the process: from one event to another.',
        {'begin': _required('text', 'name of the `<event>`, or label of the mark, at which a run '
                                    'begins'),
         'end': _required('text', 'name of the event, or label of the mark, at which it ends; if '
                                  'it is the same, a run ends where the next one begins'),
         'before': _optional('length', 'seconds before the beginning that belong to the run', '0'),
         'after': _optional('length', 'seconds after the end that belong to the run', '0'),
         'shortest': _optional('length', 'minimum duration of a run in seconds, from begin to end; '
                                         'anything shorter is not a run', '0'),
         'group': _optional('text', 'label of the `<variable>`, or topic, whose value is the '
                                    'variant of a run; a run is judged by good runs of the same '
                                    'variant'),
         'place': _optional('text', 'the same for the place in a pattern; a run is judged by '
                                    'good runs of the same place'),
         **_CONDITION}),
    'phase': Tag(
        'A part of a run, from one event to another.',
        {'name': _required('text', 'name of the phase'),
         'from': _required('text', 'name of the `<event>`, or label of the mark, at which it '
                                   'begins'),
         'to': _required('text', 'name or label of the one at which it ends'),
         'wait': _optional('boolean', 'whether its duration may vary freely, because the process '
                                      'waits for someone or something; only its content is '
                                      'judged', 'False'),
         **_CONDITION}),
    'base': Tag(
        "The device's base frame and its pose in the global frame.",
        {'frame': _required('frame', 'name of the base frame'), **_POSE},
        alternatives=('rpy', 'ypr')),
    'model': Tag(
        'The model of the device: a URDF or xacro file; `<arg>` elements apply to xacro.',
        {'pkg': _optional('package', 'package that contains the file'),
         'path': _required('text', 'path of the file, which ends in .urdf or .xacro: inside the '
                                   'package, or without `pkg` relative to this file'),
         'prefix': _optional('frame', 'prefix for the names of its links, such as `left_`; '
                                      'distinguishes two robots with the same model')},
        children=('arg',), variants={'arg': PASSED_ARGUMENT}),
    'tool': Tag(
        "The robot's tool frame, where its arrows begin; by default a link of the model is chosen.",
        {'frame': _required('frame', 'a link of the model, or another frame that is fixed to one'),
         'xyz': _optional('vector', 'position of the tool in that frame in m', '0 0 0'),
         'rpy': _POSE['rpy'], 'ypr': _POSE['ypr']},
        alternatives=('rpy', 'ypr')),
    'force': Tag(
        'The frame of the force sensor; by default the tool frame is used.',
        {'parentframe': _required('frame', 'its parent frame, such as the tool frame'),
         'frame': _required('frame', 'name of the force frame'),
         'xyz': _required('vector', 'position in m'),
         'rpy': _optional('vector', f'{_YAW_PITCH_ROLL}; required (or `ypr`)'),
         'ypr': _POSE['ypr']},
        alternatives=('rpy', 'ypr'), needs_alternative=True),
    'roi': Tag(
         "The box to which a depth sensor's cloud is cropped.", _BOX),
    'fusion': Tag(
        'Joins the colored clouds of other devices in the global frame.',
        {'sensors': _required('names', 'names of the depth sensors, separated by spaces'),
         'voxel': _optional('positive', 'edge length in m of the voxels; each keeps one point',
                            '0.005'),
         'timeout': _optional('positive', 'seconds without a cloud after which a sensor is left '
                                          'out until it sends again', '1')}),
    'objects': Tag(
        'Finds unmodeled objects in the cloud of a depth sensor, and their distance to the robots.',
        {'warn': _optional('positive', 'distance from a robot in m below which the line to it is '
                                       'yellow', '0.5'),
         'stop': _optional('positive', 'distance in m below which it is red', '0.2'),
         'padding': _optional('positive', 'points closer than this to a model, in m, are treated '
                                          'as part of it', '0.03'),
         'surface': _optional('positive', 'level surfaces of at least this area in m², such as '
                                          'tables and the floor, are not objects themselves',
                              '0.5'),
         'noise': _optional('noise', 'error of depths: `kinect`, `realsense`, `tof`, or a standard '
                                     'deviation in m at a distance of 1 m, which grows with the '
                                     'square of the distance; default: estimated from the largest '
                                     'level surface'),
         'topic': _optional('topic', 'cloud to search; default: the one that the device shows'),
         'frame': _BOX['frame'], 'xyz': _BOX['xyz'],
         'size': _optional('size', 'edge lengths in m of the box to search; default: '
                                   'everywhere'), **_CONDITION},
        children=('expected',)),
    'expected': Tag(
        'A box whose content is expected, such as goods, and not an object.',
        {**_BOX, **_CONDITION}),
}

_PROCESSES: Dict[str, Tag] = {
    'node': Tag(
        'A node that is started with the device.',
        {'pkg': _required('package', 'package of the node'),
         'type': _required('executable', 'executable of the node'),
         'name': _required('name', 'name of the node, without a namespace'),
         'ns': _optional('namespace', "namespace; default: the device's name"),
         'args': _optional('command_line', 'arguments of the executable'),
         'output': _optional('choice', 'destination of its output', 'screen', ('screen', 'log')),
         'ifstate': _IFSTATE,
         'machine': _optional('text', 'name of the `<machine>` to run on; default: this computer'),
         'respawn': _optional('boolean', 'start the node again when it exits', 'False'),
         'respawn_delay': _optional('length', 'seconds to wait before the restart', '0'),
         'required': _optional('boolean', 'stop everything when the node exits', 'False'),
         'launch-prefix': _optional('command_line', 'words put before the command'),
         'clear_params': _optional('boolean', "delete the node's parameters first", 'False'),
         'cwd': _optional('choice', 'working directory', choices=('ROS_HOME', 'node')),
         **_CONDITION},
        children=('param', 'rosparam', 'remap', 'env')),
    'launch': Tag(
        'A launch file that is included with the device.',
        {'pkg': _required('package', 'package of the launch file'),
         'type': _required('path', "name of the file, searched for in the package's folder "
                                   '`launch` and in the package'),
         'ifstate': _IFSTATE, **_CONDITION},
        children=('arg',), variants={'arg': PASSED_ARGUMENT}),
    'param': Tag(
        "A parameter, as in roslaunch; under a device, in the device's namespace.",
        {'name': _required('resource', 'name of the parameter'),
         'value': _optional('text', 'its value'),
         'type': _optional('choice', 'type of the value; guessed by default',
                           choices=('auto', 'str', 'string', 'int', 'double', 'bool', 'boolean',
                                    'yaml')),
         'textfile': _optional('text', 'file whose text is the value'),
         'binfile': _optional('text', 'file whose bytes are the value'),
         'command': _optional('text', 'command whose output is the value'), **_CONDITION},
        alternatives=('value', 'textfile', 'binfile', 'command'), needs_alternative=True),
    'rosparam': Tag(
        'Parameters in YAML, as in roslaunch.',
        {'command': _optional('choice', 'operation', 'load', ('load', 'dump', 'delete')),
         'file': _optional('text', 'YAML file; default: the text of the element'),
         'param': _optional('resource', 'name of the parameter'),
         'ns': _optional('namespace', 'namespace of the parameters'),
         'subst_value': _optional('boolean', 'resolve `$(…)` in the YAML too', 'False'),
         **_CONDITION}, text=True),
    'remap': Tag(
        'A remapping of the node, as in roslaunch.',
        {'from': _required('resource', 'name to remap'),
         'to': _required('resource', 'name to use instead'), **_CONDITION}),
    'env': Tag(
        'An environment variable of the node, as in roslaunch.',
        {'name': _required('environment', 'name of the variable'),
         'value': _required('text', 'its value'), **_CONDITION}),
    'machine': Tag(
        'Another computer that nodes can run on, as in roslaunch.',
        {'name': _required('text', 'name, used by the attribute `machine` of a device or a node'),
         'address': _required('text', 'host name or address'),
         'env-loader': _optional('text', 'script there that sets up the environment'),
         'default': _optional('choice', 'whether nodes run there unless they name a machine',
                              'false', ('true', 'false', 'never')),
         'user': _optional('text', 'user name'),
         'password': _optional('text', 'refused, as it would be visible in recordings; use SSH '
                                       'keys and an agent'),
         'timeout': _optional('positive', 'seconds to wait for the connection', '10'),
         'ssh-port': _optional('integer', 'port of the SSH server', '22'),
         **_CONDITION}),
}

_DRAWN: Dict[str, Tag] = {
    'topic': Tag(
        'A topic that the driver of the device publishes.',
        {'name': _required('name', 'name of the topic, without a namespace'),
         'ns': _optional('namespace', 'namespace of the topic', ''),
         'type': _optional('choice', 'use of the topic besides recording',
                           choices=tuple(MESSAGE_TYPES)),
         'msg': _optional('message', 'message type; default: the type found on the topic'),
         'frame': _optional('frame', 'with `msg="tf2_msgs/TFMessage"`: the tf frame of the '
                                     'tool; default: the tool frame (see `<tool>`)'),
         'parentframe': _optional('frame', 'frame of poses or forces if the messages name none; '
                                           'default: the base frame or the force frame'),
         'latency': _optional('length', 'with a `type` of robots: seconds, up to 0.5, by which '
                                        'something was measured before the stamp of its message, '
                                        'or before its arrival if it has none', '0'),
         'record': _optional('boolean', 'whether the topic is recorded', 'True')}),
    'rviz': Tag(
        'An RViz display of the device.',
        {'type': _required('choice', 'display type of RViz', sorted(DISPLAY_TYPES)),
         'topic': _optional('topic', 'topic or parameter to show; default: that of the type, in '
                                     'the namespace of the device'),
         'name': _optional('text', 'name in the list of displays')},
        children=('property', 'rviz')),
    'property': Tag(
        'A property of the display, named as in RViz; may contain other properties.',
        {'name': _required('text', 'name of the property'),
         'value': _optional('text', 'its value; colors are `r; g; b` from 0 to 255')},
        children=('property',)),
    'arrow': Tag(
        "The appearance of one of a robot's arrows.",
        {'quantity': _required('choice', 'which arrow', ('velocity', 'force')),
         'scale': _optional('positive', 'length in m per m/s or per N'),
         'min': _optional('length', 'minimum length in m'),
         'max': _optional('positive', 'maximum length in m'),
         'color': _optional('color', 'a color name, `#rrggbb`, or `r g b` from 0 to 1'),
         'tolerance': _optional('positive', 'allowed deviation of a run from a good one, in m/s or '
                                            'N; default: a share of the range'),
         'max_tolerance': _optional('positive', 'deviation that is never allowed, however much '
                                                'good runs differ')}),
    'variable': Tag(
        'A number on any topic, shown as an arrow with its value.',
        {'topic': _required('topic', 'the topic'),
         'field': _optional('field', 'the number in the message, such as `data` or `data[2]`',
                            'data'),
         'frame': _required('frame', 'frame whose origin is the foot of the arrow'),
         'axis': _optional('axis', 'direction in that frame: `x`, `-z`, or three numbers', 'x'),
         'color': _optional('color', 'as for `<arrow>`', 'orange'),
         'unit': _optional('text', 'unit shown after the value', ''),
         'scale': _optional('number', 'length in m per unit of the value', '1'),
         'max': _optional('positive', 'maximum length in m; the number beside it is not limited'),
         'offset': _optional('number', 'setpoint, in the unit of the value; the arrow shows the '
                                       'difference from it; unless it is 0, the text does too: '
                                       '`263, 8 above 255`',
                             '0'),
         'offset_param': _optional('resource', 'parameter that holds the offset, in the unit of '
                                               'the value, and may change at any time; until it '
                                               'is set, `offset` is used'),
         'low': _optional('number', 'lower limit, in the unit of the value; below it the arrow has '
                                    'the warning color, and the launcher shows an alarm'),
         'high': _optional('number', 'upper limit, in the same way'),
         'warning_color': _optional('color', 'warning color', 'red'),
         'color_begin': _optional('number', 'value up to which the arrow has its `color`; from '
                                            'there it fades to `end_color`'),
         'color_end': _optional('number', 'value from which the arrow has its `end_color`'),
         'end_color': _optional('color', 'other end of the color scale'),
         'tolerance': _optional('positive', 'allowed deviation of a run from a good one, in the '
                                            'unit of the value; default: a share of the range'),
         'max_tolerance': _optional('positive', 'deviation that is never allowed, however much '
                                                'good runs differ'),
         'label': _optional('text', 'text before the value; default: the name of the topic'),
         'shown': _optional('boolean', 'whether RViz shows it; its curve and limits do not '
                                       'depend on this', 'True')},
        children=('value',)),
    'value': Tag(
        'The name of a value of a variable, such as a state of a controller.',
        {'of': _required('number', 'the value'), 'name': _required('text', 'name of the value')}),
}

ROOT = 'visualizer'

TAGS: Dict[str, Tag] = {**_STRUCTURE, **_PROCESSES, **_DRAWN}
