# SPDX-License-Identifier: BSD-3-Clause
"""A second launcher names the owner of the cell, and shows it without changing anything."""
from __future__ import annotations

import os
import re
import subprocess
import time
from pathlib import Path
from typing import Any, List

import pytest
import yaml
from PyQt5.QtCore import QProcess, Qt
from PyQt5.QtGui import QGuiApplication
from PyQt5.QtWidgets import QAbstractButton, QMessageBox

from process_visualizer.gui.app.look_on import SecondLauncher
from process_visualizer.launching.cell_owner import CELL_NODES, CellOwner
from process_visualizer.launching.cell_watch import MASTER_OTHER, MASTER_SILENT, CellLook
from process_visualizer.launching.run_record import RunRecord, folder_of_run
from process_visualizer.rviz.views import onlooker_view
from process_visualizer.rviz.window_geometry import Rectangle, moved_aside

VIEW = {'Visualization Manager': {
    'Displays': [
        {'Class': 'rviz/Grid', 'Name': 'Grid'},
        {'Class': 'rviz/Group', 'Name': 'arm', 'Displays': [
            {'Class': 'rviz/RobotModel', 'Name': 'model'},
            {'Class': 'rviz/InteractiveMarkers', 'Name': 'handles'}]},
        {'Class': 'process_visualizer/DisplayStatus', 'Name': 'Status report'}],
    'Tools': [{'Class': 'rviz/MoveCamera'}, {'Class': 'rviz/SetGoal'}]},
    'Window Geometry': {'X': 460, 'Y': 0, 'Width': 1140, 'Height': 600,
                        'Views': {'collapsed': True}}}


def owner(folder: str = '', **fields: Any) -> CellOwner:
    return CellOwner('http://robotpc:11311', 4711, 'robotpc', folder=folder, **fields)


def test_who_has_the_cell() -> None:
    since_s = time.mktime((2026, 11, 25, 14, 2, 0, 0, 0, -1))
    assert owner(user='anna', since_s=since_s).text == (
        'Another launcher (process 4711 of anna, since 14:02) controls the cell on the ROS master '
        'http://robotpc:11311')
    assert owner().text.startswith('Another launcher (process 4711 on robotpc) controls the cell')


def test_an_onlooker_changes_nothing() -> None:
    seen = onlooker_view(VIEW)['Visualization Manager']
    assert [it['Class'] for it in seen['Displays']] == ['rviz/Grid', 'rviz/Group']
    assert [it['Name'] for it in seen['Displays'][1]['Displays']] == ['model']
    assert seen['Tools'] == [{'Class': 'rviz/MoveCamera'}]


def test_the_files_of_a_launcher_are_found_by_its_process(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    records = [RunRecord() for _ in range(8)]  # in no order: their names are random
    for record in records[1:]:
        record.write()
    records[1].write('/tmp/process_visualizer-replay', is_replay=True)
    assert folder_of_run(os.getpid()) == ''
    records[0].write('/tmp/process_visualizer-a')
    assert folder_of_run(os.getpid()) == '/tmp/process_visualizer-a'
    for record in records:
        record.remove()


class Started:
    """The arguments of the programs that would be started."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.words: List[str] = []
        monkeypatch.setattr(QProcess, 'start',
                            lambda _it, _program, words: self.words.extend(words))


def test_the_user_looks_on(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'cell.rviz').write_text(yaml.safe_dump(VIEW))
    started = Started(monkeypatch)
    second = SecondLauncher(owner(str(tmp_path)))
    assert 'You can watch' in second.box.text()
    second.watch.click()
    path = started.words[started.words.index('-d') + 1]
    shown = yaml.safe_load(Path(path).read_text())
    assert shown['Visualization Manager'] == onlooker_view(VIEW)['Visualization Manager']
    room = QGuiApplication.primaryScreen().availableGeometry()
    assert shown['Window Geometry'] == {**moved_aside(
        VIEW['Window Geometry'], Rectangle(room.x(), room.y(), room.width(), room.height())),
        'Views': {'collapsed': True}}
    assert started.words[-1] == f'__name:=rviz_looking_on_{os.getpid()}'
    with qtbot.waitSignal(second.ended):
        second.close()
    assert not Path(path).exists()


@pytest.mark.parametrize('width, x, shown_width', [(1920, 520, 1080), (1366, 286, 1080),
                                                   (1024, 0, 1024)])
def test_the_other_rviz_is_beside_the_first_and_on_the_screen(
        width: int, x: int, shown_width: int) -> None:
    assert moved_aside(VIEW['Window Geometry'], Rectangle(0, 0, width, 768)) == {
        'X': x, 'Y': 60, 'Width': shown_width, 'Height': 540, 'Views': {'collapsed': True}}


def test_an_old_picture_is_told_until_the_cell_answers_again(qtbot: Any) -> None:
    second = SecondLauncher(owner())
    second.take_look(CellLook(frozenset(['/scene_watch'])))  # the others report it in the scene
    second.take_look(CellLook(master_problem=MASTER_SILENT))  # existing connections stay
    assert second.stale is None
    for look in (CellLook(frozenset(CELL_NODES)), CellLook(master_problem=MASTER_OTHER)):
        second.take_look(look)
        assert second.stale is not None and second.stale.isVisible()
        assert re.search(r'nothing has been received from the cell since \d\d:\d\d:\d\d',
                         second.stale.text())
        assert second.stale.testAttribute(Qt.WA_ShowWithoutActivating)
        if not look.master_problem:
            second.take_look(CellLook())
            assert second.stale is None
    second.box.hide()
    second._is_asking = False  # RViz is open
    with qtbot.waitSignal(second.ended):
        second.stale.findChild(QAbstractButton, 'stop_watching').click()


def test_a_launcher_that_ends_leaves_its_place(qtbot: Any) -> None:
    other = subprocess.Popen(['sleep', '600'])
    second = SecondLauncher(owner(user='anna')._replace(process_id=other.pid))
    second._look_at_owner()
    assert second.start.isHidden() and 'controls the cell' in second.box.text()
    other.kill()
    other.wait()
    second._look_at_owner()
    assert second.box.text() == 'The other launcher has ended.'
    assert second.watch.isHidden() and not second.start.isHidden()
    with qtbot.waitSignal(second.ended):
        second.start.click()
    assert second.restarts


def test_why_one_cannot_look_on(qtbot: Any) -> None:
    for second, reason in ((SecondLauncher(owner()), 'cell view'),
                           (SecondLauncher(owner(user='anna')), 'cell view')):
        assert reason in second.box.text() and not second.watch.isEnabled()
        with qtbot.waitSignal(second.ended):
            second.box.button(QMessageBox.Close).click()


def test_there_is_nothing_to_look_at_before_the_launch(qtbot: Any, tmp_path: Path) -> None:
    second = SecondLauncher(owner(str(tmp_path)))
    assert not second.watch.isEnabled() and 'has not started anything' in second.box.text()
    with qtbot.waitSignal(second.ended):
        second.box.button(QMessageBox.Close).click()


def test_an_rviz_that_is_ended_while_one_looks_on_is_no_problem(
        qtbot: Any, capsys: pytest.CaptureFixture[str]) -> None:
    second = SecondLauncher(owner())
    capsys.readouterr()
    second._rviz.errorOccurred.emit(QProcess.Crashed)
    assert capsys.readouterr().err == ''
    second._rviz.errorOccurred.emit(QProcess.FailedToStart)
    assert 'RViz cannot be started for watching' in capsys.readouterr().err
    with qtbot.waitSignal(second.ended):
        second.close()
