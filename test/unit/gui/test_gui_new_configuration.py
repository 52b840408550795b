# SPDX-License-Identifier: BSD-3-Clause
"""A configuration that is made in the window, one at a time; the message if there is none."""
from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest
from held_tasks import HeldTasks
from PyQt5.QtWidgets import QFileDialog, QLabel, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from process_visualizer.discovery.new_configuration import NewConfiguration
from process_visualizer.gui.app.main import _last_configuration
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.cell.cell_model import NewConfigurationModel
from process_visualizer.gui.cell.notices import MadeNotice, NewConfigurationView
from process_visualizer.gui.toolkit.desktop import working_folder

NEW = NewConfiguration('<visualizer />', {'arm.urdf': '<robot />'}, '1 robot')


class Watched:
    """Model and its messages."""

    def __init__(self, reason: str = '') -> None:
        self.tasks = HeldTasks()
        self.reason = reason
        self.model = NewConfigurationModel(self.tasks, self._look)  # type: ignore[arg-type]
        self.said: List[str] = []
        for signal in (self.model.made, self.model.summary_ready, self.model.failed):
            signal.connect(self.said.append)

    def _look(self) -> NewConfiguration:
        if self.reason:
            raise ValueError(self.reason)
        return NEW


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'cell.xml'


def test_it_is_written_and_told(qapp: object, path: Path) -> None:
    watched = Watched()
    path.write_text('the operator was asked about this one')
    watched.model.make(str(path))
    watched.model.make(str(path))
    assert watched.model.is_making and watched.model.where == 'what is running'
    assert len(watched.tasks.held) == 1
    watched.tasks.end_all()
    assert not watched.model.is_making
    assert watched.said == ['cell.xml: 1 robot. Read the comments in the file: some values need '
                            'your decision.', str(path)]
    assert path.read_text() == NEW.text and path.with_name('arm.urdf').read_text() == '<robot />'


def test_no_other_file_is_overwritten(qapp: object, path: Path) -> None:
    watched = Watched()
    other = path.with_name('arm.urdf')
    other.write_text('mine')
    watched.model.make(str(path))
    watched.tasks.end_all()
    assert watched.said == [f'No configuration was made: "{other}" already exists']
    assert not path.exists()


def test_why_there_is_none(qapp: object, path: Path) -> None:
    nothing, no_bag = Watched('nothing runs'), Watched()
    nothing.model.make(str(path))
    no_bag.model.make(str(path), [str(path.with_name('a.bag'))])
    for watched in (nothing, no_bag):
        watched.tasks.end_all()
        assert not watched.model.is_making
    assert nothing.said == ['No configuration was made: nothing runs']
    assert no_bag.said[0].startswith(f'No configuration was made: {path.parent}/a.bag: cannot be')


def test_the_offer_stands_where_nothing_was_open_before(path: Path) -> None:
    settings = Settings(str(path.parent / 'settings'))
    assert _last_configuration(settings) == {}
    settings.store('configuration', {'path': str(path), 'arguments': {}})
    assert _last_configuration(settings) == {}
    path.touch()
    assert _last_configuration(settings) == {'path': str(path), 'arguments': {}}


def test_what_was_made_is_told_until_another_one_is_open(qapp: object, path: Path) -> None:
    watched = Watched()
    notice = MadeNotice(watched.model)  # type: ignore[arg-type]
    opened: List[Tuple[str, int]] = []
    notice.open_wanted.connect(lambda *place: opened.append(place))
    assert notice.isHidden()
    watched.model.make(str(path))
    watched.tasks.end_all()
    text = notice.findChild(QLabel, 'made_text')
    assert not notice.isHidden() and text.wordWrap()
    assert text.text() == ('cell.xml: 1 robot. Read the comments in the file: some values need '
                           'your decision.')
    notice.findChild(QPushButton, 'made_edit').click()
    assert opened == [(str(path), 1)]
    notice.follow(str(path))
    assert not notice.isHidden()
    notice.follow(str(path.with_name('other.xml')))
    assert notice.isHidden()


def test_a_file_is_written_where_the_user_was(tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    """Not in the working folder of roslaunch; at home if the user's folder cannot be used."""
    shell, home = tmp_path / 'shell', tmp_path / 'home'
    for folder in (shell, home):
        folder.mkdir()
    monkeypatch.setenv('HOME', str(home))
    assert working_folder({'PWD': str(shell)}) == str(shell)
    for useless in ({}, {'PWD': ''}, {'PWD': 'shell'}, {'PWD': str(tmp_path / 'gone')}):
        assert working_folder(useless) == str(home)


def test_a_name_is_proposed_that_no_file_has(qtbot: QtBot, path: Path) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    view = NewConfigurationView(Watched().model, lambda: str(path), window)

    def proposed(*bags: str) -> str:
        view.ask_path(bags)
        (dialog,) = window.findChildren(QFileDialog)
        found = Path(dialog.selectedFiles()[0]).name
        dialog.setParent(None)
        return found

    for name in ('cell.xml', 'cell2.xml', 'good.xml'):
        path.with_name(name).write_text('<visualizer />')
    assert [proposed(), proposed('/bags/good.bag'), proposed('/bags/bad.bag')] == [
        'cell3.xml', 'good2.xml', 'bad.xml']
