# SPDX-License-Identifier: BSD-3-Clause
"""A second launcher says who has the cell, and shows it without changing anything."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, List

import pytest
import yaml
from PyQt5.QtCore import QProcess
from PyQt5.QtWidgets import QMessageBox

from process_visualizer.gui.app.look_on import SecondLauncher
from process_visualizer.launching.cell_owner import CellOwner
from process_visualizer.launching.run_record import RunRecord, folder_of_run
from process_visualizer.rviz.views import onlooker_view

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
    """What would be started."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.words: List[str] = []
        monkeypatch.setattr(QProcess, 'start',
                            lambda _it, _program, words: self.words.extend(words))


def test_the_user_looks_on(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'cell.rviz').write_text(yaml.safe_dump(VIEW))
    started = Started(monkeypatch)
    second = SecondLauncher(owner(str(tmp_path)))
    assert 'You can look on' in second.box.text()
    second.look_on.click()
    path = started.words[started.words.index('-d') + 1]
    shown = yaml.safe_load(Path(path).read_text())
    assert shown['Visualization Manager'] == onlooker_view(VIEW)['Visualization Manager']
    assert shown['Window Geometry'] == {  # beside the first RViz, not exactly over it
        'X': 520, 'Y': 60, 'Width': 1080, 'Height': 540, 'Views': {'collapsed': True}}
    assert started.words[-1] == f'__name:=rviz_looking_on_{os.getpid()}'
    with qtbot.waitSignal(second.ended):
        second.close()
    assert not Path(path).exists()


def test_why_one_cannot_look_on(qtbot: Any) -> None:
    for second, reason in ((SecondLauncher(owner()), 'cell view'),
                           (SecondLauncher(owner(user='anna')), 'cell view')):
        assert reason in second.box.text() and not second.look_on.isEnabled()
        with qtbot.waitSignal(second.ended):
            second.box.button(QMessageBox.Close).click()


def test_there_is_nothing_to_look_at_before_the_launch(qtbot: Any, tmp_path: Path) -> None:
    second = SecondLauncher(owner(str(tmp_path)))
    assert not second.look_on.isEnabled() and 'launched nothing' in second.box.text()
    with qtbot.waitSignal(second.ended):
        second.box.button(QMessageBox.Close).click()


def test_an_rviz_that_is_ended_while_one_looks_on_is_no_problem(
        qtbot: Any, capsys: pytest.CaptureFixture[str]) -> None:
    second = SecondLauncher(owner())
    capsys.readouterr()
    second._rviz.errorOccurred.emit(QProcess.Crashed)
    assert capsys.readouterr().err == ''
    second._rviz.errorOccurred.emit(QProcess.FailedToStart)
    assert 'RViz cannot be started to look on' in capsys.readouterr().err
    with qtbot.waitSignal(second.ended):
        second.close()
