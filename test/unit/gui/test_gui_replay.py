# SPDX-License-Identifier: BSD-3-Clause
"""Instant replay: the model with a second cell that the test controls, and the operator's view."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, List

import pytest
from held_tasks import Refused
from playback_stand import PAUSED, PlaybackStand
from PyQt5.QtCore import QTimer
from pytestqt.qtbot import QtBot
from session_stand import run

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.plan import BAG_PART, RVIZ_PART
from process_visualizer.gui.live.live_panel import ReplayBar
from process_visualizer.gui.live.replay_model import MemoryCopy, ReplayModel, ReplayPhase
from process_visualizer.gui.session import Session
from process_visualizer.launching.part_report import NodeReport, PartReport, PartState

BEGIN_S = 970.0
"""Start of the memory on the recorder's clock; now it is 1000."""


class Tools:
    """Stand-in for ReplayLink: notes the requests; writes real files."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.asked = folder, []  # type: Tuple[Path, List[Any]]
        self.reason, self.copies = '', 0

    def copy_memory(self) -> MemoryCopy:
        if self.reason:
            raise Refused(self.reason)
        self.copies += 1
        return MemoryCopy(str(self.folder / 'replay.bag'), BEGIN_S, BEGIN_S + 30.0)

    def start(self, choice: Choice) -> None:
        self.asked.append(('start', choice))

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_arguments: self.asked.append((name,))

    def names(self) -> List[str]:
        names, self.asked = [it[0] for it in self.asked], []
        return names


class Stand(PlaybackStand):
    """Replay of a running cell."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        (folder / 'copies').mkdir()
        (folder / 'cell.xml').write_text(
            '<visualizer><device type="other" name="machine"><topic name="a"/></device>'
            '</visualizer>')
        cell = XmlParser().parse(str(folder / 'cell.xml'))
        self.choice = Choice(cell, Mode.REALTIME, cell.devices, RvizStart.OPTIONAL)
        self.tools, self.session = Tools(folder / 'copies'), Session()
        self.replay = ReplayModel(self.tasks, self.model, self.tools,  # type: ignore[arg-type]
                                  (Refused, OSError), self.session)
        self.replay.failed.connect(self.failures.append)

    def report(self, part: str, state: PartState, *nodes: NodeReport) -> None:
        self.replay.take_report(PartReport(part, state, nodes, reason='it has died'))

    def tell(self, position_s: float = 0.0, **changes: Any) -> None:
        """Send the state of the second cell's player."""
        bag = self.tools.folder / 'replay.bag'
        self.snapshot = PAUSED._replace(stamp_s=self.now_s, begin_s=BEGIN_S, duration_s=30.0,
                                        position_s=position_s, files=(str(bag),), **changes)
        self.replay.take_state(self.snapshot)

    def begin(self, time_s: float = 990.0) -> None:
        """Show a moment, with all necessary steps."""
        self.replay.show(time_s, self.choice)
        self.tasks.end_all()
        self.report(RVIZ_PART, PartState.RUNNING)
        self.report(BAG_PART, PartState.RUNNING)
        self.tasks.end_all()
        self.tell()
        self.tasks.end_all()


@pytest.fixture
def stand(tmp_path: Path, qtbot: QtBot) -> Stand:
    return Stand(tmp_path)


def test_a_moment_of_the_memory_is_shown_when_everything_is_there(stand: Stand) -> None:
    stand.replay.show(990.0, stand.choice)
    assert stand.replay.phase is ReplayPhase.PREPARING
    stand.tasks.end_all()
    choice = stand.tools.asked[0][1]
    assert (choice.mode, choice.is_replay) == (Mode.PLAYBACK, True)
    assert choice.bag == str(stand.tools.folder / 'replay.bag')
    stand.report(BAG_PART, PartState.RUNNING)
    stand.tell()
    stand.tasks.end_all()
    assert stand.tools.names() == ['start', 'follow']
    assert stand.replay.phase is ReplayPhase.PREPARING  # RViz is not up yet
    stand.report(RVIZ_PART, PartState.RUNNING)
    assert stand.commands() == [('seek', 20.0)]
    assert stand.tools.names() == ['show']
    assert stand.replay.phase is ReplayPhase.SHOWN
    stand.tell(20.0)
    assert stand.replay.time_s == 990.0


