# SPDX-License-Identifier: BSD-3-Clause
"""The configuration in the window: loading, reloading, ticks."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator

import pytest

from process_visualizer.cell.model import Mode
from process_visualizer.gui.cell.cell_model import CellModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

DEVICES = '<device type="other" name="oven"/><device type="other" name="press"/>'


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / 'cell.xml'
    path.write_text(f'<visualizer>{DEVICES}</visualizer>')
    return path


@pytest.fixture
def model(qtbot: Any) -> Iterator[CellModel]:
    tasks = Tasks()
    yield CellModel(tasks, Session())
    tasks.close()


def load(model: CellModel, qtbot: Any, path: Path) -> None:
    with qtbot.waitSignal(model.loaded):
        model.open(str(path))


def names(model: CellModel) -> 'list[str]':
    return [device.name for device in model.session.chosen]


def test_all_devices_are_ticked_at_first(model: CellModel, qtbot: Any, config: Path) -> None:
    assert (model.session.cell, model.session.chosen) == (None, ())
    load(model, qtbot, config)
    assert names(model) == ['oven', 'press']
    assert (model.problems, model.session.mode) == ((), Mode.REALTIME)


def test_ticks_stay_when_the_file_is_read_again(model: CellModel, qtbot: Any,
                                                config: Path) -> None:
    load(model, qtbot, config)
    model.tick('oven', False)
    config.write_text(f'<visualizer>{DEVICES}<device type="other" name="saw"/></visualizer>')
    with qtbot.waitSignal(model.loaded):
        model.reload()
    assert names(model) == ['press', 'saw']


def test_values_of_arguments_stay_with_their_configuration(model: CellModel, qtbot: Any,
                                                           config: Path) -> None:
    other = config.with_name('other.xml')
    for path in (config, other):
        path.write_text(f'<visualizer><arg name="rate" default="30"/>{DEVICES}</visualizer>')
    with qtbot.waitSignal(model.loaded):
        model.open(str(config), {'rate': '5'})
    load(model, qtbot, other)
    assert model.arguments == {}
    load(model, qtbot, config)
    assert model.arguments == {'rate': '5'}


def test_broken_file_keeps_the_configuration_before(model: CellModel, qtbot: Any,
                                                    config: Path) -> None:
    load(model, qtbot, config)
    config.write_text('<visualizer>\n<device type="robt" name="x"/></visualizer>')
    with qtbot.waitSignal(model.loaded) as loaded:
        model.reload()
    assert loaded.args == [False]
    assert names(model) == ['oven', 'press']
    assert [problem.location.line for problem in model.problems] == [2]
    config.write_text(f'<visualizer>{DEVICES}</visualizer>')
    with qtbot.waitSignal(model.loaded):
        model.reload()
    assert model.problems == ()


def test_file_that_is_not_there_is_a_problem(model: CellModel, qtbot: Any, tmp_path: Path) -> None:
    load(model, qtbot, tmp_path / 'missing.xml')
    assert model.session.cell is None
    assert 'missing.xml' in str(model.problems[0])


def test_what_the_computer_lacks_is_named(model: CellModel, qtbot: Any, config: Path) -> None:
    config.write_text('<visualizer><device type="other" name="oven">'
                      '<node pkg="no_such_package" type="driver" name="driver"/>'
                      '</device></visualizer>')
    load(model, qtbot, config)
    assert model.session.cell is not None
    assert 'no_such_package' in str(model.missing[0])
