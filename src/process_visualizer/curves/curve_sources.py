# SPDX-License-Identifier: BSD-3-Clause
"""Decides which process variables of a cell are drawn as curves, and in which colors."""
from __future__ import annotations

from enum import Enum
from typing import List, NamedTuple, Optional, Sequence, Set, Tuple

from process_visualizer.cell.model import (
    Color,
    Device,
    DeviceType,
    Topic,
    TopicFunction,
    Variable,
    WarningLimits,
)
from process_visualizer.cell.values import COLORS
from process_visualizer.robot.arrows import FORCE_COLOR, VELOCITY_COLOR
from process_visualizer.robot.tool_frame import pose_frames

_PLAIN_COLORS: Tuple[Color, ...] = (
    (0.0, 0.75, 0.8), (0.9, 0.75, 0.0), (0.6, 0.2, 0.8), COLORS['orange'], (0.3, 0.5, 0.9))
"""Colors of topics without one; the thesis uses them for upper edge, lower edge and feed."""


class Quantity(Enum):
    """The quantity that a curve shows of a topic."""

    SPEED = 'speed'  # m/s, from the poses of a tool
    FORCE = 'force'  # N, magnitude
    NUMBER = 'number'  # a field
    JOINT = 'joint'  # rad or m; the last of the numbers found
    LAG = 'lag'  # rad or m; how far a joint is behind its command
    TORQUE = 'torque'  # Nm, magnitude


_CHANNEL_LABELS = {Quantity.SPEED: 'tool speed', Quantity.FORCE: 'tool force'}


class CurveSource(NamedTuple):
    """The source of a curve; an empty ``message_type`` accepts any type.

    ``field`` is the message field of a number. ``frames`` are the base and the tool frame of a pose
    from tf; with a ``model``, the tool is that of the model: see tool_on_tf. For a tool whose
    driver sends no poses, the topic is that of the robot's joints, from which its position is
    computed. A ``plain`` source is one without configuration: it has a curve only if its topic
    carries plain numbers. ``tolerance`` is the allowed distance from good runs, ``max_tolerance`` a
    hard limit on it; ``value_names`` are names of some values. Numbers were measured ``latency_s``
    before their stamp, or before their arrival.
    """

    device: str
    label: str
    unit: str
    color: Color
    quantity: Quantity
    topic: str
    message_type: str = ''
    field: str = ''
    frames: Tuple[str, str] = ('', '')
    model: str = ''
    plain: bool = False
    limits: Optional[WarningLimits] = None
    tolerance: Optional[float] = None
    value_names: Tuple[Tuple[float, str], ...] = ()
    max_tolerance: Optional[float] = None
    latency_s: float = 0.0

    @property
    def channel_label(self) -> str:
        """Return the label used in runs, which may be longer than that beside arrows and curves."""
        return _CHANNEL_LABELS.get(self.quantity, self.label)


def curve_sources(devices: Sequence[Device]) -> Tuple[CurveSource, ...]:
    """Return the sources of the curves of devices, in the order of the devices.

    These are each robot's tool speed and force, in the colors of its arrows; every variable; and
    the recorded topics without a function, if their messages carry one plain number.
    """
    sources: List[CurveSource] = []
    for device in devices:
        if device.type is DeviceType.ROBOT:
            sources += _robot_sources(device)
        sources += [_variable_source(device, variable) for variable in device.variables]
    return tuple(sources + _plain_sources(devices, {source.topic for source in sources}))


def _robot_sources(device: Device) -> List[CurveSource]:
    sources = []
    tool = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    if tool is not None:
        sources.append(_quantity_source(device, tool, Quantity.SPEED, 'v', 'm/s')._replace(
            frames=pose_frames(device, None), model='' if tool.frame else _model(device)))
    elif tool_from_joints(device):
        joints = device.topic_for(TopicFunction.JOINT_STATES)
        assert joints is not None
        sources.append(_quantity_source(device, joints, Quantity.SPEED, 'v', 'm/s')._replace(
            model=_model(device)))
    force = device.topic_for(TopicFunction.FORCE_SENSOR)
    if force is not None:
        sources.append(_quantity_source(device, force, Quantity.FORCE, 'F', 'N'))
    return sources


def tool_from_joints(device: Device) -> bool:
    """Return whether a robot's tool is located by model and joints, as no topic has its pose."""
    return (device.topic_for(TopicFunction.TOOL_CENTER_FRAME) is None
            and device.topic_for(TopicFunction.JOINT_STATES) is not None
            and device.model is not None)


def _model(device: Device) -> str:
    return '' if device.model is None else f'{device.model.package}/{device.model.path}'


def _quantity_source(device: Device, topic: Topic, quantity: Quantity, label: str,
                     unit: str) -> CurveSource:
    arrow, color = (('velocity', VELOCITY_COLOR) if quantity is Quantity.SPEED
                    else ('force', FORCE_COLOR))
    given = next((it for it in device.arrows if it.quantity == arrow), None)
    if given is not None and given.color is not None:
        color = given.color
    return CurveSource(device.name, label, unit, color, quantity, topic.name,
                       topic.message_type or '', latency_s=topic.latency_s,
                       tolerance=None if given is None else given.tolerance,
                       max_tolerance=None if given is None else given.max_tolerance)


def _variable_source(device: Device, variable: Variable) -> CurveSource:
    return CurveSource(device.name, variable.label or variable.topic.strip('/'), variable.unit,
                       variable.color, Quantity.NUMBER, variable.topic, field=variable.field,
                       limits=variable.limits, tolerance=variable.tolerance,
                       value_names=variable.value_names, max_tolerance=variable.max_tolerance)


def _plain_sources(devices: Sequence[Device], taken: Set[str]) -> List[CurveSource]:
    topics = {topic.name: (device, topic) for device in reversed(devices)
              for topic in reversed(device.topics)
              if topic.record and topic.function is None and topic.name not in taken}
    return [CurveSource(device.name, topic.name.strip('/'), '', _PLAIN_COLORS[0],
                        Quantity.NUMBER, topic.name, topic.message_type or '', 'data', plain=True)
            for device, topic in reversed(list(topics.values()))]


def plain_color(number: int) -> Color:
    """Return the color of the plain curve with this number."""
    return _PLAIN_COLORS[number % len(_PLAIN_COLORS)]
