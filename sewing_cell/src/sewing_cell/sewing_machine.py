# SPDX-License-Identifier: BSD-3-Clause
"""The sewing machine in RViz: its model, the feed rate, and the edges of the covers."""
from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import partial
from typing import Dict, List, Optional, Tuple

import numpy as np
import rospy
from std_msgs.msg import Float32, UInt16
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.nodes.common.markers import (
    RefreshRate,
    ShownValue,
    ValueBoard,
    ValuePlace,
    VectorSample,
    mesh_marker,
    value_text,
)
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    spin_to_end,
    start_node,
)
from process_visualizer.nodes.common.node_parameters import LiveNumber, private_parameters
from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.robot.arrows import ArrowStyle, offset_words

FEED_TOPIC = '/feed_rate_est'
EDGE_TOPICS = {'upper': '/edge_finder_upper', 'lower': '/edge_finder_lower'}
MESH = 'package://sewing_cell/meshes/sewing_machine.dae'
LOG_PERIOD_S = 5.0
DEFAULT_SETPOINT = 255.0  # of 512 (thesis section 6.2.3)

# Axes of the needle frame, which is yawed by +90 degrees: x is against the feed, y is to the right
# as seen along the feed.
FEED_DIRECTION = np.array([-1.0, 0.0, 0.0])
RIGHT = np.array([0.0, 1.0, 0.0])

FEED_ARROW = ArrowStyle('feed', 'm/s', 3, scale_m=3.0, min_m=0.05, max_m=0.3, threshold=0.001,
                        color=(0.65, 0.2, 0.9, 1.0))
LOWER_ARROW = ArrowStyle('lower edge', '', 0, scale_m=0.003, min_m=0.04, max_m=0.3, threshold=4.0,
                         color=(1.0, 0.9, 0.0, 1.0))
UPPER_ARROW = ArrowStyle('upper edge', '', 0, scale_m=0.003, min_m=0.04, max_m=0.3, threshold=4.0,
                         color=(0.0, 0.9, 1.0, 1.0))


@dataclass(frozen=True)
class SewingParameters:
    """The node's private parameters; positions are in the needle frame [m]."""

    mesh: str
    base_frame: str
    needle_frame: str
    feed_arrow: ArrowStyle
    upper_arrow: ArrowStyle
    lower_arrow: ArrowStyle
    text_position: Tuple[float, float, float]
    text_height_m: float
    marker_rate_hz: float

    @staticmethod
    def read(parameters: Parameters) -> 'SewingParameters':
        """Return the checked parameters.

        Raises:
            ParameterError: a value is wrong.
        """
        arrows, text = parameters.group('arrows'), parameters.group('text')
        return SewingParameters(
            mesh=parameters.text('mesh', MESH),
            base_frame=parameters.frame('base_frame', 'sewing_machine/base'),
            needle_frame=parameters.frame('needle_frame', 'sewing_machine/needle'),
            feed_arrow=ArrowStyle.read(arrows.group('feed_rate'), FEED_ARROW),
            upper_arrow=ArrowStyle.read(arrows.group('edge_upper'), UPPER_ARROW),
            lower_arrow=ArrowStyle.read(arrows.group('edge_lower'), LOWER_ARROW),
            text_position=text.vector('position', (0.0, 0.0, 0.55)),
            text_height_m=text.number('height', 0.05, above=0.0),
            marker_rate_hz=parameters.number('marker_rate', 30.0, above=0.0),
        )


def edge_vector(value: float, setpoint: float) -> np.ndarray:
    """Return the deviation of an edge from its setpoint, (3,) in the needle frame, in counts.

    A value above the setpoint means that the workpiece is too far to the right as seen along the
    feed (thesis figure 6.13); the arrow points to that side.
    """
    return RIGHT * (value - setpoint)


def edge_text(style: ArrowStyle, value: float, setpoint: float, age_s: float,
              stale_after_s: float) -> str:
    """Return, for instance, 'upper edge 263, 8 above 255': the value beside its setpoint."""
    text = value_text(style, value, age_s, stale_after_s)
    if age_s > stale_after_s:
        return text
    return f'{text}, {offset_words(value - setpoint, setpoint, 0)}'


@dataclass(frozen=True)
class SensorReading:
    """The last number of a sensor, and its time of receipt."""

    value: float
    time_s: float


