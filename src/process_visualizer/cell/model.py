# SPDX-License-Identifier: BSD-3-Clause
"""The cell as data: the content of a configuration file, and differences between two versions.

All defaults are filled in. Lengths are in m, angles in rad. Frame names have no leading slash;
topic names are absolute.
"""
from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from typing import Any, Mapping, Optional, Tuple

from process_visualizer.cell.errors import Location, Problem
from process_visualizer.cell.trust import OPENED, Provenance

Vector3 = Tuple[float, float, float]
Color = Tuple[float, float, float]


class Mode(Enum):
    """The mode in which the system runs."""

    REALTIME = 'realtime'
    PLAYBACK = 'playback'


class DeviceType(Enum):
    """The type of a device, which decides the nodes and displays it gets by default."""

    ROBOT = 'robot'
    DEPTH_SENSOR = 'depth_sensor'
    OTHER = 'other'


class TopicFunction(Enum):
    """The use of a topic, besides recording."""

    JOINT_STATES = 'joint_states'
    TOOL_CENTER_FRAME = 'tool_center_frame'
    FORCE_SENSOR = 'force_sensor'
    POINTCLOUD = 'pointcloud'
    DEPTH_IMAGE = 'depth_image'
    COLOR_IMAGE = 'color_image'
    CAMERA_INFO = 'camera_info'


ROBOT_FUNCTIONS = (TopicFunction.JOINT_STATES, TopicFunction.TOOL_CENTER_FRAME,
                   TopicFunction.FORCE_SENSOR)
IMAGE_FUNCTIONS = (TopicFunction.DEPTH_IMAGE, TopicFunction.COLOR_IMAGE,
                   TopicFunction.CAMERA_INFO)
"""The topics from which the cropped cloud is computed in one pass."""


@dataclass(frozen=True)
class Pose:
    """A pose in a parent frame: xyz in m; yaw, pitch, roll in rad, intrinsic z-y'-x''."""

    xyz: Vector3 = (0.0, 0.0, 0.0)
    ypr: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class BaseFrame:
    """The base frame of a device, posed in the global frame."""

    frame: str
    pose: Pose
    location: Location


@dataclass(frozen=True)
class ForceFrame:
    """The frame of a force sensor, posed in its parent frame."""

    parent_frame: str
    frame: str
    pose: Pose
    location: Location


@dataclass(frozen=True)
class Tool:
    """The tool of a robot: its pose in a link of the model, or another frame."""

    frame: str
    pose: Pose
    location: Location


@dataclass(frozen=True)
class Model:
    """A URDF or xacro file of a package; without a package the path is absolute.

    ``arguments`` are names and values for a xacro file; ``prefix`` is put before the names of
    links. A model ``confined_to`` a folder is data: it is read with limits, and may name only
    files in that folder and in installed packages.
    """

    package: str
    path: str
    location: Location
    arguments: Tuple[Tuple[str, str], ...] = ()
    prefix: str = ''
    confined_to: str = ''


@dataclass(frozen=True)
class RoslaunchElement:
    """An element passed on to roslaunch (param, rosparam, remap, env, machine)."""

    tag: str
    attributes: Mapping[str, str]
    text: str
    location: Location


@dataclass(frozen=True)
class Node:
    """A node to start with a device; ``attributes`` are the remaining roslaunch attributes."""

    package: str
    type: str
    name: str
    namespace: str
    mode: Optional[Mode]
    attributes: Mapping[str, str]
    children: Tuple[RoslaunchElement, ...]
    location: Location


@dataclass(frozen=True)
class LaunchFile:
    """A launch file to include with a device."""

    package: str
    type: str
    mode: Optional[Mode]
    arguments: Tuple[Tuple[str, str], ...]
    location: Location


@dataclass(frozen=True)
class Topic:
    """A topic of a device; ``message_type`` such as ``sensor_msgs/JointState`` or None."""

    name: str
    function: Optional[TopicFunction]
    message_type: Optional[str]
    record: bool
    location: Location
    frame: Optional[str] = None  # for a tf topic: the frame to read
    parent_frame: Optional[str] = None  # of the values, if messages name none
    latency_s: float = 0.0  # time from measurement to stamp, or to arrival


@dataclass(frozen=True)
class Property:
    """A property of an RViz display, with the properties below it."""

    name: str
    value: Optional[str]
    children: Tuple['Property', ...] = ()
    location: Optional[Location] = field(default=None, compare=False)


