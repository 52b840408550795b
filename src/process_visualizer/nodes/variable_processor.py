"""The variable processor: any number of any topic as an arrow with its value (<variable>)."""
from __future__ import annotations

import math
import sys
import time
from collections import Counter
from typing import Dict, List, Optional, Sequence

import rospy
from visualization_msgs.msg import MarkerArray

from process_visualizer.motion.arrows import format_age
from process_visualizer.motion.rotations import Vector
from process_visualizer.motion.variables import (
    MAX_LENGTH_M,
    Number,
    text_direction,
    variable_text,
    variable_vector,
)
from process_visualizer.nodes.markers import Pace, VectorSample
from process_visualizer.nodes.message_reader import WARNING_PERIOD_S
from process_visualizer.nodes.newest_message import NewestMessage, RawMessage
from process_visualizer.nodes.parameters import ArrowStyle, ParameterError, private_parameters
from process_visualizer.nodes.value_board import ShownValue, TextPlace, ValueBoard
from process_visualizer.nodes.variable_parameters import VariableParameters, VariablesParameters

SHORTEST_ARROW_M = 0.005  # a shorter one is a mere disc
DIAMETER_M = 0.016
TEXT_GAP_M = 0.04  # from the arrow's foot to the block of texts


class Variable:
    """A variable's last good value; it looks at its topic only when it is drawn."""

    def __init__(self, device: str, parameters: VariableParameters, source: NewestMessage,
                 namespace: str, place: TextPlace) -> None:
        """Take the device's name for messages, the topic, the markers' namespace, the text."""
        self._device = device
        self._parameters = parameters
        self._source = source
        self._namespace = namespace
        self._place = place
        # The vector is in metres already.
        self._style = ArrowStyle(parameters.label, parameters.unit, 0, scale_m=1.0, min_m=0.0,
                                 max_m=MAX_LENGTH_M, threshold=SHORTEST_ARROW_M,
                                 color=parameters.color, diameter_m=DIAMETER_M)
        self._seen: Optional[RawMessage] = None
        self._value: Optional[Number] = None
        self._time_s = -math.inf  # when the value came
        self._warnings = Pace(WARNING_PERIOD_S)

    def show(self, now_s: float, stale_after_s: float) -> ShownValue:
        """Return the arrow and the text of now."""
        self._update()
        parameters = self._parameters
        if self._value is None:
            vector: Vector = (0.0, 0.0, 0.0)
            text = f'{parameters.label} no data'.lstrip()
        else:
            vector = variable_vector(self._value, parameters.offset, parameters.scale_m,
                                     parameters.axis)
            text = variable_text(parameters.label, self._value, parameters.unit,
                                 parameters.offset, parameters.scale_m)
        sample = VectorSample(vector, parameters.frame, self._time_s)
        age_s = sample.age_s(now_s)
        if stale_after_s < age_s < math.inf:
            text = format_age(parameters.label, age_s)
        return ShownValue(self._namespace, self._style, sample, text, self._place)

    def _update(self) -> None:
        raw = self._source.newest()
        if raw is None or raw is self._seen:
            return
        self._seen = raw
        try:
            self._value = self._number(raw)
            self._time_s = raw.time_s
        except ValueError as error:
            self._warn(str(error))

    def _number(self, raw: RawMessage) -> Number:
        number = self._parameters.field.number(self._source.decode(raw))
        if not math.isfinite(number):
            raise ValueError(f'its value is {number}; the last good one stays')
        return number

    def _warn(self, problem: str) -> None:
        if self._warnings.is_due(time.monotonic()):
            rospy.logwarn('%s: field %s of %s is not shown: %s', self._device,
                          self._parameters.field, self._parameters.topic, problem)


class VariableProcessor:
    """Shows the variables of a device; one subscription for each topic, however many read it."""

    def __init__(self, device: str, parameters: VariablesParameters) -> None:
        """Subscribe, advertise, and start the timer of the markers."""
        self._stale_after_s = parameters.stale_after_s
        self._board = ValueBoard(parameters.text_height_m, parameters.stale_after_s)
        variables = parameters.variables
        topics = {variable.topic: NewestMessage(variable.topic) for variable in variables}
        self._variables = [
            Variable(device, variable, topics[variable.topic], namespace, place)
            for variable, namespace, place in zip(
                variables, marker_namespaces(variables), text_places(parameters))]
        self._publisher = rospy.Publisher('marker_array', MarkerArray, queue_size=1)
        self._timer = rospy.Timer(rospy.Duration(1.0 / parameters.marker_rate_hz),
                                  self._on_timer, reset=True)

    def _on_timer(self, _event: rospy.timer.TimerEvent) -> None:
        if self._publisher.get_num_connections() == 0:
            return
        now_s = rospy.get_time()
        shown = [variable.show(now_s, self._stale_after_s) for variable in self._variables]
        self._publisher.publish(MarkerArray(self._board.markers(shown, now_s)))


def marker_namespaces(variables: Sequence[VariableParameters]) -> List[str]:
    """Return a namespace of markers for each variable, all different: 'variable/LABEL'.

    Others publish in the device's marker_array too, such as a robot's 'force'.
    """
    names = [f'variable/{variable.label or variable.topic.strip("/")}' for variable in variables]
    counts = Counter(names)
    return [name if counts[name] == 1 else f'{name} {number}'
            for number, name in enumerate(names, start=1)]


def text_places(parameters: VariablesParameters) -> List[TextPlace]:
    """Return where each variable's text stands: texts in one frame are lines of one block."""
    frames = [parameters.text_frame or variable.frame for variable in parameters.variables]
    members: Dict[str, List[int]] = {}
    for index, frame in enumerate(frames):
        members.setdefault(frame, []).append(index)
    places = []
    for index, frame in enumerate(frames):
        block = members[frame]
        axes = [parameters.variables[member].axis for member in block]
        position = parameters.text_position or _beside(axes, parameters.text_height_m)
        places.append(TextPlace(frame, position, block.index(index), len(block)))
    return places


def _beside(axes: Sequence[Sequence[float]], text_height_m: float) -> List[float]:
    """Return where the middle of a block of texts stands, (3,) [m], beside the arrows' feet."""
    distance_m = TEXT_GAP_M + 0.5 * text_height_m * len(axes)
    return [distance_m * part for part in text_direction(axes)]


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    rospy.init_node('variable_proc')
    device = rospy.get_namespace().strip('/')
    try:
        VariableProcessor(device, VariablesParameters.read(private_parameters()))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    rospy.spin()
