# SPDX-License-Identifier: BSD-3-Clause
"""The operator's ticks and comparisons are restored after a restart."""
from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Mapping

import pytest
from cycle_bags import write_bag
from held_tasks import HeldTasks
from PyQt5.QtCore import QObject
from session_stand import open_cell, play

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.gui.app.kept_state import KeptState
from process_visualizer.gui.cell.cell_model import CellModel
from process_visualizer.gui.compare.compare_model import CompareModel
from process_visualizer.gui.session import Session


class Program:
    """Program that keeps one table."""

    def __init__(self, path: Path) -> None:
        self.tasks = HeldTasks()
        self.values: Dict[str, Any] = {}
        self.told: List[str] = []
        self._parent = QObject()
        self.kept = KeptState(str(path), self.tasks,  # type: ignore[arg-type]
                              self._restore, lambda: dict(self.values), self._parent)
        self.kept.failed.connect(self.told.append)
        self.kept.restore()

    def _restore(self, values: Mapping[str, Any]) -> None:
        self.values = {'ticked': [str(it) for it in values['ticked']]}

    def tick(self, *names: str) -> None:
        self.values = {'ticked': list(names)}
        self.kept.write()
        self.tasks.end_all()


def test_the_next_session_has_what_this_one_kept(tmp_path: Path) -> None:
    path = tmp_path / 'settings' / 'session.json'
    Program(path).tick('arm', 'oven')
    later = Program(path)
    assert (later.values, later.told) == ({'ticked': ['arm', 'oven']}, [])


def test_nothing_is_written_while_nothing_changes(tmp_path: Path) -> None:
    path = tmp_path / 'session.json'
    Program(path).tick('arm')
    session = Program(path)
    session.kept.write()
    assert session.tasks.held == []


def test_what_changes_often_is_written_once(tmp_path: Path) -> None:
    path = tmp_path / 'session.json'
    session = Program(path)
    for name in ('arm', 'oven', 'saw'):
        session.values = {'ticked': [name]}
        session.kept.write()
    session.tasks.end_all()
    assert json.loads(path.read_text()) == {'ticked': ['saw']}


@pytest.mark.parametrize('content', ['{"ticked": ["ar', '[1, 2]', '{"ticked": 5}', '{}'])
def test_a_damaged_file_is_told_and_put_aside(tmp_path: Path, content: str) -> None:
    path = tmp_path / 'session.json'
    path.write_text(content)
    session = Program(path)
    [told] = session.told
    assert f'{path} is damaged. It was moved to {path}.damaged.' in told
    assert Path(f'{path}.damaged').read_text() == content
    session.tick('arm')
    assert json.loads(path.read_text()) == {'ticked': ['arm']}


def test_a_file_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    session = Program(tmp_path / 'session.json')
    session.kept._path = str(tmp_path / 'file' / 'session.json')
    session.tick('arm')
    assert 'cannot be kept for the next session' in session.told[0]


def test_ticks_are_those_of_their_configuration(qtbot: Any, tmp_path: Path) -> None:
    devices = '<visualizer><device type="other" name="oven"/><device type="other" name="saw"/>'
    one, other = tmp_path / 'one.xml', tmp_path / 'other.xml'
    for path in (one, other):
        path.write_text(f'{devices}</visualizer>')

    def opened(tasks: HeldTasks, model: CellModel, path: Path) -> List[str]:
        model.open(str(path))
        tasks.end_all()
        return [device.name for device in model.session.chosen]

    first_tasks, tasks = HeldTasks(), HeldTasks()
    first = CellModel(first_tasks, Session())  # type: ignore[arg-type]
    opened(first_tasks, first, one)
    first.tick('oven', False)
    model = CellModel(tasks, Session())  # type: ignore[arg-type]
    model.set_unticked(json.loads(json.dumps(first.unticked)))
    assert opened(tasks, model, one) == ['saw']
    assert opened(tasks, model, other) == ['oven', 'saw']


class Comparing:
    """Model on a bag of four cycles, the third of which is poor."""

    def __init__(self, folder: Path) -> None:
        self.tasks, self.session = HeldTasks(), Session()
        self.model = CompareModel(self.tasks, self.session)  # type: ignore[arg-type]
        self.told: List[str] = []
        self.model.failed.connect(self.told.append)
        self.cell = XmlParser().parse(str(folder / 'cell.xml'))

    def verdicts(self) -> List[bool]:
        assert self.model.compared is not None
        return [it is not None and not it.departures for it in self.model.compared.comparisons]


@pytest.fixture
def bag(tmp_path: Path) -> str:
    return str(write_bag(tmp_path, cycles=4, poor=2))


def watch(session: Session, bag: str) -> None:
    session.set_mode(Mode.PLAYBACK)
    play(session, bag)