@dataclass(frozen=True)
class Display:
    """An RViz display; ``topic`` is None for the default topic of the type."""

    type: str
    name: Optional[str]
    topic: Optional[str]
    properties: Tuple[Property, ...]
    children: Tuple['Display', ...]
    location: Location


@dataclass(frozen=True)
class Arrow:
    """The style of an arrow: ``scale`` in m per m/s or m per N, limits of the length in m.

    None means the default of the quantity.
    """

    quantity: str
    scale: Optional[float]
    minimum_m: Optional[float]
    maximum_m: Optional[float]
    color: Optional[Color]
    location: Location
    tolerance: Optional[float] = None
    max_tolerance: Optional[float] = None


@dataclass(frozen=True)
class ColorScale:
    """A color scale, linear from the variable's own color at ``begin`` to another at ``end``."""

    begin: float
    end: float
    end_color: Color


@dataclass(frozen=True)
class WarningLimits:
    """Limits: values below low or above high get the warning color; None: no limit."""

    low: Optional[float]
    high: Optional[float]
    color: Color


@dataclass(frozen=True)
class Variable:
    """A number of a topic, drawn as an arrow of length ``scale * (value - offset)`` m."""

    topic: str
    field: str
    frame: str
    axis: Vector3
    color: Color
    unit: str
    scale: float
    offset: float
    label: str
    location: Location
    offset_param: Optional[str] = None  # a parameter that overrides the offset at any time
    limits: Optional[WarningLimits] = None
    color_scale: Optional[ColorScale] = None
    maximum_m: Optional[float] = None  # length limit
    is_shown: bool = True  # in RViz; does not affect limits and curve
    tolerance: Optional[float] = None  # allowed deviation from a good run
    value_names: Tuple[Tuple[float, str], ...] = ()
    max_tolerance: Optional[float] = None  # limit of the tolerance, even if good runs differ more


@dataclass(frozen=True)
class RegionOfInterest:
    """A box to which a cloud is cropped: center and edge lengths in m, in ``frame``."""

    frame: str
    center: Vector3
    size: Vector3
    location: Location


@dataclass(frozen=True)
class Fusion:
    """The names of the depth sensors whose clouds are joined, and how they are joined."""

    sensors: Tuple[str, ...]
    voxel_m: float
    timeout_s: float
    location: Location


@dataclass(frozen=True)
class SoughtObjects:
    """The search for unmodeled objects in a cloud; without a topic, in the device's own cloud.

    An object nearer to a robot than ``warn_m`` or ``stop_m`` is marked. Level surfaces of at least
    ``surface_m2`` and the contents of ``expected`` boxes are not objects. Without a region, the
    whole cloud is searched.
    """

    warn_m: float
    stop_m: float
    padding_m: float
    surface_m2: float
    topic: Optional[str]
    region: Optional[RegionOfInterest]
    expected: Tuple[RegionOfInterest, ...]
    location: Location
    noise_m: Optional[float] = None  # of depths at 1 m; None: estimated


@dataclass(frozen=True)
class Device:
    """A device of the cell and everything that belongs to it."""

    type: DeviceType
    name: str
    location: Location
    base: Optional[BaseFrame] = None
    model: Optional[Model] = None
    tool: Optional[Tool] = None
    force: Optional[ForceFrame] = None
    roi: Optional[RegionOfInterest] = None
    fusion: Optional[Fusion] = None
    objects: Optional[SoughtObjects] = None
    nodes: Tuple[Node, ...] = ()
    launch_files: Tuple[LaunchFile, ...] = ()
    topics: Tuple[Topic, ...] = ()
    displays: Tuple[Display, ...] = ()
    arrows: Tuple[Arrow, ...] = ()
    variables: Tuple[Variable, ...] = ()
    parameters: Tuple[RoslaunchElement, ...] = ()
    machine: str = ''  # that runs its nodes in real-time mode; empty: this computer

    def topic_for(self, function: TopicFunction) -> Optional[Topic]:
        """Return the topic with this function, if there is one."""
        return next((topic for topic in self.topics if topic.function is function), None)

    def topics_for(self, function: TopicFunction) -> Tuple[Topic, ...]:
        """Return the topics with this function: joints may have several, all others at most one."""
        return tuple(topic for topic in self.topics if topic.function is function)

    @property
    def has_images(self) -> bool:
        """Return whether the device has all images that a cropped cloud is computed from."""
        return self.roi is not None and None not in map(self.topic_for, IMAGE_FUNCTIONS)

    @property
    def has_cloud(self) -> bool:
        """Return whether the device has a cloud: published, computed from images, or joined."""
        return self.has_images or self.fusion is not None \
            or self.topic_for(TopicFunction.POINTCLOUD) is not None

    @property
    def cloud_topic(self) -> Optional[str]:
        """The topic of its cloud (cropped or joined, if applicable), as depth_proc receives it."""
        if self.fusion is not None:
            return f'/{self.name}/fused_points'
        if self.roi is not None and self.has_cloud:
            return f'/{self.name}/roi_points'
        topic = self.topic_for(TopicFunction.POINTCLOUD)
        return None if topic is None else topic.name


