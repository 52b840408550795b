# SPDX-License-Identifier: BSD-3-Clause
"""Devices of a draft: robots, cameras, and all others; and the poses of their base frames."""
from __future__ import annotations

import math
import re
from typing import Collection, Dict, Iterable, List, NamedTuple, Optional, Sequence, Set, Tuple

from process_visualizer.cell.elements import DEFAULT_FRAME, DISPLAY_TYPES
from process_visualizer.cell.model import Pose
from process_visualizer.discovery.draft import (
    CellNames,
    DraftDevice,
    DraftElement,
    is_field,
    is_frame,
)
from process_visualizer.discovery.process import StateNumber
from process_visualizer.discovery.robot_topics import (
    FoundModel,
    RobotGroup,
    ToolTransform,
    tool_link,
)
from process_visualizer.discovery.seen import FrameForest, SeenNumber, SeenTopic, pose_of
from process_visualizer.discovery.topic_groups import CLOUD, CameraGroup, is_registered
from process_visualizer.ros_names import TF_MESSAGE, TF_TOPIC

# A robot as a device of the configuration.

_FORCE_NAME = re.compile(r'(^|[/_])(ft|force|wrench|sensor)([/_]|$)')


def robot_name(group: RobotGroup) -> str:
    """Return the name of a robot: from its namespace, else from its model."""
    for namespace in (group.namespace, group.joint_topic.name.rpartition('/')[0]):
        if namespace.strip('/'):
            return namespace.strip('/').rpartition('/')[2]
    return group.model.name if group.model is not None else 'robot'


def robot_device(group: RobotGroup, name: str, prefix: str, names: CellNames, places: BasePlaces,
                 forest: FrameForest, tool: Optional[ToolTransform] = None) -> DraftDevice:
    """Return the device of a robot; the links of its model get the ``prefix``.

    The ``tool`` provides the pose of the tool if no topic does.
    """
    device = DraftDevice('robot', name)
    add_model(device, group.model, prefix)
    if group.model is not None:
        base = prefix + group.model.description.root_link
    else:
        base = names.frame(_base_of_poses(group, names, places) or f'{name}/base_link')
    attributes, comment = places.base_attributes(base)
    device.add('base', attributes, comment)
    for topic in (group.joint_topic, *group.other_joint_topics):
        add_topic(device, topic, 'joint_states')
    if group.pose_topic is not None:
        add_topic(device, group.pose_topic, 'tool_center_frame')
    elif tool is not None:
        device.add('topic', {'name': TF_TOPIC.lstrip('/'), 'type': 'tool_center_frame',
                             'msg': TF_MESSAGE, 'frame': tool.frame}, tool.comment, tool.is_sure)
    if group.wrench_topic is not None:
        add_topic(device, group.wrench_topic, 'force_sensor')
        _add_force(device, group, group.wrench_topic, prefix, names, forest)
    _add_missing_comment(device, group, tool is not None and tool.is_sure)
    return device


def _base_of_poses(group: RobotGroup, names: CellNames, places: BasePlaces) -> str:
    """Return the frame of a driver's tool poses if it can be the base frame, else ''."""
    frames = group.pose_topic.frames if group.pose_topic is not None else ()
    return next((it for it in frames if is_frame(it) and names.is_free(it)
                 and it != places.frame), '')


def add_model(device: DraftDevice, model: Optional[FoundModel], prefix: str = '') -> None:
    """Add the model, or a line to complete if there is none."""
    if model is None:
        device.add('model', {'pkg': 'my_robot_description', 'path': 'urdf/my_robot.urdf.xacro'},
                   'no model was found: name its file here, and the root link of it in <base>',
                   active=False)
        return
    attributes = {'pkg': model.package} if model.package else {}
    attributes['path'] = model.path or f'{device.name}.urdf'
    if prefix:
        attributes['prefix'] = prefix
    arguments = tuple(DraftElement('arg', {'name': name, 'value': value})
                      for name, value in model.arguments)
    device.add('model', attributes, model.reason, children=arguments)


def add_topic(device: DraftDevice, topic: SeenTopic, function: str = '', comment: str = '',
              **more: str) -> None:
    """Add a topic and its function."""
    namespace, _, name = topic.name.rpartition('/')
    attributes: Dict[str, str] = {'ns': namespace.strip('/')} if namespace.strip('/') else {}
    attributes['name'] = name
    if function:
        attributes.update(type=function, msg=topic.type)
    device.add('topic', {**attributes, **more}, comment)


