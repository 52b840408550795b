# SPDX-License-Identifier: BSD-3-Clause
"""Arrows with their values: shared by the displays of variables."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence

from visualization_msgs.msg import Marker

from process_visualizer.motion.arrows import line_of_block
from process_visualizer.motion.rotations import Vector
from process_visualizer.nodes.common.markers import (
    TEXT_PERIOD_S,
    Pace,
    VectorSample,
    text_color,
    text_marker,
    vector_arrow,
)
from process_visualizer.parameters.arrow_style import ArrowStyle


class TextPlace(NamedTuple):
    """The place of a text: one line of a block, which several values share."""

    frame: str
    position: Vector  # (3,) [m] of the block's middle in the frame
    line: int = 0
    line_count: int = 1


class ShownValue(NamedTuple):
    """A value as an arrow and a text; namespace is that of its markers."""

    namespace: str
    style: ArrowStyle
    sample: VectorSample
    text: str
    place: TextPlace


class ValueBoard:
    """Makes the markers of values: arrows each time, texts only as often as they can be read."""

    def __init__(self, text_height_m: float, stale_after_s: float) -> None:
        """The height of texts is in m; values older than ``stale_after_s`` are grey."""
        self._text_height_m = text_height_m
        self._stale_after_s = stale_after_s
        self._texts = Pace(TEXT_PERIOD_S)

    def markers(self, values: Sequence[ShownValue], now_s: float,
                wall_s: Optional[float] = None) -> List[Marker]:
        """Return the arrows, and the texts too when it is time for them.

        Args:
            values: the values to show.
            now_s: the present time of the clock that times the values; it may be paused.
            wall_s: the present time of a clock that is never paused, if that is another one.
        """
        markers = [vector_arrow(value.namespace, value.style, value.sample,
                                self._is_stale(value.sample, now_s)) for value in values]
        if self._texts.is_due(now_s if wall_s is None else wall_s):
            markers += [self._text(value, now_s) for value in values]
        return markers

    def _text(self, value: ShownValue, now_s: float) -> Marker:
        place = value.place
        stale = self._is_stale(value.sample, now_s)
        return text_marker(value.namespace, place.frame, place.position,
                           line_of_block(value.text, place.line, place.line_count),
                           self._text_height_m, text_color(None if stale else value.style.color))

    def _is_stale(self, sample: VectorSample, now_s: float) -> bool:
        return sample.age_s(now_s) > self._stale_after_s
