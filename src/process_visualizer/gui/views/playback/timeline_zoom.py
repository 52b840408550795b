# SPDX-License-Identifier: BSD-3-Clause
"""The part of the recording that the timeline shows, with the strip that moves it."""
from __future__ import annotations

from PyQt5.QtCore import QObject, QPoint, QRect, Qt, pyqtSignal
from PyQt5.QtWidgets import QWidget

from process_visualizer.gui.toolkit.shown_time import ShownTime, whole
from process_visualizer.gui.views.playback.minimap import HEIGHT, Minimap

BAR_HEIGHT = HEIGHT + 2
_STEP = 1.25
"""One notch of a wheel, or one press of a key, zooms by this factor."""
_NOTCH = 120  # eighths of a degree, as Qt reports one notch
_MOVED_SHARE = 0.15  # of the shown time: the movement for a notch
_PARTS = 1_000_000  # of the recording: the steps of the strip


class TimelineZoom(QObject):
    """Everything is shown until the operator zooms in."""

    changed = pyqtSignal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._shown = whole(0.0)
        self._position_s = 0.0
        self.bar = Minimap(parent)
        self.bar.setObjectName('timeline_part')
        self.bar.setAccessibleName('Part of the recording that is shown')
        self.bar.valueChanged.connect(self._follow_bar)
        self._show_bar()

    @property
    def shown(self) -> ShownTime:
        """The part that is shown."""
        return self._shown

    def set_length(self, length_s: float) -> None:
        """Set the length of a recording [s]; a new recording is shown as a whole."""
        if abs(length_s - self._shown.length_s) > 1e-6:
            self._take(whole(length_s))

    def show_all(self) -> None:
        """Show the whole recording."""
        self._take(whole(self._shown.length_s))

    def show_part(self, begin_s: float, end_s: float) -> None:
        """Show a part."""
        self._take(self._shown.part(begin_s, end_s - begin_s))

    def step(self, steps: float, around_s: float) -> None:
        """Zoom in, or (below 0) out, around a moment that stays at its place."""
        self._take(self._shown.zoomed(_STEP ** -steps, around_s))

    def turn_wheel(self, turned: QPoint, modifiers: Qt.KeyboardModifiers, at_s: float) -> None:
        """Zoom around the mouse; move with Shift, or by a wheel that turns sideways."""
        sideways = turned.x() or (turned.y() if modifiers & Qt.ShiftModifier else 0)
        if sideways:
            by_s = -_MOVED_SHARE * sideways / _NOTCH * self._shown.duration_s
            self._take(self._shown.beginning_at(self._shown.begin_s + by_s))
        else:
            self.step(turned.y() / _NOTCH, at_s)

    def follow(self, position_s: float, is_playing: bool) -> None:
        """Keep the position in sight; playback is followed only if it was in sight before."""
        before_s, self._position_s = self._position_s, position_s
        if position_s != before_s and (not is_playing or self._shown.contains(before_s)):
            self._take(self._shown.showing(position_s))

    def place(self, rect: QRect) -> None:
        """Set the place of the strip."""
        self.bar.setGeometry(rect.adjusted(0, 0, 0, HEIGHT - BAR_HEIGHT))

    def _take(self, shown: ShownTime) -> None:
        if shown != self._shown:
            self._shown = shown
            self._show_bar()
            self.changed.emit()

    def _show_bar(self) -> None:
        shown = self._shown
        parts = _PARTS / shown.length_s if shown.length_s > 0.0 else 0.0
        page = round(shown.duration_s * parts)
        self.bar.blockSignals(True)
        self.bar.setRange(0, max(_PARTS - page, 0))
        self.bar.setPageStep(page)
        self.bar.setSingleStep(max(round(_MOVED_SHARE * page), 1))
        self.bar.setValue(round(shown.begin_s * parts))
        self.bar.blockSignals(False)
        self.bar.setVisible(not shown.is_all)

    def _follow_bar(self, value: int) -> None:
        self._take(self._shown.beginning_at(value / _PARTS * self._shown.length_s))