def _add_force(device: DraftDevice, group: RobotGroup, topic: SeenTopic, prefix: str,
               names: CellNames, forest: FrameForest) -> None:
    """Add the force sensor's frame if tf or the messages name a frame that no model has."""
    if group.model is None:
        return
    links = group.model.description.links
    child = next((frame for frame in forest.frames if _FORCE_NAME.search(frame) and is_frame(frame)
                  and names.is_free(frame) and (forest.parent(frame) or '') in links), None)
    if child is not None:
        transform = forest.transform(child)
        device.add('force', {'parentframe': prefix + transform.parent, 'frame': names.frame(child),
                             **_whole_pose(pose_of(transform.placement))})
        return
    unknown = [frame for frame in topic.frames if is_frame(frame) and frame not in links
               and frame not in forest.frames and names.is_free(frame)]
    if unknown:
        device.add('force', {'parentframe': prefix + tool_link(group.model),
                             'frame': names.frame(unknown[0]), **_whole_pose(Pose())},
                   'the messages name this frame, but its place is not known: write its pose')


def _whole_pose(pose: Pose) -> Dict[str, str]:
    found = pose_attributes(pose)
    return {**found, 'ypr': found.get('ypr', '0 0 0')}


def _add_missing_comment(device: DraftDevice, group: RobotGroup, has_tool: bool) -> None:
    missing: List[str] = []
    if group.wrench_topic is None:
        missing.append('no force (WrenchStamped)')
    if group.pose_topic is None and not has_tool:
        velocity = 'so no velocity' if group.model is None else \
            'so its velocity is that of the model and the joints'
        missing.append(f'no pose of its tool (PoseStamped, or a frame on tf), {velocity}')
    if missing:
        device.comments.append(f'{device.name} was seen with {" and ".join(missing)}.')


# A camera or depth sensor as a device of the configuration.

def camera_device(group: CameraGroup, name: str, names: CellNames, places: BasePlaces,
                  forest: FrameForest, links: Collection[str]) -> DraftDevice:
    """Return the device of a camera; ``links`` are robots' links, which may carry the camera."""
    device = DraftDevice('depth_sensor' if group.is_depth_sensor else 'other', name)
    _add_base(device, group, names, places, forest, links)
    cloud = group.cloud
    is_computed = group.depth_image is not None
    for topic in group.topics:
        if topic is cloud:
            _add_cloud(device, topic, is_computed)
        elif topic.type == CLOUD:
            add_topic(device, topic, '', 'one more cloud: large, so it is not recorded',
                      record='False')
        else:
            add_topic(device, topic)
    if group.depth_image is not None:
        _add_cloud_node(device, group, group.depth_image, cloud)
    return device


def _add_base(device: DraftDevice, group: CameraGroup, names: CellNames, places: BasePlaces,
              forest: FrameForest, links: Collection[str]) -> None:
    frames = [frame for frame in group.frames if is_frame(frame)]
    tops = [top_frame(forest, frame, {places.frame, *links}) for frame in frames]
    base, carrier = tops[0] if tops else (f'{device.name}/base', None)
    end = base
    if carrier is not None and carrier in links:
        device.comments.append(f'{device.name} is fixed to {carrier}.')
        end = carrier
    elif is_frame(base) and base != places.frame and names.is_free(base):
        attributes, comment = places.base_attributes(names.frame(base))
        device.add('base', attributes, comment)
    add_inner_frames(device, frames, end, names, forest)


def add_inner_frames(device: DraftDevice, frames: Iterable[str], end: str, names: CellNames,
                     forest: FrameForest) -> None:
    """Add nodes that publish the frames from ``end`` to ``frames`` in playback.

    Their driver does not run in playback. Frames that a device already has are left out.
    """
    done: Dict[str, None] = {}
    for frame in frames:
        path = forest.path(frame)
        done.update(dict.fromkeys(path[:path.index(end)] if end in path else ()))
    begin = sum(element.tag == 'node' for element in device.elements) + 1
    for number, child in enumerate(filter(names.is_free, done), begin):
        moved = forest.transform(names.frame(child))
        values = ' '.join(f'{value:.9g}' for value in (*moved.placement.position,
                                                       *moved.placement.quaternion))
        device.add('node', {'ifstate': 'playback', 'pkg': 'tf2_ros',
                            'type': 'static_transform_publisher', 'name': f'frame_{number}',
                            'args': f'{values} {moved.parent} {child}'},
                   'moved while it was observed, which a fixed transform does not' * moved.changes,
                   active=not moved.changes)