@dataclass(frozen=True)
class ProcessEvent:
    """A moment of the process: a number on a topic crosses a threshold.

    The number counts as beyond the threshold only if it stays there for ``lasting_s``, and as back
    only after it has returned by the hysteresis.
    """

    name: str
    topic: str
    field: str
    threshold: float
    is_above: bool
    hysteresis: float
    location: Location
    lasting_s: float = 0.0


@dataclass(frozen=True)
class RunSpan:
    """One run of the process: from one event or mark to another, with some seconds around it.

    ``group`` and ``place`` name the values that select the good runs for comparison; empty: no
    selection.
    """

    begin: str
    end: str
    before_s: float
    after_s: float
    location: Location
    shortest_s: float = 0.0
    group: str = ''
    place: str = ''


@dataclass(frozen=True)
class ProcessPhase:
    """A part of a run, from one event or mark to another; a wait may have any duration."""

    name: str
    begin: str
    end: str
    is_wait: bool
    location: Location


@dataclass(frozen=True)
class Cell:
    """A whole configuration: the devices and the name of the global frame.

    ``files`` are the paths of all files read, ``file`` first; ``arguments`` are values for them as
    given on a command line. ``provenance`` is the origin of the configuration; ``ignored`` lists
    the parts that are ignored because of it.
    """

    file: str
    frame: str
    devices: Tuple[Device, ...]
    machines: Tuple[RoslaunchElement, ...] = ()
    files: Tuple[str, ...] = ()
    arguments: Mapping[str, str] = field(default_factory=dict)
    events: Tuple[ProcessEvent, ...] = ()
    run: Optional[RunSpan] = None
    provenance: Provenance = OPENED
    ignored: Tuple[Problem, ...] = ()
    phases: Tuple[ProcessPhase, ...] = ()

    def device(self, name: str) -> Device:
        """Return the device of that name.

        Raises:
            KeyError: there is no such device.
        """
        for device in self.devices:
            if device.name == name:
                return device
        raise KeyError(name)


@dataclass(frozen=True)
class Changes:
    """Names of devices in the order of the configuration (``removed``: of the old one).

    ``cell_changed`` is true if the global frame or the machines, which belong to no device, differ.
    """

    added: Tuple[str, ...]
    removed: Tuple[str, ...]
    changed: Tuple[str, ...]
    same: Tuple[str, ...]
    cell_changed: bool

    def __bool__(self) -> bool:
        return bool(self.added or self.removed or self.changed or self.cell_changed)


def changes(old: Cell, new: Cell) -> Changes:
    """Compare the contents of two configurations, regardless of their locations in the files.

    The contents of models and launch files are not compared here, but as parts of a plan
    (``Part.digest``).
    """
    before = {device.name: device for device in old.devices}
    after = {device.name: device for device in new.devices}
    kept = [name for name in after if name in before]
    same = [name for name in kept if content(before[name]) == content(after[name])]
    return Changes(
        added=tuple(name for name in after if name not in before),
        removed=tuple(name for name in before if name not in after),
        changed=tuple(name for name in kept if name not in same), same=tuple(same),
        cell_changed=content((old.frame, old.machines)) != content((new.frame, new.machines)))


def content(value: Any) -> Any:
    """Return a piece of the model as tuples and dictionaries, without locations in files."""
    if is_dataclass(value):
        return type(value), {field.name: content(getattr(value, field.name))
                             for field in fields(value)
                             if not isinstance(getattr(value, field.name), Location)}
    if isinstance(value, tuple):
        return tuple(content(item) for item in value)
    if isinstance(value, Mapping):
        return {key: content(item) for key, item in value.items()}
    return value