class SewingTransformer:
    """Turns the sewing machine's measurements into markers (thesis section 6.2.3)."""

    STALE_AFTER_S = 1.0
    # Feet of the arrows in the needle frame: beside the needle and in front of the machine's bed,
    # the upper edge above the covers and the lower edge below them.
    FEED_FOOT = np.array([0.12, -0.10, 0.04])
    UPPER_FOOT = np.array([0.12, 0.0, 0.05])
    LOWER_FOOT = np.array([0.18, 0.0, -0.05])

    def __init__(self, node: NodeHandle, parameters: SewingParameters) -> None:
        """Advertise, subscribe, and show the machine."""
        self._node = node
        self._parameters = parameters
        self._setpoints = {which: LiveNumber(node, f'setpoint_{which}', DEFAULT_SETPOINT)
                           for which in ('upper', 'lower')}
        self._playback = PlaybackFollower(node)
        self._log = RefreshRate(LOG_PERIOD_S)
        self._board = ValueBoard(parameters.text_height_m)
        self._feed: Optional[SensorReading] = None
        self._edges: Dict[str, SensorReading] = {}
        self._publisher = node.publisher('marker_array', MarkerArray, queue_size=1, latch=True)
        self._publish()
        node.subscribe(FEED_TOPIC, Float32, self._on_feed)
        for which, topic in EDGE_TOPICS.items():
            node.subscribe(topic, UInt16, partial(self._on_edge, which))
        node.every(1.0 / parameters.marker_rate_hz, self._on_timer)

    def _on_feed(self, message: Float32) -> None:
        if not np.isfinite(message.data):
            if self._log.is_due(self._node.monotonic_s()):
                self._node.warn(f'sewing_machine: {FEED_TOPIC} is NaN or infinite; the last good '
                                'value stays')
            return
        self._feed = SensorReading(message.data, self._playback.data_time_s())

    def _on_edge(self, which: str, message: UInt16) -> None:
        self._edges[which] = SensorReading(float(message.data), self._playback.data_time_s())

    def _on_timer(self) -> None:
        if self._publisher.get_num_connections() > 0:
            self._publish()

    def _publish(self) -> None:
        self._publisher.publish(MarkerArray(self._build_markers()))

    def _build_markers(self) -> List[Marker]:
        """Return the machine and the arrows, and the numbers when they are due."""
        shown = [self._feed_display(), self._edge_display('upper', 1),
                 self._edge_display('lower', 2)]
        markers = self._board.markers([value for value in shown if value], self._node.ros_s())
        if self._parameters.mesh:
            markers.append(mesh_marker('machine', self._parameters.base_frame,
                                       self._parameters.mesh))
        return markers

    def _feed_display(self) -> Optional[ShownValue]:
        if self._feed is None:
            return None
        style = self._parameters.feed_arrow
        sample = VectorSample(FEED_DIRECTION * self._feed.value, self._parameters.needle_frame,
                              self._feed.time_s, self.FEED_FOOT)
        age_s = self._age_s(FEED_TOPIC, sample)
        text = value_text(style, self._feed.value, age_s, self.STALE_AFTER_S)
        return self._shown('feed_rate', style, sample, text, 0, age_s)

    def _edge_display(self, which: str, line: int) -> Optional[ShownValue]:
        upper = which == 'upper'
        edge = self._edges.get(which)
        if edge is None:
            return None
        style = self._parameters.upper_arrow if upper else self._parameters.lower_arrow
        setpoint = self._setpoints[which].value()
        sample = VectorSample(edge_vector(edge.value, setpoint), self._parameters.needle_frame,
                              edge.time_s, self.UPPER_FOOT if upper else self.LOWER_FOOT)
        age_s = self._age_s(EDGE_TOPICS[which], sample)
        text = edge_text(style, edge.value, setpoint, age_s, self.STALE_AFTER_S)
        return self._shown(f'edge_{which}', style, sample, text, line, age_s)

    def _age_s(self, topic: str, sample: VectorSample) -> float:
        """Return the age of a value; infinite at a position before the topic's first message."""
        has_begun = self._playback.has_begun(self._node.resolve(topic))
        return self._playback.age_s(sample.time_s) if has_begun else math.inf

    def _shown(self, namespace: str, style: ArrowStyle, sample: VectorSample, text: str,
               line: int, age_s: float) -> ShownValue:
        """Return an arrow, with its text on one of the machine's three lines."""
        place = ValuePlace(self._parameters.needle_frame, self._parameters.text_position, line, 3)
        return ShownValue(namespace, sample, style.length_m(sample.vector), style.diameter_m,
                          style.color, text, place, age_s > self.STALE_AFTER_S)


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    start_node('sewing_machine')
    try:
        SewingTransformer(NodeHandle(), SewingParameters.read(private_parameters()))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    spin_to_end()