def test_it_is_shown_with_what_the_devices_show(stand: Stand) -> None:
    """The objects of a node that is still starting would be missing."""
    stand.report('kinect', PartState.STARTING)
    stand.begin()
    assert stand.replay.phase is ReplayPhase.PREPARING
    stand.report('kinect', PartState.RUNNING)
    stand.tasks.end_all()
    assert stand.replay.phase is ReplayPhase.SHOWN


def test_a_device_that_never_starts_is_not_waited_for(stand: Stand) -> None:
    stand.report('kinect', PartState.STARTING)
    stand.begin()
    stand.replay.findChild(QTimer).timeout.emit()
    stand.tasks.end_all()
    assert stand.replay.phase is ReplayPhase.SHOWN


def test_the_newest_wish_counts_while_it_is_prepared(stand: Stand) -> None:
    stand.replay.show(990.0, stand.choice)
    for time_s in (985.0, 980.0, 975.0):
        stand.replay.show(time_s, stand.choice)
    assert stand.replay.time_s == 975.0
    stand.begin(975.0)
    assert [it for it in stand.client.taken() if it[0] == 'seek'] == [('seek', 5.0)]


def test_a_moment_that_is_no_longer_in_memory_is_not_replayed(stand: Stand) -> None:
    """The beginning of the memory was shown instead."""
    stand.replay.show(BEGIN_S - 60.0, stand.choice)
    stand.tasks.end_all()
    assert stand.replay.is_live and stand.tools.names() == [], 'no second cell is started for it'
    assert stand.failures == ['That moment, 1 min 30.0 s ago, can no longer be replayed: '
                              "the recorder's memory begins 30.0 s ago"]
    stand.begin(BEGIN_S - 1.0)  # of the left end of the curves, lost during copying
    assert stand.replay.phase is ReplayPhase.SHOWN


def test_going_on_dragging_is_seeking(stand: Stand) -> None:
    stand.begin()
    stand.client.taken()
    stand.replay.show(980.0, stand.choice)
    assert stand.commands() == [('seek', 10.0)]
    assert stand.tools.names().count('start') == 1


def test_back_to_live_hides_it_and_the_next_replay_has_a_newer_copy(stand: Stand) -> None:
    stand.begin()
    stand.tools.names()
    stand.replay.leave()
    assert stand.replay.is_live
    assert ('pause',) in stand.commands()
    assert stand.tools.names() == ['hide']
    stand.tell()  # it still sends its state
    assert stand.replay.is_live
    stand.now_s = 1020.0
    stand.replay.show(1010.0, stand.choice)  # the copy ends at 1000
    stand.tell()  # this is still the last player
    stand.tasks.end_all()
    stand.report(BAG_PART, PartState.STOPPED)
    stand.report(BAG_PART, PartState.RUNNING)
    stand.tell()
    stand.tasks.end_all()
    assert stand.replay.phase is ReplayPhase.SHOWN
    assert stand.tools.names() == ['start', 'follow', 'show']
    assert stand.tools.copies == 2


def test_a_replay_is_left_for_a_moment_after_its_copy(stand: Stand) -> None:
    """*Replay* of a new alarm showed the end of the older replay."""
    stand.begin()
    stand.replay.leave_for(985.0)
    assert stand.replay.phase is ReplayPhase.SHOWN
    stand.replay.leave_for(1010.0)
    assert stand.replay.is_live
    stand.replay.show(1010.0, stand.choice)
    stand.tasks.end_all()
    assert stand.tools.copies == 2


