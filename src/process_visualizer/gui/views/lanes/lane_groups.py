# SPDX-License-Identifier: BSD-3-Clause
"""Puts the curves that share a lane into it, each with a colour of its own."""
from __future__ import annotations

import math
from dataclasses import replace
from typing import List, Mapping, Sequence, Tuple

from process_visualizer.curves.position_values import Key
from process_visualizer.gui.models.playback.lane_choice import LaneChoice
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

Colour = Tuple[float, float, float]

_OTHERS: Tuple[Colour, ...] = (
    (0.0, 0.45, 0.70), (0.90, 0.60, 0.0), (0.80, 0.47, 0.65), (0.0, 0.62, 0.45), (0.84, 0.37, 0.0),
    (0.34, 0.71, 0.91), (0.45, 0.30, 0.75), (0.50, 0.50, 0.50))
"""Those of Okabe and Ito, "Color universal design", told apart by colour-blind people too."""
_DISTINCT = 0.45  # between two colours in a cube with sides of 1


def grouped_lanes(curves: Mapping[Key, Lane], choice: LaneChoice) -> List[Lane]:
    """Return the lanes that are shown: the first curve of each, with the others over it."""
    lanes = []
    for keys in choice.lanes(tuple(curves)):
        shown = [curve for curve in distinct([curves[key] for key in keys])
                 if curve.key not in choice.hidden]
        if shown:
            lanes.append(replace(shown[0], overlaid=tuple(shown[1:]),
                                 is_folded=choice.is_folded(keys)))
    return lanes


def distinct(curves: Sequence[Lane]) -> List[Lane]:
    """Return curves of which a later one does not have the colour of an earlier one."""
    found: List[Lane] = []
    for curve in curves:
        used = [it.colour for it in found]
        colour = curve.colour
        if used and _distance(colour, used) < _DISTINCT:
            colour = max(_OTHERS, key=lambda it: _distance(it, used))
        found.append(replace(curve, colour=colour))
    return found


def _distance(colour: Colour, used: Sequence[Colour]) -> float:
    """Return how far a colour is from the nearest one that is used."""
    return min(math.dist(colour, it) for it in used)
