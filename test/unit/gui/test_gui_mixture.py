# SPDX-License-Identifier: BSD-3-Clause
"""Publishers that would be mixed: checked before a launch, reported while nodes run."""
from __future__ import annotations

from pathlib import Path
from typing import Any, List, Tuple

import pytest
from held_tasks import HeldTasks
from playback_stand import PAUSED

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.cell.launch_model import LaunchGuard, MixtureModel
from process_visualizer.gui.cell.notices import MixtureNotice
from process_visualizer.gui.session import Session
from process_visualizer.health.other_publishers import OtherPublisher, Others

DRIVER = OtherPublisher('/oven/heat', '/oven_driver')
PLAYER = OtherPublisher('/oven/heat', '/play_1')


@pytest.fixture
def choice(tmp_path: Path) -> Choice:
    path = tmp_path / 'cell.xml'
    path.write_text('<visualizer><device type="other" name="oven"/></visualizer>')
    cell = XmlParser({}).parse(str(path))
    return Choice(cell, Mode.PLAYBACK, cell.devices, bag='/seam.bag')


class Guarded:
    """Guard whose checks end on the test's command."""

    def __init__(self) -> None:
        self.tasks = HeldTasks()
        self.launched: List[Choice] = []
        self.asked: List[str] = []
        self.settled = 0
        self.others: Others = ()
        self.guard = LaunchGuard(self.tasks, self.launched.append, lambda _choice: self.others)
        self.guard.asked.connect(lambda text, _mode: self.asked.append(text))
        self.guard.settled.connect(self._settle)

    def _settle(self) -> None:
        self.settled += 1

    def look_again(self) -> None:
        """Run the periodic check."""
        self.guard._timer.timeout.emit()
        self.tasks.end_all()


@pytest.fixture
def guarded(qtbot: Any) -> Guarded:
    return Guarded()


def test_it_launches_where_nobody_is_in_the_way(guarded: Guarded, choice: Choice) -> None:
    guarded.guard.launch(choice)
    assert guarded.launched == [] and guarded.guard.is_looking
    guarded.tasks.end_all()
    assert guarded.launched == [choice] and guarded.asked == []


def test_it_asks_once_and_launches_when_the_driver_has_gone(guarded: Guarded,
                                                            choice: Choice) -> None:
    guarded.others = (DRIVER,)
    guarded.guard.launch(choice)
    guarded.tasks.end_all()
    guarded.look_again()
    assert len(guarded.asked) == 1 and guarded.launched == [] and not guarded.guard.is_looking
    assert '/oven/heat is published by /oven_driver' in guarded.asked[0]
    guarded.others, before = (), guarded.settled
    guarded.look_again()
    assert guarded.launched == [choice] and guarded.settled > before
    assert not guarded.guard.is_waiting


def test_it_launches_all_the_same_or_never(guarded: Guarded, choice: Choice) -> None:
    guarded.others = (DRIVER,)
    guarded.guard.launch(choice)
    guarded.tasks.end_all()
    guarded.guard.launch_all_the_same()
    assert guarded.launched == [choice]
    guarded.guard.launch(choice)
    guarded.guard.cancel()
    guarded.others = ()
    guarded.look_again()
    assert guarded.launched == [choice]


@pytest.fixture
def session() -> Session:
    return Session()


def beside(session: Session) -> 'Tuple[MixtureModel, HeldTasks, List[Others]]':
    """A model, its tasks and the publishers that it will find; the last entry is found again."""
    tasks, seen = HeldTasks(), [()]  # type: Tuple[HeldTasks, List[Others]]
    return MixtureModel(tasks, session, lambda _choice, _own: seen[0]), tasks, seen


def test_what_is_seen_beside_a_run_is_told_until_it_is_gone(qtbot: Any, session: Session,
                                                            choice: Choice) -> None:
    model, tasks, seen = beside(session)
    begun: List[int] = []
    model.begun.connect(lambda: begun.append(1))
    notice = MixtureNotice(model)
    qtbot.addWidget(notice)

    def look() -> None:
        model._timer.timeout.emit()
        tasks.end_all()

    session.set_run(choice, True, {})
    look()
    assert model.sentences == () and notice.isHidden()
    seen[0] = (DRIVER,)
    look()
    look()
    assert model.sentences == ('/oven/heat is published by /oven_driver',)
    assert not notice.isHidden() and begun == [1]
    seen[0] = ()
    look()
    assert notice.isHidden()


def test_what_the_player_tells_goes_with_it(qtbot: Any, session: Session, choice: Choice) -> None:
    model, _tasks, _seen = beside(session)
    notice = MixtureNotice(model)
    qtbot.addWidget(notice)
    session.set_run(choice, True, {})
    told = PAUSED._replace(others=('/q is published by /driver',))
    session.take_player(told)
    assert not notice.isHidden()
    assert notice._text.text().startswith('/q is published by /driver: the picture ')
    session.set_run(None, False, {})
    assert notice.isHidden() and model.sentences == ()
    session.take_player(told)  # the last message of one that has ended
    assert notice.isHidden()


def test_nobody_is_known_while_the_master_does_not_answer(qtbot: Any, session: Session,
                                                          choice: Choice) -> None:
    def fail(_choice: Choice, _own: Any) -> Others:
        raise OSError('no master')
    tasks = HeldTasks()
    model = MixtureModel(tasks, session, fail)
    session.set_run(choice, True, {})
    for _ in range(2):
        model._timer.timeout.emit()
        tasks.end_all()
    assert model.sentences == ()


def test_our_own_player_that_is_being_stopped_is_no_mixture(qtbot: Any, session: Session,
                                                            choice: Choice) -> None:
    model, tasks, seen = beside(session)
    seen[0] = (DRIVER,)
    session.set_run(choice, False, {})  # it is being launched; the old nodes still end
    model._timer.timeout.emit()
    tasks.end_all()
    assert model.sentences == ()
    session.set_run(choice, True, {})
    model._timer.timeout.emit()
    session.set_run(choice, False, {})  # answers from before no longer count
    tasks.end_all()
    assert model.sentences == ()