def _add_cloud(device: DraftDevice, cloud: SeenTopic, is_computed: bool) -> None:
    if is_computed:
        add_topic(device, cloud, 'pointcloud', 'not recorded: in playback it is computed from the '
                  'images', record='False')
    else:
        add_topic(device, cloud, 'pointcloud')


def _add_cloud_node(device: DraftDevice, group: CameraGroup, depth: SeenTopic,
                    cloud: Optional[SeenTopic]) -> None:
    """Add a node that computes the cloud from the images: in playback, or always if none does."""
    output = f'/{device.name}/cloud' if cloud is None else cloud.name
    if cloud is None:
        device.add('topic', {'ns': device.name, 'name': 'cloud', 'type': 'pointcloud',
                             'record': 'False'}, 'computed from the images by the node below')
    mode = {} if cloud is None else {'ifstate': 'playback'}
    nodelet, remaps = _nodelet(group, depth)
    points = 'depth_registered/points' if nodelet.endswith('rgb') else 'points'
    children = tuple(DraftElement('remap', {'from': name, 'to': to})
                     for name, to in [*remaps, (points, output)])
    device.add('node', {**mode, 'pkg': 'nodelet', 'type': 'nodelet', 'name': 'cloud_of_images',
                        'args': f'standalone depth_image_proc/{nodelet}'}, children=children)


def _nodelet(group: CameraGroup, depth: SeenTopic) -> Tuple[str, List[Tuple[str, str]]]:
    """Return the nodelet of depth_image_proc for these images, and its input topics."""
    color, info = group.color_image, group.info_of(depth)
    color_info = group.info_of(color) if color is not None else None
    if color is not None and color_info is not None and is_registered(depth):
        return 'point_cloud_xyzrgb', [('rgb/image_rect_color', color.name),
                                      ('rgb/camera_info', color_info.name),
                                      ('depth_registered/image_rect', depth.name)]
    return 'point_cloud_xyz', [('image_rect', depth.name),
                               ('camera_info', info.name if info is not None else '')]


# Numbers of topics that may be process variables, and how to draw them.

MAX_PER_TOPIC = 6
"""Maximum number of arrows for one topic; more would hide each other."""
MAX_STATES = 20
_LENGTH_M = 0.3
"""Length of the longest arrow for the observed values."""
_MAX_M = 0.6
"""Maximum length of an arrow for later values."""
_MOMENT_SHARE = 0.2
"""Minimum expected change of a number observed only for a moment, as a share of its value."""
_COLORS = ('orange', 'cyan', 'yellow', 'purple', 'blue', 'red', 'white')
_KNOWN: Dict[str, Dict[str, str]] = {
    'sensor_msgs/Temperature': {'temperature': '°C'},
    'sensor_msgs/Range': {'range': 'm'},
    'sensor_msgs/FluidPressure': {'fluid_pressure': 'Pa'},
    'sensor_msgs/Illuminance': {'illuminance': 'lx'},
    'sensor_msgs/RelativeHumidity': {'relative_humidity': ''},
    'sensor_msgs/BatteryState': {'voltage': 'V', 'current': 'A'},
}
"""Measured fields of these messages, and their units by the message definition."""
_NO_VARIABLES = frozenset({
    'sensor_msgs', 'geometry_msgs', 'nav_msgs', 'tf', 'tf2_msgs', 'visualization_msgs',
    'trajectory_msgs', 'shape_msgs', 'stereo_msgs', 'actionlib_msgs', 'moveit_msgs'})
_NO_MEASUREMENT = re.compile(
    r'(.*_)?(seq|sequence|stamp|secs|nsecs|id|count|counter|index|number|mode|state|status|code|'
    r'error|flags?|version|width|height|size|step|covariance|variance|timestamp)')


