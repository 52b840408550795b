# SPDX-License-Identifier: BSD-3-Clause
"""The context menu of a timeline's lane: to hide, overlay and fold."""
from __future__ import annotations

from functools import partial
from typing import Callable, Optional

from PyQt5.QtWidgets import QMenu

from process_visualizer.gui.models.playback.lane_choice import LaneChoice
from process_visualizer.gui.models.playback.lane_choices import LaneChoices
from process_visualizer.gui.views.lanes.timeline_lanes import Lane


def add_lane_actions(menu: QMenu, choices: LaneChoices, lane: Lane, above: Optional[Lane]) -> None:
    """Add actions for a lane that is below another one, or the first."""
    choice = choices.choice

    def add(text: str, change: Callable[[], LaneChoice]) -> None:
        menu.addAction(text, lambda: choices.choose(change()))

    for curve in lane.curves:
        add(f'Hide “{curve.label}”', partial(choice.with_hidden, curve.key))
    for curve in lane.overlaid:
        add(f'A lane of its own for “{curve.label}”', partial(choice.with_own_lane, curve.key))
    if above is not None:
        add(f'Overlay on “{above.label}”', partial(choice.with_joined, lane.key, above.key))
    keys = [curve.key for curve in lane.curves]
    add('Unfold the lane' if lane.is_folded else 'Fold the lane',
        partial(choice.with_folded, keys, not lane.is_folded))
