# SPDX-License-Identifier: BSD-3-Clause
"""The private parameters of the robot processor."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Tuple

from process_visualizer.health.staleness import STALE_AFTER_S
from process_visualizer.parameters.reading import Parameters, changed, is_number
from process_visualizer.robot.arrows import FORCE_ARROW, VELOCITY_ARROW, ArrowStyle
from process_visualizer.robot.frames import default_base_frame, default_tool_frame
from process_visualizer.ros_names import JOINT_PROC

_FEET = ('reported', 'tool_frame')  # origins of the arrows


@dataclass(frozen=True)
class TopicParameters:
    """A topic that a node reads; if the name is empty, the robot does not have the quantity."""

    name: str = ''
    message_type: str = ''  # package/Type; empty: the type found on the topic
    frame: str = ''  # the frame to read, for a tf topic
    parent_frame: str = ''  # the frame of the values if the message does not name it
    latency_s: float = 0.0  # time from measurement to stamp, or to arrival

    @staticmethod
    def read(parameters: Parameters) -> 'TopicParameters':
        """Return the topic of a group of parameters."""
        return TopicParameters(parameters.text('name', ''), parameters.text('msg', ''),
                               parameters.frame('frame', ''),
                               parameters.frame('parent_frame', ''),
                               parameters.number('latency', 0.0))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the group of parameters that ``read`` reads; empty for no topic."""
        values = {'name': self.name, 'msg': self.message_type, 'frame': self.frame,
                  'parent_frame': self.parent_frame, 'latency': self.latency_s}
        return {name: value for name, value in values.items() if value}


@dataclass(frozen=True)
class TextParameters:
    """The position of a robot's numbers (see robot.arrows.label_offset), and their size."""

    height_m: float = 0.05
    outward_m: float = 0.08
    up_m: float = 0.3  # enough to clear a wrist