class Candidate(NamedTuple):
    """A number that may be a variable: the attributes of its <variable> except topic and frame.

    It is a ``likely`` variable if it changed, or if its message type is that of a sensor.
    """

    attributes: Dict[str, str]
    likely: bool


def candidates(topic: SeenTopic, begin: int = 0, is_moment: bool = False) -> List[Candidate]:
    """Return the candidates of a topic; their colors start with number ``begin``.

    See ``Seen`` for ``is_moment``.
    """
    known = _KNOWN.get(topic.type)
    numbers = [it for it in topic.numbers if _is_measured(it, topic, known)]
    return [Candidate(_attributes(topic, number, (known or {}).get(number.path, ''), begin + i,
                                  len(numbers) > 1, is_moment),
                      number.changes or known is not None)
            for i, number in enumerate(numbers[:MAX_PER_TOPIC])]


def left_out(topic: SeenTopic) -> int:
    """Return the number of a topic's possible variables beyond ``MAX_PER_TOPIC``."""
    known = _KNOWN.get(topic.type)
    return max(0, sum(_is_measured(it, topic, known) for it in topic.numbers) - MAX_PER_TOPIC)


def _is_measured(number: SeenNumber, topic: SeenTopic, known: Optional[Dict[str, str]]) -> bool:
    if not is_field(number.path):
        return False
    if known is not None:
        return number.path in known
    if topic.type.partition('/')[0] in _NO_VARIABLES:
        return False
    name = number.path.rpartition('.')[2]
    return not number.is_counter and not _NO_MEASUREMENT.fullmatch(name)


def _attributes(topic: SeenTopic, number: SeenNumber, unit: str, color: int,
                is_one_of_many: bool, is_moment: bool) -> Dict[str, str]:
    offset, scale = scaling(number.low, number.high, _MOMENT_SHARE if is_moment else 0.0)
    name = topic.name.rpartition('/')[2]
    attributes = {'axis': 'z', 'label': f'{name} {number.path}' if is_one_of_many else name}
    if number.path != 'data':
        attributes['field'] = number.path
    if unit:
        attributes['unit'] = unit
    attributes.update(scale=f'{scale:g}', max=f'{_MAX_M:g}')
    if offset:
        attributes['offset'] = f'{offset:g}'
    attributes['color'] = _COLORS[color % len(_COLORS)]
    return attributes


def scaling(low: float, high: float, least_share: float = 0.0) -> Sequence[float]:
    """Return offset and scale [m per unit] that map these values to arrows of 0.3 m or less.

    The values are assumed to spread over at least ``least_share`` of the largest.
    """
    largest = max(abs(low), abs(high))
    spread = max(high - low, least_share * largest)
    if not math.isfinite(spread) or largest == 0.0 or not math.isfinite(1.0 / largest):
        return 0.0, 1.0
    if spread < 0.5 * largest and spread > 1e-6 * largest and low * high > 0.0:
        offset = _rounded(low, spread)
        return offset, _one_digit(_LENGTH_M / max(abs(high - offset), abs(low - offset), spread))
    return 0.0, _one_digit(_LENGTH_M / largest)


def _rounded(value: float, spread: float) -> float:
    """Return the value, rounded down to the leading decimal place of the spread."""
    step = 10.0 ** math.floor(math.log10(spread))
    return math.floor(value / step) * step


def _one_digit(value: float) -> float:
    return float(f'{value:.0e}')


# Machines and sensors, which publish neither joints nor images, as devices.

ROOT_DEVICE = 'sensors'
"""Name of the device for topics without a namespace."""
_VARIABLES = 'numbers that may be process variables: remove those that are not'
_CONSTANT = 'did not change while it was observed'
_DRAWN = ('LaserScan', 'Path', 'Odometry', 'PointCloud', 'Polygon', 'PoseArray', 'GridCells',
          'Map', 'Marker', 'MarkerArray', 'PoseWithCovariance', 'PointStamped')
_DISPLAYS = {DISPLAY_TYPES[name].message_type: name for name in _DRAWN}


def by_namespace(topics: Sequence[SeenTopic]) -> Dict[str, List[SeenTopic]]:
    """Return topics by the first part of their namespace, '' for topics without one."""
    found: Dict[str, List[SeenTopic]] = {}
    for topic in topics:
        first, slash, _ = topic.name.strip('/').partition('/')
        found.setdefault(first if slash else '', []).append(topic)
    return found


