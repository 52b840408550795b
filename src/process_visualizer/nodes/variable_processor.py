# SPDX-License-Identifier: BSD-3-Clause
"""The variable processor: shows any number in any topic as an arrow with its value (<variable>)."""
from __future__ import annotations

import math
import sys
from collections import Counter
from dataclasses import replace
from typing import Callable, Dict, List, Optional, Sequence

import rospy
from visualization_msgs.msg import MarkerArray

from process_visualizer.nodes.common.complaints import Complaints, LimitState
from process_visualizer.nodes.common.markers import ShownValue, ValueBoard, ValuePlace, VectorSample
from process_visualizer.nodes.common.newest_message import NewestMessage, RawMessage
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    spin_to_end,
    start_node,
)
from process_visualizer.nodes.common.node_parameters import LiveNumber, private_parameters
from process_visualizer.parameters.reading import Color, ParameterError
from process_visualizer.parameters.variable_parameters import (
    VariableParameters,
    VariablesParameters,
)
from process_visualizer.robot.arrows import (
    FOOT_DISTANCE_M,
    MIN_ARROW_M,
    VARIABLE_DIAMETER_M,
    Number,
    arrow_feet,
    format_age,
    text_position,
    variable_text,
    variable_vector,
)
from process_visualizer.robot.rotations import Vector
from process_visualizer.ros_names import VARIABLE_PROC

_UNJUDGED_AFTER_S = 2.0
"""Age from which a value is no longer judged [s], if its topic usually sends sooner."""


class ShownVariable:
    """A variable's last good value; its topic is read only when it is drawn or judged."""

    def __init__(self, node: NodeHandle, complaints: Complaints, parameters: VariableParameters,
                 source: NewestMessage, foot: Vector = (0.0, 0.0, 0.0)) -> None:
        """``foot`` is where the arrow begins, (3,) [m]."""
        self._complaints = complaints
        self._parameters = parameters
        self._source = source
        self._foot = foot
        self._live_offset = (LiveNumber(node, parameters.offset_param, parameters.offset)
                             if parameters.offset_param else None)
        self._seen: Optional[RawMessage] = None
        self._value: Optional[Number] = None
        self._time_s = -math.inf  # when the value arrived
        self._name = f'{parameters.topic} {parameters.field}'
        self._limits = LimitState(complaints, self._name, parameters.label or self._name,
                                  parameters.colors.limits, parameters.unit)

    @property
    def has_limits(self) -> bool:
        """Return whether the variable has limits."""
        return self._parameters.colors.limits.exist

    def judge(self, now_s: float, age_s: Callable[[float], float]) -> None:
        """Compare the present value with its limits, if it is not stale.

        Args:
            now_s: the present time [s] of a monotonic clock.
            age_s: returns the age [s] of data that arrived at a time.
        """
        self._update()
        if self._value is None:
            return
        if self.is_stale(age_s(self._time_s), _UNJUDGED_AFTER_S):
            self._limits.lose()
        else:
            self._limits.take(now_s, self._value)

    def forget_alarm(self) -> None:
        """End an alarm; the window finds the alarms of a recording by itself."""
        self._limits.forget()

    def sample(self) -> VectorSample:
        """Return the present arrow [m]; it has no length before the first value."""
        self._update()
        parameters = self._parameters
        if self._value is None:
            return VectorSample((0.0, 0.0, 0.0), parameters.frame, self._time_s)
        vector = variable_vector(self._value, self._offset(), parameters.scale_m,
                                 parameters.axis, parameters.max_m)
        return VectorSample(vector, parameters.frame, self._time_s, self._foot)

    def color(self) -> Color:
        """Return the present color of the arrow."""
        colors = self._parameters.colors
        return colors.color if self._value is None else colors.of(self._value)

    def is_stale(self, age_s: float, stale_after_s: float) -> bool:
        """Return whether a value of this age is stale.

        A value that is sent slowly, or only when it changes, stays valid for longer.
        """
        return (age_s > stale_after_s and
                (self._value is None or age_s > self._source.holds_for_s(stale_after_s)))

    def text(self, age_s: float, is_stale: bool) -> str:
        """Return the last value; if it is stale, its age instead."""
        parameters = self._parameters
        if self._value is None:
            return f'{parameters.label} no data'.lstrip()
        if is_stale:
            return format_age(parameters.label, age_s)
        return variable_text(parameters.label, self._value, parameters.unit,
                             self._offset(), parameters.scale_m)

    def _offset(self) -> float:
        return self._parameters.offset if self._live_offset is None else self._live_offset.value()

    def _update(self) -> None:
        raw = self._source.newest()
        if raw is self._seen:
            return
        self._seen = raw
        if raw is None:
            self._value, self._time_s = None, -math.inf
            return
        try:
            self._value = self._number(raw)
            self._time_s = raw.time_s
            self._complaints.note_good(self._name)
        except ValueError as error:
            self._complaints.add(self._name, f'field {self._parameters.field} of '
                                 f'{self._parameters.topic} is not shown: {error}')

    def _number(self, raw: RawMessage) -> Number:
        number = self._parameters.field.number(self._source.decode(raw))
        if not math.isfinite(number):
            raise ValueError(f'its value is {number}; the last good one stays')
        return number