def compared(bag: str) -> Comparing:
    session = Comparing(Path(bag).parent)
    open_cell(session.session, session.cell)
    watch(session.session, bag)
    session.model.find_runs()
    session.tasks.end_all()
    for row in (0, 1):
        session.model.set_good(row, True)
    session.model.compare()
    session.tasks.end_all()
    return session


def restarted(session: Comparing, bag: str) -> Comparing:
    later = Comparing(Path(bag).parent)
    later.model.restore(json.loads(json.dumps(session.model.settings())))
    return later


def test_good_runs_and_verdicts_come_back_with_their_recording(qtbot: Any, bag: str) -> None:
    before = compared(bag)
    later = restarted(before, bag)
    watch(later.session, bag)
    assert later.tasks.held == []  # the configuration is not known yet
    open_cell(later.session, later.cell)
    later.tasks.end_all()
    assert later.model.good == {0, 1}
    assert later.verdicts() == before.verdicts() == [True, True, False, True]


def test_the_running_cell_is_compared_with_the_same_runs_as_before(qtbot: Any, bag: str) -> None:
    """In real-time mode no recording is open."""
    later = restarted(compared(bag), bag)
    open_cell(later.session, later.cell)
    later.tasks.end_all()
    assert later.model.paths == (bag,)
    assert later.model.good == {0, 1} and later.model.compared is not None
    last = restarted(later, bag)
    open_cell(last.session, last.cell)
    last.tasks.end_all()
    assert last.model.good == {0, 1}


def test_each_mode_has_its_comparison_after_a_restart(qtbot: Any, bag: str) -> None:
    before = compared(bag)
    before.session.set_mode(Mode.REALTIME)
    before.tasks.end_all()
    before.model.set_good(0, False)
    before.session.set_mode(Mode.PLAYBACK)
    before.tasks.end_all()
    later = restarted(before, bag)
    open_cell(later.session, later.cell)
    later.tasks.end_all()
    assert later.model.good == {1}
    watch(later.session, bag)
    later.tasks.end_all()
    assert later.model.good == {0, 1}


def test_what_was_dragged_together_counts_again(qtbot: Any, bag: str) -> None:
    before = compared(bag)
    moment = next(it for it in before.model.moments if it.run == 3)
    before.model.anchor(moment, moment.position_s + 0.5)
    before.tasks.end_all()
    later = restarted(before, bag)
    open_cell(later.session, later.cell)
    watch(later.session, bag)
    later.tasks.end_all()
    assert later.model.anchors(3) == before.model.anchors(3) != ()
    assert later.verdicts() == before.verdicts()


def test_what_an_earlier_version_kept_of_alignments_counts(qtbot: Any, bag: str) -> None:
    later = Comparing(Path(bag).parent)
    later.model.restore({'last': [bag], 'comparisons': [{
        'recording': [bag], 'added': [], 'good': [[bag, 'a.bag#1'], [bag, 'a.bag#2']],
        'anchors': [[bag, 'a.bag#4', [[4.0, 4.5]]]], 'compared': True}]})
    open_cell(later.session, later.cell)
    watch(later.session, bag)
    later.tasks.end_all()
    assert later.model.anchors(3) == ((4.0, 4.5),)


def test_a_reference_that_is_gone_is_told_once(qtbot: Any, bag: str) -> None:
    before = compared(bag)
    Path(bag).unlink()
    later = restarted(before, bag)
    open_cell(later.session, later.cell)
    later.tasks.end_all()
    assert len(later.told) == 1 and bag in later.told[0]
    last = restarted(later, bag)
    open_cell(last.session, last.cell)
    assert last.tasks.held == []


def test_runs_of_another_configuration_are_kept_until_it_is_back(qtbot: Any, bag: str) -> None:
    """The operator did not ask for them, so no message is shown."""
    later = restarted(compared(bag), bag)
    run = replace(later.cell.run, begin='never') if later.cell.run else None
    never = replace(later.cell.events[0], name='never', topic='/none')
    open_cell(later.session, replace(later.cell, run=run, events=(*later.cell.events, never)))
    later.tasks.end_all()
    assert later.told == [] and later.model.runs == ()
    again = restarted(later, bag)
    open_cell(again.session, again.cell)
    again.tasks.end_all()
    assert again.model.good == {0, 1}


def test_nothing_but_a_file_is_read_or_written(tmp_path: Path) -> None:
    path = tmp_path / 'session.json'
    os.mkfifo(path)
    session = Program(path)
    session.tick('arm')
    assert [it.endswith('is not a regular file') for it in session.told] == [True, True]


def test_a_file_nested_too_deeply_is_put_aside(tmp_path: Path) -> None:
    path = tmp_path / 'session.json'
    path.write_text('[' * 100_000)
    assert 'is damaged' in Program(path).told[0]
