# SPDX-License-Identifier: BSD-3-Clause
"""The context menu for a moment of the recording."""
from __future__ import annotations

from typing import Callable

from PyQt5.QtWidgets import QMenu, QWidget

from process_visualizer.gui.models.playback.playback_model import PlaybackModel
from process_visualizer.gui.views.playback.timeline_zoom import TimelineZoom
from process_visualizer.playback.time_text import format_time


def timeline_menu(parent: QWidget, playback: PlaybackModel, zoom: TimelineZoom, time_s: float,
                  add_mark: Callable[[], None]) -> QMenu:
    """Return the menu for a time [s]; not opened yet."""
    menu = QMenu(parent)
    menu.setObjectName('timeline_menu')
    menu.addAction(f'Go to {format_time(time_s)}', lambda: playback.seek(time_s))
    menu.addSeparator()
    menu.addAction('Loop from here (A)', lambda: playback.set_loop_begin(time_s))
    menu.addAction('Loop to here (B)', lambda: playback.set_loop_end(time_s))
    menu.addAction('Remove A and B', playback.clear_loop)
    menu.addSeparator()
    menu.addAction('Add a mark here…', add_mark)
    menu.addSeparator()
    bounds = playback.loop_points.bounds(playback.duration_s)
    part = menu.addAction('Show A to B only', lambda: zoom.show_part(*bounds))
    part.setEnabled(bounds != (0.0, playback.duration_s))
    everything = menu.addAction('Show the whole recording (double click)', zoom.show_all)
    everything.setEnabled(not zoom.shown.is_all)
    return menu