class VariableProcessor:
    """Shows the variables of a device; one subscription for each topic, however many read it."""

    def __init__(self, node: NodeHandle, device: str, parameters: VariablesParameters) -> None:
        """Subscribe, advertise, and start the timer of the markers."""
        shown = [variable for variable in parameters.variables if variable.is_shown]
        hidden = [variable for variable in parameters.variables
                  if not variable.is_shown and variable.colors.limits.exist]
        self._node = node
        self._parameters = replace(parameters, variables=shown)
        self._board = ValueBoard(parameters.text_height_m)
        self._namespaces = marker_namespaces(shown)
        self._playback = PlaybackFollower(node)
        topics = {variable.topic: NewestMessage(node, variable.topic, self._playback)
                  for variable in shown + hidden}
        feet = arrow_feet([(variable.frame, variable.axis) for variable in shown],
                          FOOT_DISTANCE_M)
        complaints = Complaints(node, device)
        self._variables = [ShownVariable(node, complaints, variable, topics[variable.topic], foot)
                           for variable, foot in zip(shown, feet)]
        self._judged = [variable for variable in self._variables if variable.has_limits] + [
            ShownVariable(node, complaints, variable, topics[variable.topic]) for variable in hidden
        ]
        self._publisher = node.publisher('marker_array', MarkerArray, queue_size=1)
        self._timer = node.every(1.0 / parameters.marker_rate_hz, self._on_timer)

    def _on_timer(self) -> None:
        is_playback = self._playback.clock.follows_player(self._node.ros_s())
        for variable in self._judged:
            if is_playback:
                variable.forget_alarm()
            else:
                variable.judge(self._node.monotonic_s(), self._playback.age_s)
        self._show()

    def _show(self) -> None:
        if self._variables and self._publisher.get_num_connections() > 0:
            self._publisher.publish(MarkerArray(self._board.markers(
                self._shown(), self._node.ros_s())))

    def _shown(self) -> List[ShownValue]:
        samples = [variable.sample() for variable in self._variables]
        places = text_places(self._parameters, [sample.vector for sample in samples])
        shown = []
        for namespace, variable, sample, place in zip(
                self._namespaces, self._variables, samples, places):
            length_m, age_s = math.hypot(*sample.vector), self._playback.age_s(sample.time_s)
            is_stale = variable.is_stale(age_s, self._parameters.stale_after_s)
            shown.append(ShownValue(
                namespace, sample, length_m if length_m > MIN_ARROW_M else 0.0,
                VARIABLE_DIAMETER_M, variable.color(), variable.text(age_s, is_stale), place,
                is_stale))
        return shown


def marker_namespaces(variables: Sequence[VariableParameters]) -> List[str]:
    """Return a namespace of markers for each variable, all different: 'variable/LABEL'.

    Other nodes also publish on the device's marker_array, such as a robot's 'force'.
    """
    names = [f'variable/{variable.label or variable.topic.strip("/")}' for variable in variables]
    counts = Counter(names)
    return [name if counts[name] == 1 else f'{name} {number}'
            for number, name in enumerate(names, start=1)]


def text_places(parameters: VariablesParameters, vectors: Sequence[Vector]) -> List[ValuePlace]:
    """Return the position of each variable's text: texts in one frame are lines of one block.

    Args:
        parameters: contain the position of the texts, if it is configured.
        vectors: the arrow of each variable, (3,) [m] in its frame.
    """
    frames = [parameters.text_frame or variable.frame for variable in parameters.variables]
    blocks: Dict[str, List[int]] = {}
    for index, frame in enumerate(frames):
        blocks.setdefault(frame, []).append(index)
    places = []
    for index, frame in enumerate(frames):
        block = blocks[frame]
        position = parameters.text_position or text_position(
            [vectors[member] for member in block], len(block) * parameters.text_height_m)
        places.append(ValuePlace(frame, position, block.index(index), len(block)))
    return places


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    start_node(VARIABLE_PROC)
    device = rospy.get_namespace().strip('/')
    try:
        VariableProcessor(NodeHandle(), device, VariablesParameters.read(private_parameters()))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    spin_to_end()
