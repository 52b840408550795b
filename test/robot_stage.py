# SPDX-License-Identifier: BSD-3-Clause
"""A robot processor on a simulated clock: the test drives the robot and checks the output."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from rospy import Time
from simulated_node import SimulatedNode
from std_msgs.msg import Float32MultiArray, Header
from visualization_msgs.msg import Marker

from process_visualizer.nodes.common.complaints import DIAGNOSTICS
from process_visualizer.nodes.robot_processor import RobotProcessor
from process_visualizer.parameters.reading import Parameters
from process_visualizer.parameters.robot_parameters import RobotParameters

MODELS = Path(__file__).resolve().parent / 'ros'
DRIVER_HZ = 125.0
_NUMBER = re.compile(r'-?\d+\.\d+')


def array(*values: float) -> Float32MultiArray:
    """Return the thesis' message for a quantity."""
    return Float32MultiArray(data=values)


def transform(parent: str, child: str, stamp_s: float, *place: float, turn: float = 0.0
              ) -> TransformStamped:
    """Return a transform: its translation (3,) [m], and a turn [rad] about z."""
    message = TransformStamped(header=Header(stamp=Time.from_sec(stamp_s), frame_id=parent),
                               child_frame_id=child)
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = place or (0.0, 0.0, 0.0)
    rotation.z, rotation.w = np.sin(turn / 2.0), np.cos(turn / 2.0)
    return message


class RobotStage:
    """A robot with its processor, and the output for RViz and other subscribers."""

    def __init__(self, parameters: Mapping[str, Any], name: str = 'r', model: str = '',
                 node: Optional[SimulatedNode] = None) -> None:
        """``parameters`` are the private ones; ``model`` is a URDF, or the name of a file."""
        self.node = node or SimulatedNode(f'/{name}/robot_proc')
        if model:
            self.node.params[f'/{name}/robot_description'] = (
                model if model.startswith('<') else (MODELS / model).read_text())
        self.processor = RobotProcessor(self.node, RobotParameters.read(
            Parameters(dict(parameters), self.node.name), name))

    def run(self, duration_s: float, *drivers: Callable[[float], None], hz: float = DRIVER_HZ
            ) -> None:
        """Let time pass, and call drivers at a rate with the time [s] since the beginning."""
        begin_s = self.node.now_s
        for tick in range(round(duration_s * hz)):
            self.node.advance(begin_s + tick / hz - self.node.now_s)
            for driver in drivers:
                driver(tick / hz)
        self.node.advance(begin_s + duration_s - self.node.now_s)

    def send(self, topic: str, message: Any) -> None:
        """Send a message."""
        self.node.send(topic, message)

    def forget(self) -> None:
        """Discard all published messages."""
        for publisher in self.node.publishers.values():
            publisher.messages.clear()

    @property
    def arrays(self) -> List[Any]:
        """Return all arrays of markers."""
        return self.node.sent('marker_array')

    def markers(self) -> Dict[Tuple[str, int], Marker]:
        """Return the last message of each marker."""
        return {(marker.ns, marker.id): marker for message in self.arrays
                for marker in message.markers}

    def text(self, namespace: str = 'velocity') -> str:
        """Return the line of text beside the robot; '' if there is none."""
        marker = self.markers().get((namespace, 1))
        shown = marker is not None and marker.action == Marker.ADD
        return marker.text.strip() if shown else ''

    def speed(self) -> Optional[float]:
        """Return the number [m/s] beside the arrow; None if there is none."""
        text = self.text()
        found = _NUMBER.search(text) if text.endswith(' m/s') else None
        return float(found[0]) if found else None

    @property
    def twists(self) -> List[Any]:
        """Return all published velocities."""
        return self.node.sent('tool_velocity')

    def velocities(self, last: Optional[int] = None) -> np.ndarray:
        """Return the last published velocities (n, 3) [m/s]."""
        linear = [message.twist.linear for message in self.twists[-last if last else None:]]
        return np.array([[part.x, part.y, part.z] for part in linear]).reshape(-1, 3)

    def velocity(self) -> Optional[np.ndarray]:
        """Return the last published velocity (3,) [m/s]."""
        return self.velocities(1)[0] if self.twists else None

    def warnings(self, *parts: str) -> List[str]:
        """Return the warnings with all these parts."""
        return [text for level, text in self.node.log
                if level == 'warn' and all(part in text for part in parts)]

    def reports(self, *parts: str) -> List[DiagnosticStatus]:
        """Return the entries of /diagnostics with all these parts in their name and message."""
        return [status for message in self.node.sent(DIAGNOSTICS) for status in message.status
                if all(part in f'{status.name} {status.message}' for part in parts)]


def direction(marker: Marker) -> np.ndarray:
    """Return the direction of an arrow in its frame (3,)."""
    turn = marker.pose.orientation
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])


def moving_tool(stage: RobotStage, topic: str, velocity: Sequence[float],
                begin: Sequence[float] = (-0.6, 0.0, 0.2)) -> Callable[[float], None]:
    """Return a driver of a tool that points down and moves at constant velocity [m/s]."""
    def drive(time_s: float) -> None:
        place = np.add(begin, np.multiply(velocity, time_s))
        stage.send(topic, array(*place, np.pi, 0.0, 0.0))
    return drive