@dataclass(frozen=True)
class RobotParameters:
    """The private parameters of the robot processor."""

    robot_name: str
    base_frame: str
    tool_frame: str
    force_frame: str
    joint_states: TopicParameters = TopicParameters()
    more_joint_states: Tuple[str, ...] = ()  # other topics with joints, such as a gripper's
    tool_center_frame: TopicParameters = TopicParameters()
    force_sensor: TopicParameters = TopicParameters()
    velocity_arrow: ArrowStyle = VELOCITY_ARROW
    force_arrow: ArrowStyle = FORCE_ARROW
    text: TextParameters = field(default_factory=TextParameters)
    marker_rate_hz: float = 30.0
    velocity_window_s: float = 0.2
    stale_after_s: float = STALE_AFTER_S
    foot_at_tool_frame: bool = False  # otherwise arrows begin at the tool that the driver reports
    tool_limit_m: float = 0.01  # above this, a reported tool differs from the model's tool
    tool_limit_rad: float = 0.1
    link_prefix: str = ''  # prefix of the model's link names in the configuration

    @staticmethod
    def read(parameters: Parameters, robot_name: str) -> RobotParameters:
        """Return the checked parameters of the robot processor.

        Args:
            parameters: the node's private parameters.
            robot_name: the device's name, which is the node's namespace.

        Raises:
            ParameterError: a value is wrong.
        """
        topics, arrows, text, limit = (parameters.group(name)
                                       for name in ('topics', 'arrows', 'text', 'tool_limit'))
        tool_frame = parameters.frame('tool_frame', default_tool_frame(robot_name))
        return RobotParameters(
            robot_name=robot_name,
            base_frame=parameters.frame('base_frame', default_base_frame(robot_name)),
            tool_frame=tool_frame,
            force_frame=parameters.frame('force_frame', tool_frame),
            joint_states=TopicParameters.read(topics.group('joint_states')),
            more_joint_states=tuple(topics.texts('more_joint_states')),
            tool_center_frame=TopicParameters.read(topics.group('tool_center_frame')),
            force_sensor=TopicParameters.read(topics.group('force_sensor')),
            velocity_arrow=ArrowStyle.read(arrows.group('velocity'), VELOCITY_ARROW),
            force_arrow=ArrowStyle.read(arrows.group('force'), FORCE_ARROW),
            text=TextParameters(text.number('height', TextParameters.height_m, above=0.0),
                                text.number('outward', TextParameters.outward_m),
                                text.number('up', TextParameters.up_m)),
            marker_rate_hz=parameters.number('marker_rate', RobotParameters.marker_rate_hz,
                                             above=0.0),
            velocity_window_s=parameters.number('velocity_window',
                                                RobotParameters.velocity_window_s, above=0.0),
            stale_after_s=parameters.number('stale_after', STALE_AFTER_S, above=0.0),
            foot_at_tool_frame=parameters.choice('arrow_foot', _FEET) == _FEET[1],
            tool_limit_m=limit.number('position', RobotParameters.tool_limit_m, above=0.0),
            tool_limit_rad=limit.number('angle', RobotParameters.tool_limit_rad, above=0.0),
            link_prefix=parameters.frame('link_prefix', ''),
        )

    def to_parameters(self) -> Dict[str, Any]:
        """Return the frames, and values that differ from the defaults, as ``read`` reads them."""
        topics = {'joint_states': self.joint_states, 'tool_center_frame': self.tool_center_frame,
                  'force_sensor': self.force_sensor}
        arrows = {'velocity': self.velocity_arrow.to_parameters(VELOCITY_ARROW),
                  'force': self.force_arrow.to_parameters(FORCE_ARROW)}
        values: Dict[str, Any] = {
            'base_frame': self.base_frame, 'tool_frame': self.tool_frame,
            **self._optional(),
            'topics': {**{name: topic.to_parameters() for name, topic in topics.items()
                          if topic.name},
                       **changed({'more_joint_states': list(self.more_joint_states)},
                                 {'more_joint_states': []})},
            'arrows': {name: values for name, values in arrows.items() if values}}
        return {name: value for name, value in values.items() if value or name == 'topics'}

    def _optional(self) -> Dict[str, Any]:
        """Return the parameters that few robots have; ``None`` or empty for the others."""
        text, default = self.text, TextParameters()
        limit = {'position': self.tool_limit_m, 'angle': self.tool_limit_rad}
        others = {'marker_rate': self.marker_rate_hz, 'velocity_window': self.velocity_window_s,
                  'stale_after': self.stale_after_s}
        return {
            'arrow_foot': _FEET[1] if self.foot_at_tool_frame else None,
            'link_prefix': self.link_prefix,
            'force_frame': None if self.force_frame == self.tool_frame else self.force_frame,
            'text': changed({'height': text.height_m, 'outward': text.outward_m, 'up': text.up_m},
                            {'height': default.height_m, 'outward': default.outward_m,
                             'up': default.up_m}),
            'tool_limit': changed(limit, {'position': RobotParameters.tool_limit_m,
                                          'angle': RobotParameters.tool_limit_rad}),
            **changed(others, {'marker_rate': RobotParameters.marker_rate_hz,
                               'velocity_window': RobotParameters.velocity_window_s,
                               'stale_after': RobotParameters.stale_after_s})}


JOINT_OFFSETS = f'{JOINT_PROC}/joint_offsets'
"""Joint offsets: name in the robot's namespace; joint_proc (C++) reads ~joint_offsets."""


JOINT_LATENCIES = f'{JOINT_PROC}/latencies'
"""Latencies [s] of joint_proc's topics, in their order: name in the robot's namespace.

The parameter is not set if there are none.
"""


def usable_latencies(values: Any, count: int) -> List[float]:
    """Return the latencies [s] of ``count`` topics; zeros if joint_proc would refuse the values."""
    usable = isinstance(values, list) and len(values) == count and all(map(is_number, values))
    return [float(it) for it in values] if usable else [0.0] * count


def usable_offsets(values: Any) -> Dict[str, float]:
    """Return the offsets [rad or m] by joint name, without those that joint_proc would refuse."""
    if not isinstance(values, Mapping):
        return {}
    return {name: float(value) for name, value in values.items() if is_number(value)}