class Machines:
    """Adds machines and sensors to a configuration."""

    def __init__(self, names: CellNames, places: BasePlaces, forest: FrameForest,
                 known_frames: Collection[str], is_moment: bool = False,
                 states: Sequence[StateNumber] = ()) -> None:
        """Prepare to add devices.

        Args:
            names, places, forest: of the configuration.
            known_frames: frames of models and devices.
            is_moment: as in ``Seen``.
            states: numbers that are judged by the order of their values; they have no arrow.
        """
        self._names, self._places, self._forest = names, places, forest
        self._known: Set[str] = {*known_frames, places.frame}
        self._color, self._is_moment = 0, is_moment
        self._states: Dict[str, List[StateNumber]] = {}
        for it in states:
            self._states.setdefault(it.topic, []).append(it)

    def add_topics(self, device: DraftDevice, topics: Sequence[SeenTopic]) -> None:
        """Add topics with their variables and displays, and a base frame if they need one."""
        for topic in topics:
            if not self._add_variables(device, topic):
                add_topic(device, topic)
                self._add_display(device, topic)
        self._add_display_frames(device, topics)

    def _add_variables(self, device: DraftDevice, topic: SeenTopic) -> bool:
        """Add the candidates of a topic; return whether one of them became a variable."""
        states = self._states.get(topic.name, [])
        fields = [state.field for state in states]
        variables = [it for it in candidates(topic, self._color, self._is_moment)
                     if it.attributes.get('field', 'data') not in fields]
        self._add_states(device, topic, states)
        self._color += len(variables)
        frame = self._frame(device, topic) if variables else ''
        comment = '' if device.first('variable') else _VARIABLES
        for variable in variables:
            device.add('variable', {'topic': topic.name.lstrip('/'), 'frame': frame,
                                    **variable.attributes},
                       comment if variable.likely else _CONSTANT, variable.likely)
            comment = '' if variable.likely else comment
        if left_out(topic):
            device.comments.append(f'{topic.name} has {left_out(topic)} more numbers.')
        return any(it.likely for it in variables)

    def _add_states(self, device: DraftDevice, topic: SeenTopic,
                    states: Sequence[StateNumber]) -> None:
        """Add the states that are fields of messages; states of plain topics need no element."""
        for it in states[:MAX_STATES]:
            if it.field != 'data':
                device.add('variable', {'topic': topic.name.lstrip('/'), 'field': it.field,
                                        'frame': self._frame(device, topic), 'label': it.label,
                                        'shown': 'False'})

    def _frame(self, device: DraftDevice, topic: SeenTopic) -> str:
        """Return the frame of an arrow: that of its messages, or the device's base frame."""
        known = [it for it in topic.frames if it in self._known and is_frame(it)]
        base = device.first('base')
        if known or base is not None:
            return known[0] if known else str(base.attributes['frame'] if base else '')
        free = [frame for frame in (*self._called_like(device), *topic.frames)
                if self._can_be_base(frame)]
        moved = [frame for frame in topic.frames if frame in self._forest.frames
                 and is_frame(frame)]
        if moved and not free:
            return moved[0]  # only tf knows its parent
        return self._add_base(device, free[0] if free else f'{device.name}/base')

    def _called_like(self, device: DraftDevice) -> List[str]:
        beginnings = (f'{device.name}/', f'{device.name}_')
        return [frame for frame in sorted(self._forest.children(self._places.frame))
                if frame == device.name or frame.startswith(beginnings)]

    def _can_be_base(self, frame: str) -> bool:
        """Return whether no device has the frame, and its parent is the global frame or none."""
        return (is_frame(frame) and self._names.is_free(frame)
                and self._forest.parent(frame) in (None, self._places.frame))

    def _add_base(self, device: DraftDevice, wanted: str) -> str:
        frame = self._names.frame(wanted)
        attributes, comment = self._places.base_attributes(frame)
        device.elements.insert(0, DraftElement('base', attributes, comment))
        self._known.add(frame)
        return frame

    def _add_display_frames(self, device: DraftDevice, topics: Sequence[SeenTopic]) -> None:
        """Add the frames that displays need: a machine's base and the frames below it."""
        frames = [frame for topic in topics if topic.type in _DISPLAYS for frame in topic.frames
                  if is_frame(frame) and frame in self._forest.frames and frame not in self._known]
        tops = [top_frame(self._forest, frame, self._known) for frame in frames]
        own = [top for top, _ in tops if self._can_be_base(top)]
        if own and device.first('base') is None:
            self._add_base(device, own[0])
        base = device.first('base')
        ends = [base.attributes['frame']] if base is not None else [it for _, it in tops if it]
        if ends:
            add_inner_frames(device, frames, ends[0], self._names, self._forest)

    @staticmethod
    def _add_display(device: DraftDevice, topic: SeenTopic) -> None:
        display = _DISPLAYS.get(topic.type)
        if display is not None:
            device.add('rviz', {'type': display, 'topic': topic.name,
                                'name': topic.name.strip('/')})


