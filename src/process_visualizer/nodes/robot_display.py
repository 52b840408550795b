"""What RViz shows of a robot besides its model: arrows and numbers at the tool."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Tuple

import numpy as np
from visualization_msgs.msg import Marker

from process_visualizer.motion.arrows import label_position, line_of_block
from process_visualizer.motion.rotations import Vector
from process_visualizer.nodes.markers import (
    TEXT_PERIOD_S,
    Pace,
    VectorSample,
    text_color,
    text_marker,
    value_text,
    vector_arrow,
)
from process_visualizer.nodes.parameters import ArrowStyle, RobotParameters
from process_visualizer.nodes.robot_messages import ToolPose


class ToolMotion(NamedTuple):
    """The tool's last pose and velocity (3,) [m/s] in the base frame, and when the pose came.

    There is no velocity before the first positions span a time.
    """

    pose: ToolPose
    velocity: Optional[np.ndarray]
    time_s: float


class RobotDisplay:
    """Makes the markers of a robot; nothing for what is not available."""

    def __init__(self, parameters: RobotParameters) -> None:
        """Take frames, styles and places."""
        self._parameters = parameters
        self._texts = Pace(TEXT_PERIOD_S)

    def markers(self, motion: Optional[ToolMotion], force: Optional[VectorSample],
                now_s: float) -> List[Marker]:
        """Return the arrows, and the numbers too when it is time for them."""
        parameters = self._parameters
        shown: List[Tuple[str, int, ArrowStyle, VectorSample]] = []
        if motion and motion.velocity is not None:
            velocity = motion.pose.rotation().T @ motion.velocity
            sample = VectorSample(velocity, parameters.tool_frame, motion.time_s)
            shown.append(('velocity', 0, parameters.velocity_arrow, sample))
        if force:
            shown.append(('force', 1, parameters.force_arrow, force))
        markers = [vector_arrow(namespace, style, sample, self._is_stale(sample, now_s))
                   for namespace, _, style, sample in shown]
        if self._texts.is_due(now_s):
            markers += [self._text(namespace, line, style, sample, motion, now_s)
                        for namespace, line, style, sample in shown]
        return markers

    def _text(self, namespace: str, line: int, style: ArrowStyle, sample: VectorSample,
              motion: Optional[ToolMotion], now_s: float) -> Marker:
        """Return a number in one line of the robot's two."""
        frame, position = self._text_place(sample, motion)
        text = value_text(style, math.hypot(*sample.vector), sample.age_s(now_s),
                          self._parameters.stale_after_s)
        color = text_color(None if self._is_stale(sample, now_s) else style.color)
        return text_marker(namespace, frame, position, line_of_block(text, line, 2),
                           self._parameters.text.height_m, color)

    def _text_place(self, sample: VectorSample,
                    motion: Optional[ToolMotion]) -> Tuple[str, Vector]:
        """Return frame and position: at the tool where its pose is known, else at the arrow."""
        text = self._parameters.text
        if motion is None:
            return sample.frame, (text.outward_m, 0.0, text.up_m)
        return self._parameters.tool_frame, label_position(
            np.asarray(motion.pose.position), motion.pose.rotation(), text.outward_m, text.up_m)

    def _is_stale(self, sample: VectorSample, now_s: float) -> bool:
        return sample.age_s(now_s) > self._parameters.stale_after_s
