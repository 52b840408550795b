# SPDX-License-Identifier: BSD-3-Clause
"""Changes of the configuration on the disk: reported, but nothing is reloaded automatically."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Iterator

import pytest
from held_tasks import wait_for_line
from PyQt5.QtWidgets import QLabel, QPushButton

from process_visualizer.gui.cell.cell_model import CellModel, FileWatch, contents_of
from process_visualizer.gui.cell.notices import ChangedNotice
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

VALID, OTHER = '<visualizer><device type="other" name="oven"/></visualizer>', '<visualizer/>'


@pytest.fixture
def tasks(qtbot: Any) -> Iterator[Tasks]:
    lines = Tasks()
    yield lines
    lines.close()


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / 'cell.xml'
    path.write_text(VALID)
    return path


@pytest.fixture
def watch(tasks: Tasks, config: Path) -> FileWatch:
    it = FileWatch(tasks)
    it.follow(contents_of([str(config)]))
    return it


def replace(path: Path, text: str) -> None:
    """Write as many editors do: a new file replaces the old one."""
    new = path.with_name('.new')
    new.write_text(text)
    os.replace(str(new), str(path))


def test_a_change_is_noticed_and_so_is_its_end(watch: FileWatch, qtbot: Any,
                                               config: Path) -> None:
    for text, outdated in ((OTHER, (str(config),)), (VALID, ())):
        with qtbot.waitSignal(watch.changed):
            config.write_text(text)
        qtbot.waitUntil(lambda expected=outdated: watch.outdated == expected)


def test_a_file_that_is_replaced_again_and_again(watch: FileWatch, qtbot: Any,
                                                 config: Path) -> None:
    for text in (OTHER, VALID, OTHER):
        with qtbot.waitSignal(watch.changed):
            replace(config, text)


def test_a_file_that_goes_and_comes_back(watch: FileWatch, tasks: Tasks, qtbot: Any,
                                         config: Path) -> None:
    with qtbot.assertNotEmitted(watch.changed):
        config.unlink()
        qtbot.waitUntil(lambda: watch._watcher.files() == [])
        wait_for_line(tasks, 'watch', qtbot)
        config.write_text(VALID)
        qtbot.waitUntil(lambda: watch._watcher.files() == [str(config)])
        wait_for_line(tasks, 'watch', qtbot)
    config.unlink()
    with qtbot.waitSignal(watch.changed):
        config.write_text(OTHER)
    assert watch.outdated == (str(config),)


def test_where_nothing_tells_of_changes_they_are_looked_for(watch: FileWatch, qtbot: Any,
                                                            config: Path) -> None:
    """For example in a network folder."""
    watch._watcher.blockSignals(True)
    watch._timer.setInterval(20)
    with qtbot.waitSignal(watch.changed):
        config.write_text(OTHER)


def test_the_configuration_is_read_again_only_by_the_operator(tasks: Tasks, qtbot: Any,
                                                              config: Path) -> None:
    cell = CellModel(tasks, Session())
    notice = ChangedNotice(cell)
    qtbot.addWidget(notice)
    with qtbot.waitSignal(cell.loaded):
        cell.open(str(config))
    with qtbot.assertNotEmitted(cell.loaded):
        config.write_text(VALID.replace('oven', 'press'))
        qtbot.waitUntil(notice.isVisible)
    text = notice.findChild(QLabel, 'configuration_changed')
    assert (text.text(), text.toolTip()) == ('cell.xml has changed', str(config))
    button = notice.findChild(QPushButton, 'reload_changed')
    assert button.text() == 'Reload (F5)'
    with qtbot.waitSignal(cell.loaded):
        button.click()
    assert not notice.isVisible()
    assert [device.name for device in cell.session.devices] == ['press']


@pytest.mark.parametrize('included', ['<device type="other" name="oven"/>', '<device type="?"/>'])
def test_included_files_are_watched_whether_valid_or_not(tasks: Tasks, qtbot: Any, config: Path,
                                                         included: str) -> None:
    part = config.with_name('part.xml')
    part.write_text(f'<visualizer>{included}</visualizer>')
    config.write_text('<visualizer><include file="part.xml"/></visualizer>')
    cell = CellModel(tasks, Session())
    with qtbot.waitSignal(cell.loaded):
        cell.open(str(config))
    with qtbot.waitSignal(cell.files.changed):
        part.write_text(OTHER)
    assert cell.files.outdated == (str(part),)
