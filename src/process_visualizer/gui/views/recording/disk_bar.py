# SPDX-License-Identifier: BSD-3-Clause
"""The free space on the disk, and the remaining recording time."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QVBoxLayout, QWidget

from process_visualizer.gui.toolkit.theme_following import colour, set_sheet
from process_visualizer.gui.views.parts.labels import small
from process_visualizer.health.figures import long_time_text, size_text

_HEIGHT_PX = 5
_STEPS = 1000


class DiskBar(QWidget):
    """A thin bar for the used space, with free space and remaining time below it."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._bar = QProgressBar()
        self._bar.setObjectName('disk_bar')
        self._bar.setTextVisible(False)
        self._bar.setRange(0, _STEPS)
        self._bar.setFixedHeight(_HEIGHT_PX)
        self._room = small(QLabel())
        self._room.setObjectName('disk_room')
        self._time = small(QLabel())
        self._time.setObjectName('disk_time_left')
        row = QHBoxLayout()
        row.addWidget(self._room)
        row.addStretch(1)
        row.addWidget(self._time)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3)
        layout.addWidget(self._bar)
        layout.addLayout(row)
        colour(self._room, 'quiet')
        self._paint(False)

    def show_room(self, free_bytes: Optional[int], total_bytes: Optional[int],
                  time_left_s: Optional[float], is_low: bool) -> None:
        """Show the free space; ``is_low`` warns."""
        is_known = free_bytes is not None and bool(total_bytes)
        used = 1.0 - (free_bytes or 0) / (total_bytes or 1) if is_known else 0.0
        self._bar.setValue(round(used * _STEPS))
        self._room.setText('' if free_bytes is None else f'{size_text(free_bytes)} free')
        left = '' if time_left_s is None else long_time_text(time_left_s)
        self._time.setText(f'<b>The disk is full in {left}</b>' if is_low
                           else f'{left} left at this rate' if left else '')
        colour(self._time, 'bad' if is_low else 'quiet')
        self._paint(is_low)

    def _paint(self, is_low: bool) -> None:
        filled = '<bad>' if is_low else '<used>'
        set_sheet(self._bar, 'QProgressBar { border: 0; border-radius: 2px; background: <line>; }'
                  f'QProgressBar::chunk {{ border-radius: 2px; background: {filled}; }}')