_USUAL = (DEFAULT_FRAME, 'map', 'odom')
_OTHER_FRAMES = ('cell', 'cell_world')
_APART_M = 1.5
_LOOKING_AHEAD = (-math.pi / 2, 0.0, -math.pi / 2)
"""Rotation of an optical frame (REP 103) that looks along x."""


def global_frame(forest: FrameForest, links: Collection[str], bases: Collection[str]) -> str:
    """Return the global frame: a root on tf with robots below it or a usual name, or a new frame.

    Args:
        forest: the transforms seen on tf.
        links: frames that belong to models.
        bases: the root links of models.
    """
    roots: Dict[str, int] = {}
    for frame in forest.frames:
        root = forest.path(frame)[-1]
        roots[root] = roots.get(root, 0) + (frame in bases)
    usual = [root for root, count in roots.items() if root not in links and is_frame(root)
             and (count or root in _USUAL or len(forest.children(root)) > 1)]
    if usual:
        return max(sorted(usual), key=lambda root: (root == DEFAULT_FRAME, roots[root],
                                                    root in _USUAL))
    taken = {*links, *forest.frames}
    return next(name for name in _names() if name not in taken)


def _names() -> Iterable[str]:
    yield from (DEFAULT_FRAME, *_OTHER_FRAMES)
    number = 2
    while True:
        yield f'cell_{number}'
        number += 1


class BasePlaces:
    """Poses of base frames in the global frame; frames with an unknown pose are put in a row."""

    def __init__(self, forest: FrameForest, frame: str) -> None:
        self.frame = frame
        self._forest = forest
        self._unknown = 0

    @property
    def remarks(self) -> List[str]:
        """Return advice about unknown poses."""
        if not self._unknown:
            return []
        return ['Devices with an unknown place are put in a row: write xyz in m and ypr (yaw '
                'pitch roll) in rad in their <base>, or use the tab Calibration of the launcher.']

    def of(self, frame: str) -> Tuple[Pose, bool]:
        """Return a frame's pose in the global frame, and whether the pose is known."""
        pose = self._forest.pose(frame, self.frame)
        if pose is not None:
            return pose, True
        self._unknown += 1
        ypr = _LOOKING_AHEAD if 'optical' in frame else (0.0, 0.0, 0.0)
        return Pose((0.0, (self._unknown - 1) * _APART_M, 0.0), ypr), False

    def base_attributes(self, frame: str) -> Tuple[Dict[str, str], str]:
        """Return the attributes of a <base>, and a comment if its pose is unknown."""
        pose, is_known = self.of(frame)
        return {'frame': frame, **pose_attributes(pose)}, '' if is_known else 'place not known'


def pose_attributes(pose: Pose) -> Dict[str, str]:
    """Return xyz and, unless it is zero, ypr as attributes."""
    found = {'xyz': numbers(pose.xyz)}
    if any(pose.ypr):
        found['ypr'] = numbers(pose.ypr)
    return found


def numbers(values: Iterable[float]) -> str:
    """Return numbers as the text of an attribute."""
    return ' '.join(f'{value:.6f}'.rstrip('0').rstrip('.') for value in values)


def top_frame(forest: FrameForest, frame: str, above: Collection[str]) -> Tuple[str, Optional[str]]:
    """Return a frame's highest ancestor below the frames ``above``, and that ancestor's parent.

    The ancestor may be the frame itself. The parent is None at the root of a tree.
    """
    path: List[str] = forest.path(frame)
    for found, carrier in zip(path, path[1:]):
        if carrier in above:
            return found, carrier
    return path[-1], None