def test_a_moment_of_the_last_copy_is_shown_at_once(stand: Stand) -> None:
    stand.begin()
    stand.replay.leave()
    stand.tasks.end_all()
    stand.tools.names()
    stand.client.taken()
    stand.replay.show(985.0, stand.choice)
    stand.tasks.end_all()
    assert stand.client.taken() == [('seek', 15.0)]
    assert stand.tools.names() == ['show'] and stand.tools.copies == 1
    assert stand.replay.phase is ReplayPhase.SHOWN


def test_with_other_devices_everything_is_prepared_anew(stand: Stand) -> None:
    stand.begin()
    stand.replay.leave()
    stand.tasks.end_all()
    stand.replay.show(985.0, replace(stand.choice, devices=()))
    assert stand.replay.phase is ReplayPhase.PREPARING
    stand.tasks.end_all()
    assert stand.tools.copies == 2


def test_left_while_it_is_prepared_it_stays_live(stand: Stand) -> None:
    stand.replay.show(990.0, stand.choice)
    stand.replay.leave()
    stand.tasks.end_all()
    stand.report(RVIZ_PART, PartState.RUNNING)
    stand.report(BAG_PART, PartState.RUNNING)
    stand.tell()
    stand.tasks.end_all()
    assert stand.replay.is_live
    assert 'show' not in stand.tools.names()


def test_its_window_follows_that_of_the_running_cell(stand: Stand) -> None:
    stand.replay.follow_window()
    assert stand.tools.asked == [], 'it is not to be seen'
    stand.begin()
    stand.tools.names()
    for _ in range(3):
        stand.replay.follow_window()
    stand.tasks.end_all()
    assert stand.tools.names() == ['move', 'move'], 'at once, and where it is in the end'
    stand.replay.leave()
    stand.replay.follow_window()
    stand.tasks.end_all()
    assert stand.tools.names() == ['hide']


def test_a_window_that_is_left_does_not_return_by_following(stand: Stand) -> None:
    stand.begin()
    stand.tools.names()
    stand.replay.follow_window()
    stand.replay.follow_window()
    stand.replay.leave()
    stand.tasks.end_all()
    assert stand.tools.names()[-1] == 'hide'


def test_without_a_memory_it_stays_live_and_says_why(stand: Stand) -> None:
    stand.tools.reason = 'there is nothing in memory'
    stand.replay.show(990.0, stand.choice)
    stand.tasks.end_all()
    assert stand.replay.is_live
    assert stand.failures == ['Replay failed: there is nothing in memory']


def test_a_player_that_dies_ends_it(stand: Stand) -> None:
    stand.begin()
    stand.report(BAG_PART, PartState.FAILED)
    assert stand.replay.is_live
    assert stand.failures == ['The replay has ended: it has died']


def test_an_rviz_that_does_not_start_ends_it(stand: Stand) -> None:
    stand.replay.show(990.0, stand.choice)
    stand.tasks.end_all()
    stand.report(RVIZ_PART, PartState.FAILED)
    assert stand.replay.is_live
    assert stand.failures == ['The replay has ended: it has died']


def test_a_window_that_is_closed_ends_it_without_complaint(stand: Stand) -> None:
    stand.begin()
    stand.report(RVIZ_PART, PartState.STOPPED)
    assert stand.replay.is_live and not stand.failures


def test_its_rviz_that_is_killed_comes_back_to_the_same_moment(stand: Stand) -> None:
    stand.begin()
    stand.tools.names()
    killed = NodeReport('/rviz').registered().exited(-9)
    stand.report(RVIZ_PART, PartState.RUNNING, killed)
    stand.report(RVIZ_PART, PartState.FAILED, killed)  # its roslaunch ends with it
    stand.tasks.end_all()
    assert stand.replay.phase is ReplayPhase.PREPARING
    assert stand.tools.names() == ['restart']
    for state in (PartState.STOPPING, PartState.STOPPED, PartState.STARTING, PartState.RUNNING):
        assert not stand.replay.is_live
        stand.report(RVIZ_PART, state)
    stand.tasks.end_all()
    assert stand.tools.names() == ['show']
    assert stand.replay.phase is ReplayPhase.SHOWN and not stand.failures
    stand.report(RVIZ_PART, PartState.RUNNING, killed)  # once more
    stand.report(RVIZ_PART, PartState.FAILED, killed)
    assert stand.replay.is_live and stand.tools.names() == []
    assert stand.failures == ['The replay has ended with its RViz (killed by SIGKILL)']


