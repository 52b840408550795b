# SPDX-License-Identifier: BSD-3-Clause
"""Decides when the launcher, RViz and the timeline are moved, to keep them together."""
from __future__ import annotations

from dataclasses import replace

from PyQt5.QtCore import QEvent, QObject, QRect, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import (
    QCloseEvent,
    QColor,
    QGuiApplication,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QScreen,
)
from PyQt5.QtWidgets import QPushButton, QStackedWidget, QVBoxLayout, QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_places import (
    WindowFrame,
    WindowPlaces,
    followed,
    places,
    settings_of,
    sizes_from,
)
from process_visualizer.gui.live.replay_model import ReplayPhase
from process_visualizer.gui.toolkit.labels import plain_label
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.widgets import in_column
from process_visualizer.rviz.window_geometry import Rectangle

# The window below RViz, with the buttons and the timeline.

_SIDE = 10
_GRIP_PX, _MARK_PX = 9, 36


class TimelineDock(QWidget):
    """Belongs to the launcher's window: it shares the keys, and only that window closes it.

    It has no title bar. Dragging its upper edge changes its height; its owner places it.
    """

    height_wanted = pyqtSignal(int)
    """The operator has dragged the upper edge: the height [px]."""
    close_refused = pyqtSignal()
    """The operator, or the window manager, has tried to close the window."""

    def __init__(self, content: QWidget, window: QWidget) -> None:
        """``window`` is the launcher's."""
        # Of Qt's kinds of windows, only tools get the keys of their parent. The window manager sees
        # a dialog: some hide the tools of a program while RViz is used.
        super().__init__(window, Qt.Tool | Qt.FramelessWindowHint)
        self.setAttribute(Qt.WA_X11NetWmWindowTypeDialog)
        self.setAttribute(Qt.WA_ShowWithoutActivating)
        self.setObjectName('timeline_dock')
        self.setWindowTitle('Timeline')
        self.grip = Grip()
        self.grip.dragged.connect(
            lambda y: self.height_wanted.emit(self.frameGeometry().bottom() + 1 - y))
        inside = QVBoxLayout()
        inside.setContentsMargins(_SIDE, 0, _SIDE, _SIDE)
        inside.addWidget(content)
        column = in_column(self, 0, self.grip, inside)
        column.setSizeConstraint(QVBoxLayout.SetNoConstraint)  # it may not outgrow the screen

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ignore the request: closing the timeline must not end the cell."""
        event.ignore()
        self.close_refused.emit()


class Grip(QWidget):
    """The upper edge of the dock."""

    dragged = pyqtSignal(int)
    """The wanted position of the edge: y [px] on the screen."""

    def __init__(self) -> None:
        super().__init__()
        self._offset = 0
        self.setObjectName('timeline_grip')
        self.setFixedHeight(_GRIP_PX)
        self.setCursor(Qt.SplitVCursor)
        self.setToolTip('Drag to resize the timeline')

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the border, and a mark that invites dragging."""
        painter = QPainter(self)
        painter.fillRect(0, 0, self.width(), 1, self.palette().mid())
        painter.setPen(Qt.NoPen)
        painter.setBrush(QColor(theme().tick))
        painter.drawRoundedRect((self.width() - _MARK_PX) // 2, 4, _MARK_PX, 3, 1.5, 1.5)
        painter.end()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Remember where the edge was grabbed."""
        self._offset = event.y()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the edge."""
        if event.buttons() & Qt.LeftButton:
            self.dragged.emit(event.globalY() - self._offset)


class RvizPlace(QWidget):
    """Belongs to the launcher's window; its owner places it. Hidden while there is no text."""

    restart_wanted = pyqtSignal()

    def __init__(self, window: QWidget) -> None:
        super().__init__(window, Qt.Tool | Qt.FramelessWindowHint)
        self.setAttribute(Qt.WA_X11NetWmWindowTypeDialog)  # like the timeline
        self.setAttribute(Qt.WA_ShowWithoutActivating)
        self.setObjectName('rviz_place')
        self.setWindowTitle('RViz')
        self._text = plain_label()
        self._text.setObjectName('rviz_place_text')
        self._text.setAlignment(Qt.AlignCenter)
        self._text.setWordWrap(True)
        self._restart = QPushButton('Restart RViz')
        self._restart.setObjectName('rviz_place_restart')
        self._restart.clicked.connect(self.restart_wanted)
        layout = QVBoxLayout(self)
        layout.addStretch(1)
        layout.addWidget(self._text)
        layout.addWidget(self._restart, 0, Qt.AlignCenter)
        layout.addStretch(1)
        self.hide()

    def show_text(self, text: str, can_restart: bool) -> None:
        """Show why RViz is missing; an empty text hides this widget, as RViz is in its place."""
        self._text.setText(text)
        self._restart.setVisible(can_restart)
        self.setVisible(bool(text) and self.parentWidget().isVisible())

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ignore the request, as this is a part of the launcher."""
        event.ignore()


_SETTLED_MS = 250  # without a change: the operator has let go of the window
_TIMELINE_STAYS = ('The timeline belongs to this window: to end the cell, use Quit all nodes, or '
                   'close this window')
_CHANGES = (QEvent.Move, QEvent.Resize, QEvent.Show, QEvent.Hide, QEvent.WindowStateChange)


class WindowKeeper(QObject):
    """Places the three windows, at first and whenever the operator changes one of them.

    The timeline (in real-time mode, that of the last seconds) is below RViz, and the launcher has
    the full height, in every mode and on every tab: no button moves when one of them changes.
    """

    def __init__(self, window: LauncherApp, launcher: Launcher, settings: Settings) -> None:
        super().__init__(window)
        self._window, self._launcher, self._settings = window, launcher, settings
        self._screen: QScreen = QGuiApplication.primaryScreen()
        self._sizes = sizes_from(settings.value(self._name()))
        self._timelines = QStackedWidget()
        for timeline in (window.live, window.playback.below):
            self._timelines.addWidget(timeline)
        self.dock = TimelineDock(self._timelines, window)
        self.dock.height_wanted.connect(self._set_timeline_height)
        self.dock.close_refused.connect(lambda: window.tell(_TIMELINE_STAYS))
        self.rviz_place = RvizPlace(window)
        self.rviz_place.restart_wanted.connect(launcher.view.restart)
        for changed in (launcher.view.ended, launcher.replay.changed):
            changed.connect(self._show_rviz_place)
        self._asked, self._refused = QRect(), QRect()
        self._is_asking = False
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_SETTLED_MS)
        self._timer.timeout.connect(self._follow)
        self._show_timeline()
        self._arrange()
        window.installEventFilter(self)
        launcher.cell.changed.connect(self._show_timeline)
        for screen in QGuiApplication.screens():
            screen.availableGeometryChanged.connect(lambda _room: self._timer.start())

    @property
    def is_settled(self) -> bool:
        """Return whether no window is about to be moved."""
        return not self._timer.isActive()

    def remember(self) -> None:
        """Store the sizes for this screen."""
        self._settings.store(self._name(), settings_of(self._sizes))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the launcher's window."""
        if event.type() in _CHANGES:
            self._timer.start()
            self._show_dock()
        return False

    def _show_timeline(self) -> None:
        """Show the timeline of the mode."""
        window, is_played = self._window, self._launcher.session.mode is Mode.PLAYBACK
        self._timelines.setCurrentWidget(window.playback.below if is_played else window.live)

    def _show_dock(self) -> None:
        """Show the timeline with the launcher; window managers hide it if that is minimized."""
        self.dock.setVisible(self._window.isVisible())
        self._show_rviz_place()

    def _show_rviz_place(self) -> None:
        """Fill the place of an RViz that was closed or killed, or that is starting."""
        launcher, view = self._launcher, self._launcher.view
        text = 'RViz is starting…' if view.is_starting else view.end_text
        is_covered = launcher.replay.phase is ReplayPhase.SHOWN  # by the RViz of the replay
        self.rviz_place.show_text('' if is_covered else text, not view.is_starting)

    def _set_timeline_height(self, height: int) -> None:
        """Change the height at once; the other windows follow when the operator lets go."""
        self._sizes = replace(self._sizes, timeline_height=height)
        self._place_dock(self._places())
        self._sizes = replace(self._sizes, timeline_height=self.dock.height())
        self._timer.start()

    def _follow(self) -> None:
        """Arrange the windows around the launcher, once the operator has let go of it.

        If the window manager puts the launcher elsewhere, it stays there until it is moved.
        """
        window = self._window
        if not window.isVisible() or window.windowState() != Qt.WindowNoState:
            return
        here = QRect(window.pos(), window.size())
        if self._is_asking and here != self._asked:
            self._refused = here
        is_moved = here not in (self._asked, self._refused)
        if self._screen is not window.windowHandle().screen():
            self._change_screen(window.windowHandle().screen())
        elif is_moved:
            self._sizes = followed(self._sizes, self._room(), _rectangle(here),
                                   _rectangle(self._asked))
        self._is_asking = False
        self._arrange(is_moved)

    def _change_screen(self, screen: QScreen) -> None:
        self.remember()
        self._screen = screen
        self._sizes = sizes_from(self._settings.value(self._name()))

    def _arrange(self, is_moved: bool = True) -> None:
        """Place every window; the launcher only if it was moved, or has another place now."""
        found = self._places()
        self._place_dock(found)
        frame = _frame_of(self._window)  # RViz has the same frame; the widget in its place has none
        self.rviz_place.setGeometry(_rect(found.rviz).adjusted(
            0, 0, frame.left + frame.right, frame.top + frame.bottom))
        asked = _rect(found.launcher)
        if is_moved or asked != self._asked:
            self._asked, self._is_asking = asked, True
            self._window.resize(asked.size())
            self._window.move(asked.topLeft())
            self._timer.start()  # to see what the window manager makes of it
        self._launcher.view.window = found.rviz
        self._launcher.link.place_rviz(_scaled(found.rviz, self._window.devicePixelRatioF()))

    def _place_dock(self, found: WindowPlaces) -> None:
        self.dock.setGeometry(_rect(found.timeline))

    def _places(self) -> WindowPlaces:
        return places(self._room(), _frame_of(self._window), self._sizes)

    def _room(self) -> Rectangle:
        return _rectangle(self._screen.availableGeometry())

    def _name(self) -> str:
        room = self._room()
        return f'layout/{self._screen.name()}-{room.width}x{room.height}'


def _frame_of(window: QWidget) -> WindowFrame:
    """Return the window's frame; it is unknown before the window is on the screen."""
    handle = window.windowHandle()
    if handle is None:
        return WindowFrame()
    margins = handle.frameMargins()
    return WindowFrame(margins.left(), margins.top(), margins.right(), margins.bottom())


def _rectangle(rect: QRect) -> Rectangle:
    return Rectangle(rect.x(), rect.y(), rect.width(), rect.height())


def _rect(rectangle: Rectangle) -> QRect:
    return QRect(rectangle.x, rectangle.y, rectangle.width, rectangle.height)


def _scaled(place: Rectangle, scale: float) -> Rectangle:
    return Rectangle(*(round(scale * it) for it in (place.x, place.y, place.width, place.height)))
