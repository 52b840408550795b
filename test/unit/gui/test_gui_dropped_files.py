# SPDX-License-Identifier: BSD-3-Clause
"""Files that are dropped on the window: opened or refused."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator, List, Sequence

import pytest
import rosbag
from genpy import Time
from PyQt5.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt, QUrl
from PyQt5.QtGui import QDragEnterEvent, QDropEvent
from PyQt5.QtWidgets import QApplication, QLabel, QMessageBox, QPushButton
from std_msgs.msg import Float64

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import Dropped, LauncherApp, sort_out
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.cell.launch_model import LaunchPhase


@pytest.fixture
def window(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LauncherApp]:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    launcher = Launcher()
    app = LauncherApp(launcher, Settings(str(tmp_path / 'settings')))
    qtbot.addWidget(app)
    app.show()
    yield app
    launcher.close()


@pytest.fixture
def bags(tmp_path: Path) -> List[str]:
    """The files of a split recording."""
    paths = [str(tmp_path / f'seam_{part}.bag') for part in range(2)]
    for number, path in enumerate(paths):
        with rosbag.Bag(path, 'w') as bag:
            bag.write('/n', Float64(1.0), Time(1000 + number))
    return paths


def drop(window: LauncherApp, urls: Sequence[str]) -> bool:
    """Drop the files of these URLs; return whether the window accepts them."""
    data = QMimeData()
    data.setUrls([QUrl(url) for url in urls])
    enter = QDragEnterEvent(QPoint(20, 20), Qt.CopyAction, data, Qt.LeftButton, Qt.NoModifier)
    enter.ignore()
    QApplication.sendEvent(window, enter)
    QApplication.sendEvent(window, QDropEvent(QPointF(20, 20), Qt.CopyAction, data, Qt.LeftButton,
                                              Qt.NoModifier, QEvent.Drop))
    return bool(enter.isAccepted())


def drop_files(window: LauncherApp, paths: Sequence[str]) -> bool:
    return drop(window, [QUrl.fromLocalFile(path).toString() for path in paths])


def message(window: LauncherApp) -> str:
    box = window.findChild(QMessageBox, 'message')
    return '' if box is None else box.text()


@pytest.mark.parametrize('paths, expected', [
    (['/a.bag'], Dropped(bags=('/a.bag',))),
    (['/a_0.bag', '/A_1.BAG'], Dropped(bags=('/a_0.bag', '/A_1.BAG'))),
    (['/a.bag.active'], Dropped(bags=('/a.bag.active',))),
    (['/cell.xml'], Dropped(configuration='/cell.xml'))])
def test_what_files_are(paths: List[str], expected: Dropped) -> None:
    assert sort_out(paths) == expected


@pytest.mark.parametrize('paths, name', [
    (['/photo.png'], 'photo.png'), (['/a.bag', '/notes.txt'], 'notes.txt'), (['/bags'], 'bags'),
    (['/a.xml', '/b.xml'], ''), (['/a.bag', '/cell.xml'], ''), ([''], ''), ([], '')])
def test_what_is_neither_is_refused(paths: List[str], name: str) -> None:
    found = sort_out(paths)
    assert (found.bags, found.configuration) == ((), '')
    assert found.refusal.startswith(f'{name} cannot' if name else 'Drop a recording')


def test_a_split_recording_is_opened_in_playback_mode(window: LauncherApp, qtbot: Any,
                                                      bags: List[str]) -> None:
    assert drop_files(window, list(reversed(bags)))
    qtbot.waitUntil(lambda: window._launcher.session.paths == tuple(bags))
    assert window._launcher.session.mode is Mode.PLAYBACK
    assert message(window) == ''


def test_a_configuration_is_opened(window: LauncherApp, qtbot: Any, tmp_path: Path) -> None:
    path = tmp_path / 'dropped cell.xml'
    path.write_text('<visualizer><device type="other" name="oven"/></visualizer>')
    with qtbot.waitSignal(window._launcher.cell.loaded):
        assert drop_files(window, [str(path)])
    assert window.findChild(QLabel, 'configuration').text() == 'dropped cell.xml'


def test_what_is_refused_is_told(window: LauncherApp) -> None:
    assert drop(window, ['https://example.com/a.bag'])
    assert message(window).startswith('Drop a recording')
    assert window._launcher.session.mode is Mode.REALTIME


@pytest.mark.parametrize('name', ['seam_0.bag', 'cell.xml'])
def test_nothing_is_opened_during_a_recording(window: LauncherApp, tmp_path: Path, name: str,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(window._launcher.recording), 'is_recording', property(lambda _: True))
    drop_files(window, [str(tmp_path / name)])
    assert 'stop it before you open' in message(window)
    assert (window._launcher.bag.is_loading, window._launcher.cell.path) == (False, '')
    monkeypatch.undo()


def test_a_cell_that_runs_is_left_only_if_that_is_wanted(window: LauncherApp, bags: List[str],
                                                         monkeypatch: pytest.MonkeyPatch,
                                                         qtbot: Any) -> None:
    launch, quit_calls = window._launcher.launch, []
    monkeypatch.setattr(launch, 'phase', LaunchPhase.RUNNING)
    monkeypatch.setattr(launch, 'quit', lambda: quit_calls.append(True))
    drop_files(window, bags)
    question = window.findChild(QMessageBox, 'question')
    assert question.text() == 'Leave real-time mode, and play seam_0.bag?'
    assert (quit_calls, window._launcher.bag.is_loading) == ([], False)
    question.findChild(QPushButton, 'yes').click()
    qtbot.waitUntil(lambda: window._launcher.session.mode is Mode.PLAYBACK)
    qtbot.waitUntil(lambda: window._launcher.session.paths == tuple(bags))
    assert quit_calls == []
    monkeypatch.undo()
