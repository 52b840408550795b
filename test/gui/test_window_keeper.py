# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's two windows and RViz share the screen, in every mode."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator, List

import pytest
from PyQt5.QtCore import QPoint, QRect, Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication, QDialog, QLabel, QPushButton

from process_visualizer.cell.model import Mode
from process_visualizer.generate.plan import RVIZ_PART
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_keeper import WindowKeeper
from process_visualizer.gui.app.window_places import MIN_TIMELINE_PX
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.live.replay_model import ReplayPhase
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState


class Desk:
    """The windows on a screen, without RViz: its area is left free."""

    def __init__(self, qtbot: Any, folder: Path) -> None:
        self.settings = Settings(str(folder / 'settings'))
        self.launcher = Launcher()
        self.window = LauncherApp(self.launcher, self.settings)
        self.keeper = WindowKeeper(self.window, self.launcher, self.settings)
        self.dock = self.keeper.dock
        qtbot.addWidget(self.window)
        self.window.show()

    @property
    def room(self) -> QRect:
        return QApplication.primaryScreen().availableGeometry()

    @property
    def rviz(self) -> QRect:
        place = self.launcher.view.window
        assert place is not None
        return QRect(place.x, place.y, place.width, place.height)

    def fits(self) -> bool:
        """Return whether the windows have their positions, and cover the screen without overlap."""
        frame = self.window.frameGeometry()
        rviz = QRect(self.rviz.topLeft(), self.rviz.size() + frame.size() - self.window.size())
        shown = [frame, rviz, *([self.dock.geometry()] if self.dock.isVisible() else [])]
        return (self.keeper.is_settled and sum(it.width() * it.height() for it in shown)
                == self.room.width() * self.room.height()
                and all(self.room.contains(it) for it in shown)
                and not any(one.intersects(other) for one in shown for other in shown
                            if one is not other))