def test_a_window_that_is_closed_before_it_shows_anything_is_told(stand: Stand) -> None:
    stand.replay.show(990.0, stand.choice)
    stand.tasks.end_all()
    stand.report(RVIZ_PART, PartState.STOPPED)
    assert stand.replay.is_live
    assert stand.failures == ['Replay failed: its RViz was closed while it started']


def test_the_end_of_the_cell_ends_it(stand: Stand) -> None:
    run(stand.session, None)  # there was none
    stand.tasks.end_all()
    assert stand.tools.names() == []
    stand.begin()
    run(stand.session, None)
    stand.tasks.end_all()
    assert stand.replay.is_live
    names = stand.tools.names()
    assert 'interrupt' in names and names[-1] == 'stop'


def test_each_copy_is_told_apart(stand: Stand) -> None:
    """They have the same name: values of the last one would be shown with the new picture."""
    assert stand.replay.played.paths == ()
    numbers = []
    for _copy in range(2):
        stand.begin()
        played = stand.replay.played
        assert played.paths == (str(stand.tools.folder / 'replay.bag'),)
        assert played.devices == stand.choice.devices
        numbers.append(played.copy_number)
        stand.replay.leave()
        stand.now_s += 60.0
        stand.tell(30.0)
        stand.report(RVIZ_PART, PartState.STOPPED)
    assert numbers[0] != numbers[1]


def test_the_nodes_of_a_device_are_restarted_once(stand: Stand, qtbot: QtBot) -> None:
    """Otherwise their old markers would stay while the moment changes."""
    bar = ReplayBar(stand.replay, lambda: stand.now_s)
    qtbot.addWidget(bar)
    stand.begin()
    stand.tools.names()
    alive = NodeReport('/arm/joint_proc').registered()
    for node in (alive, alive.exited(-9), alive.exited(-9)):
        stand.report('arm', PartState.RUNNING, node)
        stand.tasks.end_all()
    assert stand.tools.names() == ['restart']
    assert bar.state.text().endswith('ago. arm has ended: old data')
    stand.replay.leave()
    stand.begin()
    assert 'start' in stand.tools.names(), 'a replay of which a part is dead is prepared anew'
    stand.report('arm', PartState.RUNNING, alive)
    assert stand.replay.trouble == '' and bar.state.text().endswith(' ago')


def test_the_bar_says_how_long_ago_it_is(stand: Stand, qtbot: QtBot) -> None:
    bar = ReplayBar(stand.replay, lambda: stand.now_s)
    qtbot.addWidget(bar)
    assert bar.isHidden()
    stand.replay.show(990.0, stand.choice)
    assert not bar.isHidden() and bar.state.text() == 'Preparing the replay…'
    assert not bar.play.isEnabled()
    before_s, stand.now_s = stand.now_s, stand.now_s + 3.2
    bar.show_state()
    assert bar.state.text() == 'Preparing the replay… 3 s'
    stand.now_s = before_s + 20.0
    bar.show_state()
    assert bar.state.text() == 'Preparing the replay… 20 s: the running cell has priority'
    stand.now_s = before_s
    stand.begin()
    stand.now_s = 1002.5
    stand.tell(20.0)
    assert bar.state.text() == 'REPLAY  12.5 s ago'
    stand.now_s = 1065.0
    bar.show_state()
    assert bar.state.text() == 'REPLAY  1 min 15.0 s ago'  # as its RViz shows
    bar.back.click()
    assert bar.isHidden() and stand.replay.is_live
