# SPDX-License-Identifier: BSD-3-Clause
"""The display of a robot besides its model: arrows and numbers at the tool."""
from __future__ import annotations

import math
from dataclasses import replace
from typing import Dict, List, NamedTuple, Optional, Tuple

from visualization_msgs.msg import Marker

from process_visualizer.nodes.common.markers import (
    TEXT_PERIOD_S,
    RefreshRate,
    VectorSample,
    deletion,
    text_color,
    text_marker,
    value_text,
    vector_arrow,
)
from process_visualizer.nodes.robot.tool_placing import ToolPlace
from process_visualizer.parameters.reading import Color
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.robot.arrows import ArrowStyle, format_age, label_offset, line_of_block
from process_visualizer.robot.rotations import Vector


class ShownMotion(NamedTuple):
    """The tool's pose, its velocity (3,) [m/s] in the base frame, and the arrival time of its pose.

    There is no velocity until the first positions span some time.
    """

    place: ToolPlace
    velocity: Optional[Vector]
    time_s: float


_NO_JOINTS, _NO_MODEL = 'no joints: its pose is unknown', 'no model: its pose is unknown'


class _Shown(NamedTuple):
    namespace: str
    style: ArrowStyle
    sample: VectorSample


class RobotDisplay:
    """Makes the markers of a robot; none for quantities that are not available."""

    def __init__(self, parameters: RobotParameters, has_model: bool = True) -> None:
        """``parameters`` has frames, styles and places; joints need a model to be shown."""
        self._parameters, self._has_model = parameters, has_model
        self._texts = RefreshRate(TEXT_PERIOD_S)
        self._present: Dict[Tuple[str, int], str] = {}  # RViz's markers, with their frames

    def hurry(self) -> None:
        """Include the numbers in the next markers, however recent the last ones are."""
        self._texts.hurry()

    def markers(self, motion: Optional[ShownMotion], force: Optional[VectorSample], data_s: float,
                wall_s: Optional[float] = None, joints_age_s: Optional[float] = None
                ) -> List[Marker]:
        """Return the arrows, and the numbers if they are due.

        Args:
            motion, force: the last ones; None if unknown.
            data_s: the present time [s] of the clock that times the data; it may be paused.
            wall_s: the present time [s] of a clock that is never paused, if it is another clock.
            joints_age_s: the time since the last joint states [s]; infinite if they do not arrive;
                None if there are none.
        """
        shown = self._shown(motion, force)
        markers = [vector_arrow(entry.namespace, entry.style, entry.sample,
                                self._is_stale(entry.sample.age_s(data_s))) for entry in shown]
        if self._texts.is_due(data_s if wall_s is None else wall_s):
            texts = self._text_lines(shown, data_s, joints_age_s)
            place = self._text_place(motion, force, joints_age_s == math.inf)
            markers += [
                text_marker(namespace, *place, line_of_block(text, line, len(texts)),
                            self._parameters.text.height_m, text_color(color))
                for line, (namespace, text, color) in enumerate(texts) if text]
            markers += self._deletions(markers)
        return markers

    def _shown(self, motion: Optional[ShownMotion],
               force: Optional[VectorSample]) -> List[_Shown]:
        parameters, shown = self._parameters, []
        if motion and motion.velocity is not None:
            place = motion.place
            sample = VectorSample(place.in_frame(motion.velocity), place.frame, motion.time_s,
                                  place.foot)
            shown.append(_Shown('velocity', parameters.velocity_arrow, sample))
        if force:
            if motion and force.frame == parameters.base_frame:  # it acts at the tool
                force = replace(force, vector=motion.place.in_frame(force.vector),
                                frame=motion.place.frame)
            if motion and force.frame == motion.place.frame:  # without a force frame of its own
                force = replace(force, foot=motion.place.foot)
            shown.append(_Shown('force', parameters.force_arrow, force))
        return shown

    def _text_lines(self, shown: List[_Shown], data_s: float, joints_age_s: Optional[float]
                    ) -> List[Tuple[str, str, Optional[Color]]]:
        """Return namespace, text and arrow's color (None: gray) of each line; '' is a gap."""
        lines: Dict[str, Tuple[str, Optional[Color]]] = {}
        for entry in shown:
            age_s = entry.sample.age_s(data_s)
            text = value_text(entry.style, math.hypot(*entry.sample.vector), age_s,
                              self._parameters.stale_after_s)
            lines[entry.namespace] = text, None if self._is_stale(age_s) else entry.style.color
        if joints_age_s is not None and self._is_stale(joints_age_s):
            lines['joints'] = (format_age('joints', joints_age_s) if joints_age_s != math.inf
                               else _NO_JOINTS if self._has_model else _NO_MODEL), None
        names = ('velocity', 'force', 'joints') if 'joints' in lines else ('velocity', 'force')
        return [(name, *lines.get(name, ('', None))) for name in names]

    def _text_place(self, motion: Optional[ShownMotion], force: Optional[VectorSample],
                    is_without_joints: bool) -> Tuple[str, Vector]:
        """Return frame and position of texts: at the tool if its pose is known, else at the arrow.

        Without joints, the base is the only known frame of the robot.
        """
        text = self._parameters.text
        if motion is None and is_without_joints:
            return self._parameters.base_frame, (0.0, 0.0, text.up_m)
        if motion is None:
            frame = force.frame if force else self._parameters.tool_frame
            return frame, (text.outward_m, 0.0, text.up_m)
        place = motion.place
        beside = place.in_frame(label_offset(place.position, text.outward_m, text.up_m))
        return place.frame, [a + b for a, b in zip(place.foot, beside)]

    def _deletions(self, markers: List[Marker]) -> List[Marker]:
        """Return the deletions of markers that are no longer shown."""
        present = {(marker.ns, marker.id): marker.header.frame_id for marker in markers}
        gone = [deletion(*key, frame) for key, frame in self._present.items()
                if key not in present]
        self._present = present
        return gone

    def _is_stale(self, age_s: float) -> bool:
        return age_s > self._parameters.stale_after_s