@pytest.fixture
def desk(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    made = Desk(qtbot, tmp_path)
    yield made
    made.window.hide()
    made.launcher.close()


def run_rviz(desk: Desk, state: PartState, *nodes: NodeReport) -> None:
    launch = desk.launcher.launch
    launch.phase, launch.reports = (
        LaunchPhase.RUNNING,
        {RVIZ_PART: PartReport(RVIZ_PART, state, nodes)},
    )
    launch.changed.emit()


def test_where_rviz_was_stands_a_button_that_restarts_it(desk: Desk, qtbot: Any) -> None:
    qtbot.waitUntil(desk.fits)
    place = desk.keeper.rviz_place
    run_rviz(desk, PartState.RUNNING, NodeReport('/rviz', NodeState.RUNNING))
    assert not place.isVisible() and desk.launcher.view.is_rviz_alive
    run_rviz(desk, PartState.STOPPED, NodeReport('/rviz', NodeState.EXITED, 0))
    assert place.isVisible() and place.geometry().size() == desk.rviz.size()
    assert place.findChild(QLabel, 'rviz_place_text').text() == 'RViz was closed.'
    replay = desk.launcher.replay
    for phase in (ReplayPhase.SHOWN, ReplayPhase.LIVE):  # another RViz covers the place meanwhile
        replay._phase = phase
        replay.changed.emit()
        assert place.isVisible() is (phase is ReplayPhase.LIVE)
    assert not desk.launcher.view.is_rviz_alive
    wanted: List[None] = []
    place.restart_wanted.connect(lambda: wanted.append(None))
    place.findChild(QPushButton, 'rviz_place_restart').click()
    assert len(wanted) == 1
    run_rviz(desk, PartState.STARTING, NodeReport('/rviz'))
    assert place.isVisible() and not place.findChild(QPushButton, 'rviz_place_restart').isVisible()
    assert place.findChild(QLabel, 'rviz_place_text').text() == 'RViz is starting…'
    desk.launcher.link.displays.emit(())  # from the previous RViz, as it ended
    run_rviz(desk, PartState.RUNNING, NodeReport('/rviz', NodeState.RUNNING))
    assert place.isVisible()
    desk.launcher.link.displays.emit(())
    assert not place.isVisible()
    desk.launcher.launch.phase, desk.launcher.launch.reports = LaunchPhase.IDLE, {}


def test_a_request_to_close_the_timeline_closes_nothing(desk: Desk) -> None:
    desk.dock.close()
    assert desk.dock.isVisible() and desk.window.isVisible()
    assert desk.window.statusBar().currentMessage().startswith('The timeline belongs to')


def test_each_mode_has_its_timeline(desk: Desk, qtbot: Any) -> None:
    qtbot.waitUntil(desk.fits)
    assert desk.dock.isVisible() and desk.window.live.isVisible()
    desk.launcher.session.set_mode(Mode.PLAYBACK)
    assert desk.dock.isVisible() and desk.window.playback.timeline.isVisible()
    qtbot.waitUntil(desk.fits)
    desk.launcher.session.set_mode(Mode.REALTIME)
    assert desk.dock.isVisible() and desk.window.live.isVisible()
    assert not desk.window.playback.timeline.isVisible()
    qtbot.waitUntil(desk.fits)


def test_no_window_moves_with_mode_and_tab(desk: Desk, qtbot: Any) -> None:
    """Each button of the timeline stays where it was before the tab changed."""
    qtbot.waitUntil(desk.fits)
    panels = desk.window.panels
    at_first = desk.window.frameGeometry(), desk.rviz, desk.dock.geometry()
    for mode in Mode:
        desk.launcher.session.set_mode(mode)
        for tab in range(panels.count()):
            panels.setCurrentIndex(tab)
            qtbot.waitUntil(desk.fits)
            assert (desk.window.frameGeometry(), desk.rviz, desk.dock.geometry()) == at_first


def test_the_edge_of_the_timeline_is_dragged(desk: Desk, qtbot: Any) -> None:
    desk.launcher.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(desk.fits)
    before = desk.dock.geometry()
    drag(desk, -40)
    assert desk.dock.geometry() == before.adjusted(0, -40, 0, 0)
    qtbot.waitUntil(desk.fits)
    drag(desk, 2000)
    assert desk.dock.height() == MIN_TIMELINE_PX
    qtbot.waitUntil(desk.fits)
    assert desk.window.playback.below.geometry().bottom() < MIN_TIMELINE_PX
    assert desk.dock.layout().minimumSize().height() <= MIN_TIMELINE_PX


def drag(desk: Desk, dy: int) -> None:
    grip = desk.dock.grip
    QTest.mousePress(grip, Qt.LeftButton, Qt.NoModifier, QPoint(200, 3))
    desk.dock.grip.dragged.emit(desk.dock.y() + dy)
    QTest.mouseRelease(grip, Qt.LeftButton, Qt.NoModifier, QPoint(200, 3))


def test_rviz_follows_the_launcher(desk: Desk, qtbot: Any) -> None:
    qtbot.waitUntil(desk.fits)
    desk.window.resize(desk.window.width() + 20, desk.window.height())
    qtbot.waitUntil(lambda: desk.rviz.left() == desk.window.frameGeometry().right() + 1)
    qtbot.waitUntil(desk.fits)
    desk.window.move(desk.room.right() - desk.window.width() - 10, desk.room.top())
    qtbot.waitUntil(lambda: desk.rviz.left() == desk.room.left())
    qtbot.waitUntil(desk.fits)


def test_a_window_that_was_moved_a_little_goes_back(desk: Desk, qtbot: Any) -> None:
    qtbot.waitUntil(desk.fits)
    before = desk.window.pos()
    desk.window.move(before + QPoint(30, 20))
    qtbot.waitUntil(lambda: desk.window.pos() == before)
    qtbot.waitUntil(desk.fits)


def test_sizes_are_remembered(desk: Desk, qtbot: Any, tmp_path: Path) -> None:
    desk.launcher.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(desk.fits)
    drag(desk, -30)
    height = desk.dock.height()
    desk.keeper.remember()
    again = WindowKeeper(desk.window, desk.launcher, desk.settings)
    assert again.dock.height() == height


def test_the_keys_of_the_window_work_in_the_timeline(desk: Desk, qtbot: Any) -> None:
    desk.launcher.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(desk.dock.isVisible)
    QApplication.setActiveWindow(desk.dock)
    QTest.keyClick(desk.dock, Qt.Key_Question)
    qtbot.waitUntil(lambda: desk.window.findChild(QDialog, 'keys') is not None)


def test_it_is_closed_with_the_launcher(desk: Desk, qtbot: Any) -> None:
    desk.launcher.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(desk.dock.isVisible)
    desk.window.hide()
    assert not desk.dock.isVisible()
