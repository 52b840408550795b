# SPDX-License-Identifier: BSD-3-Clause
"""The tab Compare: runs are found, marked as good, compared, and their departures shown."""
from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, List

import numpy as np
import pytest
import rosbag
from cycle_bags import BEGIN_S, write_bag
from held_tasks import HeldTasks
from page_reader import PageReader
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QFileDialog, QTreeWidget, QTreeWidgetItem
from session_stand import open_cell, play, run

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.ghost_client import GhostError
from process_visualizer.film import film
from process_visualizer.gui.compare import ghost_model
from process_visualizer.gui.compare.compare_model import BandsModel, CompareModel, shared_span
from process_visualizer.gui.compare.compare_panel import ComparePanel, with_ending
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.session import Session
from process_visualizer.page.shared_page import ChosenSpans
from process_visualizer.robot.joints import joint_track
from process_visualizer.runs.comparison.ghost import GhostTrack, LiveReference
from process_visualizer.runs.comparison.timeline_bands import MomentKind
from process_visualizer.runs.run import Run


class Silent:
    """Stand-in for a recorder's memory, which these tests do not read."""

    def restart(self) -> None:
        pass


class Stand:
    """Panel on a bag of four cycles, the third of which is poor."""

    def __init__(self, folder: Path, qtbot: Any) -> None:
        self.tasks, self.session = HeldTasks(), Session()
        self.session.set_mode(Mode.PLAYBACK)
        self.model = CompareModel(self.tasks, self.session)  # type: ignore[arg-type]
        self.failures: List[str] = []
        self.model.failed.connect(self.failures.append)
        self.path = write_bag(folder, cycles=4, poor=2)
        open_cell(self.session, XmlParser().parse(str(folder / 'cell.xml')))
        self.bands = BandsModel(self.tasks, self.model)  # type: ignore[arg-type]
        self.ghosts: List[Any] = []
        self.followed: List[Any] = []
        self.ghost = GhostModel(self.tasks, self.model, self.session,  # type: ignore[arg-type]
                                lambda tracks, _arrows: self.ghosts.append(tracks),
                                lambda *what: self.followed.append(what))
        self.live = LiveCurvesModel(self.tasks, Silent(), Session())  # type: ignore[arg-type]
        self.comparison = LiveComparisonModel(self.model, self.live)
        self.panel = ComparePanel(self.model, self.ghost, self.comparison, lambda: str(folder))
        self.sought: List[float] = []
        self.panel.seek_wanted.connect(self.sought.append)
        self.refusals: List[str] = []
        self.panel.refused.connect(self.refusals.append)
        qtbot.addWidget(self.panel)
        self.panel.show()

    def find(self) -> None:
        play(self.session, self.path)
        self.find_open()

    def find_open(self) -> None:
        self.panel.find.click()
        self.tasks.end_all()

    def tick(self, *rows: int) -> None:
        for row in rows:
            self.panel.runs.topLevelItem(row).setCheckState(0, Qt.Checked)

    def share(self, row: int, path: str) -> None:
        self.model.share(self.model.runs[row], self.model.shared_span(row), path)

    def compare(self) -> None:
        self.panel.compare.click()
        self.tasks.end_all()


@pytest.fixture
def stand(tmp_path: Path, qtbot: Any) -> Stand:
    return Stand(tmp_path, qtbot)


def column(tree: QTreeWidget, number: int) -> List[str]:
    return [tree.topLevelItem(row).text(number) for row in range(tree.topLevelItemCount())]


def test_without_a_recording_nothing_can_be_done(stand: Stand) -> None:
    assert not stand.panel.find.isEnabled()
    assert stand.panel.state.text() == 'Open a recording on the tab Playback first.'


def test_runs_are_found(stand: Stand) -> None:
    stand.find()
    assert column(stand.panel.runs, 0) == ['a.bag#1', 'a.bag#2', 'a.bag#3', 'a.bag#4']
    assert column(stand.panel.runs, 1)[1] == '0:11.02'
    assert not stand.panel.compare.isEnabled()
    assert stand.panel.state.text().startswith('Tick the runs that were good')


def test_the_poor_run_is_named_and_its_departure_leads_there(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    verdicts = column(stand.panel.runs, 2)
    assert verdicts[2].startswith('arm tool force from 0:2')
    assert [it for row, it in enumerate(verdicts) if row != 2] == 3 * ['in range']
    assert 'out of range first at 0:2' in stand.panel.runs.topLevelItem(2).toolTip(2)
    assert stand.panel.state.text().startswith('1 of 4 runs out of range.')
    assert stand.panel.runs.currentItem() is stand.panel.runs.topLevelItem(2)
    departures = stand.panel.departures
    assert departures.isVisible() and departures.topLevelItem(0).text(0) == 'arm tool force'
    departures.itemClicked.emit(departures.topLevelItem(0), 0)
    assert stand.sought == [pytest.approx(27.0, abs=0.1)]


def test_beside_the_running_cell_a_poor_run_still_says_what_differed(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    stand.panel.set_live(True)
    departures, refusals = stand.panel.departures, []
    assert departures.headerItem().text(0) == 'What differed'
    assert departures.topLevelItem(0).text(0) == 'arm tool force'
    stand.panel.refused.connect(refusals.append)
    departures.itemClicked.emit(departures.topLevelItem(0), 0)
    assert stand.sought == [] and 'choose Playback mode' in refusals[0]


def test_a_long_name_of_a_recording_leaves_the_verdict_its_room(stand: Stand) -> None:
    long = f'{os.path.dirname(stand.path)}/sewing_cell_left_and_right_2026-11-26-13-45-12.bag'
    os.rename(stand.path, long)
    stand.path = long
    stand.panel.resize(420, 700)
    stand.find()
    tree = stand.panel.runs
    assert column(tree, 0)[3].endswith('-12.bag#4')
    assert tree.columnWidth(0) > 0.6 * tree.viewport().width()  # there is no verdict yet
    stand.tick(0, 1)
    stand.compare()
    assert tree.columnWidth(0) == int(0.4 * tree.viewport().width())
    stand.panel.resize(2000, 700)
    assert tree.columnWidth(0) == tree.sizeHintForColumn(0)


def test_a_name_has_the_room_that_what_is_said_of_it_leaves(stand: Stand) -> None:
    stand.panel.resize(560, 700)
    tree = stand.panel.departures
    name = 'ur_rt_upper tool force direction'
    tree.show_rows([QTreeWidgetItem([name, '0:27.19', '+12 °'])], takes_room=True)
    assert 0.4 * tree.viewport().width() < tree.columnWidth(0) == tree.sizeHintForColumn(0)
    tree.show_rows([QTreeWidgetItem([name, '0:27.19', 9 * '+12 ° '])], takes_room=True)
    assert tree.columnWidth(0) == int(0.4 * tree.viewport().width())


def test_where_there_is_no_data_the_verdict_says_so(stand: Stand, tmp_path: Path) -> None:
    whole, stand.path = stand.path, str(tmp_path / 'gap.bag')
    with rosbag.Bag(whole) as before, rosbag.Bag(stand.path, 'w') as after:
        for topic, message, time in before.read_messages():
            if not 15.0 <= time.to_sec() - BEGIN_S < 16.5:
                after.write(topic, message, time)
    stand.find()
    stand.tick(0, 3)
    stand.compare()
    verdicts = column(stand.panel.runs, 2)
    assert re.match(r'in range, [12]\.\d s not judged \(data missing or late\)$', verdicts[1])
    assert verdicts[3] == 'in range'
    hint = stand.panel.runs.topLevelItem(1).toolTip(2)
    assert 'not judged: anything from 0:1' in hint and 'messages of the motion are missing' in hint


def test_bands_are_those_of_the_open_recording(stand: Stand) -> None:
    stand.find()
    stand.bands.set_columns(48.0, 480)
    stand.tasks.end_all()
    assert stand.bands.bands == {}
    stand.tick(0, 1)
    stand.compare()
    force = stand.bands.bands['arm', 'tool force']
    assert np.isfinite(force.low).sum() > 300
    assert force.departed[265:280].any() and not force.departed[:240].any()
    stand.bands.set_columns(48.0, 960)  # the curves were read again, at a higher resolution
    assert stand.bands.bands == {}
    stand.tasks.end_all()
    assert len(stand.bands.bands['arm', 'tool force'].low) == 960
    stand.tick(2)
    assert stand.bands.bands == {}


def test_a_moment_is_dragged_and_the_alignment_reset(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    stand.panel.runs.setCurrentItem(stand.panel.runs.topLevelItem(3))
    assert not stand.panel.reset.isEnabled()
    moment = next(it for it in stand.model.moments if it.run == 3 and it.label == 'stops')
    stand.model.anchor(moment, moment.position_s + 1.0)
    stand.tasks.end_all()
    found = stand.model.compared
    assert found is not None and found.comparisons[3] is not None
    assert found.comparisons[3].run_s(moment.reference_s) == pytest.approx(
        moment.position_s + 1.0 - found.comparisons[3].run.begin_s, abs=1e-3)
    assert column(stand.panel.runs, 2)[3] != 'in range'
    assert stand.panel.runs.currentItem() is stand.panel.runs.topLevelItem(3)
    assert stand.panel.reset.isEnabled()
    stand.panel.reset.click()
    stand.tasks.end_all()
    assert column(stand.panel.runs, 2)[3] == 'in range'
    assert not stand.panel.reset.isEnabled()
    assert {it.kind for it in stand.model.moments} == {MomentKind.EVENT, MomentKind.DEPARTURE}


def test_the_ghost_is_shown_while_the_player_runs(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    run(stand.session, Mode.PLAYBACK)
    assert stand.ghosts == []
    stand.compare()
    assert len(stand.ghosts) == 1
    assert stand.panel.ghost.isEnabled() and stand.panel.ghost.isChecked()
    stand.panel.ghost.click()
    stand.tasks.end_all()
    assert stand.ghosts[1:] == [()]
    stand.panel.ghost.click()
    stand.tasks.end_all()
    run(stand.session, None)
    run(stand.session, Mode.PLAYBACK)  # another player: its node must be informed
    stand.tasks.end_all()
    assert len(stand.ghosts) == 4
    stand.model.set_good(1, False)
    stand.tasks.end_all()
    assert stand.ghosts[4:] == [()]


def test_a_ghost_that_cannot_be_shown_is_told(stand: Stand) -> None:
    told: List[str] = []

    def refuse(_tracks: Any, _arrows: Any) -> None:
        raise GhostError('The ghost cannot be shown: no model')

    model = GhostModel(stand.tasks, stand.model, stand.session,  # type: ignore[arg-type]
                       refuse, lambda *_what: None)
    model.failed.connect(told.append)
    stand.find()
    stand.tick(0, 1)
    run(stand.session, Mode.PLAYBACK)
    stand.compare()
    assert told == ['The ghost cannot be shown: no model']


@pytest.mark.parametrize('then', [Mode.REALTIME, Mode.PLAYBACK])
def test_what_is_forgotten_while_the_mode_changes_is_no_longer_drawn(
        stand: Stand, monkeypatch: Any, then: Mode) -> None:
    """The node stays when the mode is changed by a click."""
    follow_arm(monkeypatch)
    run(stand.session, Mode.REALTIME)
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    run(stand.session, None)
    play(stand.session)  # another one opens
    assert len(stand.followed) == 1 and stand.ghosts == []
    run(stand.session, then)
    stand.tasks.end_all()
    if then is Mode.PLAYBACK:
        assert (len(stand.followed), stand.ghosts) == (1, [()])
    else:
        assert (stand.followed[1:], stand.ghosts) == ([(LiveReference(()), True)], [])
    run(stand.session, None)
    run(stand.session, then)
    stand.tasks.end_all()
    assert len(stand.followed) + len(stand.ghosts) == 2, 'it is told once'


def test_a_node_that_has_ended_with_what_it_drew_is_no_problem(stand: Stand) -> None:
    told: List[str] = []
    calls: List[int] = []

    def show(tracks: Any, _arrows: Any) -> None:
        calls.append(len(tracks))
        if len(calls) > 1:
            raise GhostError('The ghost cannot be shown: there is no node')

    model = GhostModel(stand.tasks, stand.model, stand.session,  # type: ignore[arg-type]
                       show, lambda *_what: None)
    model.failed.connect(told.append)
    run(stand.session, Mode.PLAYBACK)
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    run(stand.session, None)
    play(stand.session)
    run(stand.session, Mode.PLAYBACK)
    stand.tasks.end_all()
    assert (len(calls), told) == (2, [])


def test_live_robots_that_cannot_be_followed_are_told(stand: Stand) -> None:
    told: List[str] = []
    stand.ghost.failed.connect(told.append)
    run(stand.session, Mode.REALTIME)
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    assert told == ['The live run is not compared: a.bag#1 has no robot that can be followed. That '
                    'takes its recorded joints, and a model in the configuration.']


def follow_arm(monkeypatch: Any) -> LiveReference:
    """Add a robot that can be followed; return its reference."""
    reference = LiveReference((GhostTrack('arm', '', joint_track(
        ('turn',), np.array([0.0]), np.array([0.0])), np.empty((0, 1))),))
    monkeypatch.setattr(ghost_model, 'live_reference', lambda _cell, _run: reference)
    return reference


def test_live_robots_are_followed_beside_the_reference(stand: Stand, monkeypatch: Any) -> None:
    reference = follow_arm(monkeypatch)
    run(stand.session, Mode.REALTIME)
    stand.find()
    stand.tick(0, 1)
    assert stand.followed == []
    stand.compare()
    assert stand.followed == [(reference, True)] and stand.ghosts == []
    stand.panel.ghost.click()
    stand.tasks.end_all()
    assert stand.followed[1:] == [(reference, False)], 'it is judged all the same'
    run(stand.session, None)
    run(stand.session, Mode.REALTIME)  # launched again: another node
    stand.tasks.end_all()
    assert stand.followed[2:] == [(reference, False)]
    stand.tick(2)
    stand.tasks.end_all()
    assert stand.followed[3:] == [(LiveReference(()), False)]
    run(stand.session, Mode.PLAYBACK)
    stand.tasks.end_all()
    assert stand.ghosts == [] and len(stand.followed) == 4


def test_only_running_robots_have_a_ghost(stand: Stand, monkeypatch: Any) -> None:
    """RViz has no frames of the others."""
    reference, followed = follow_arm(monkeypatch), []
    monkeypatch.setattr(ghost_model, 'live_reference', lambda cell, _run: (
        followed.append([it.name for it in cell.devices]) or reference))
    run(stand.session, Mode.REALTIME)
    stand.find()
    stand.tick(0)
    stand.compare()
    names = [it.name for it in stand.session.chosen]
    stand.session.choose(stand.session.chosen[:1])
    run(stand.session, Mode.REALTIME)
    stand.tasks.end_all()
    assert followed == [names, names[:1]] and len(names) > 1


def test_in_real_time_mode_a_reference_is_added_without_an_open_recording(stand: Stand) -> None:
    stand.panel.set_live(True)
    assert stand.panel.state.text().startswith('Add a recording with good runs')
    assert stand.panel.add.isEnabled() and not stand.panel.find.isEnabled()
    stand.model.add(stand.path)
    stand.tasks.end_all()
    assert column(stand.panel.runs, 0)[0] == 'a.bag#1'
    stand.tick(0, 1)
    stand.compare()
    assert stand.panel.state.text().endswith(
        'The devices are compared with these runs while they run.')
    stand.panel.departures.itemClicked.emit(stand.panel.departures.topLevelItem(0), 0)
    assert stand.sought == [], 'there is no player to go there'
    stand.panel.set_live(False)
    assert 'Launch' not in stand.panel.state.text()


def test_the_running_cell_has_its_comparison_again_after_a_recording_was_played(
        stand: Stand, tmp_path: Path) -> None:
    stand.session.set_mode(Mode.REALTIME)
    stand.model.add(stand.path)
    stand.tasks.end_all()
    stand.tick(0, 1)
    stand.compare()
    before = column(stand.panel.runs, 2)
    other = write_bag(tmp_path, 'b.bag')
    stand.session.set_mode(Mode.PLAYBACK)
    play(stand.session, other)
    stand.tasks.end_all()
    assert stand.model.runs == () and stand.model.paths == (other,)
    stand.find_open()
    stand.tick(1)
    stand.session.set_mode(Mode.REALTIME)
    stand.tasks.end_all()
    assert stand.model.paths == (stand.path,) and stand.model.good == {0, 1}
    assert column(stand.panel.runs, 2) == before
    stand.session.set_mode(Mode.PLAYBACK)
    stand.tasks.end_all()
    assert stand.model.paths == (other,) and stand.model.good == {1}


def test_the_running_cell_is_first_compared_as_in_playback(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    stand.session.set_mode(Mode.REALTIME)
    stand.tasks.end_all()
    assert stand.model.good == {0, 1} and stand.model.compared is not None
    stand.model.set_good(0, False)
    stand.session.set_mode(Mode.PLAYBACK)
    stand.tasks.end_all()
    assert stand.model.good == {0, 1} and len(stand.model.of_recording) == 4


def test_a_reference_whose_file_is_gone_is_told(stand: Stand) -> None:
    stand.panel.set_live(True)
    stand.model.add(stand.path)
    stand.tasks.end_all()
    Path(stand.path).unlink()
    stand.panel.find.click()
    stand.tasks.end_all()
    assert len(stand.failures) == 1 and 'a.bag' in stand.failures[0]
    assert stand.panel.add.isEnabled() and stand.model.activity == ''


def test_another_choice_of_good_runs_forgets_the_verdicts(stand: Stand) -> None:
    stand.find()
    stand.tick(0)
    stand.compare()
    stand.tick(1)
    assert column(stand.panel.runs, 2) == [''] * 4
    assert stand.model.good == {0, 1}


def test_a_further_recording_is_added(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    other = write_bag(tmp_path, 'b.bag', poor=0)
    stand.model.add(other)
    stand.tasks.end_all()
    assert column(stand.panel.runs, 0)[4:] == ['b.bag#1', 'b.bag#2']
    stand.tick(0)
    stand.compare()
    stand.panel.runs.setCurrentItem(stand.panel.runs.topLevelItem(4))
    stand.panel.departures.itemClicked.emit(stand.panel.departures.topLevelItem(0), 0)
    assert stand.sought == []  # it is not the open recording
    assert stand.refusals == [f'b.bag#1 is in a recording that is not open: open {other} on the '
                              'tab Playback to go there']


def test_what_was_ticked_and_judged_stays_when_a_recording_is_added(
        stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    before = column(stand.panel.runs, 2)
    was = stand.model.compared
    stand.model.add(write_bag(tmp_path, 'b.bag', poor=0))
    assert column(stand.panel.runs, 2) == before, 'while it is read'
    stand.tasks.end_all()
    assert stand.model.good == {0, 1}
    verdicts = column(stand.panel.runs, 2)
    assert verdicts[:4] == before and verdicts[4] != 'in range' and verdicts[5] == 'in range'
    now = stand.model.compared
    assert was is not None and now is not None and now.good is was.good, 'the band is the same'


def test_ticks_that_change_while_a_recording_is_added_count(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    stand.model.add(write_bag(tmp_path, 'b.bag'))
    stand.model.set_good(1, False)
    stand.tasks.end_all()
    assert stand.model.good == {0} and stand.model.compared is None
    assert len(stand.model.runs) == 6


def test_runs_that_are_found_again_stay_ticked_and_are_compared(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.panel.find.click()
    stand.tasks.end_all()
    assert stand.model.good == {0, 1} and stand.model.compared is None
    stand.compare()
    before = column(stand.panel.runs, 2)
    stand.panel.find.click()
    stand.tasks.end_all()
    assert stand.model.good == {0, 1}
    assert column(stand.panel.runs, 2) == before != [''] * 4


def test_the_live_cell_is_compared_on_while_a_recording_is_added(
        stand: Stand, monkeypatch: Any, tmp_path: Path) -> None:
    follow_arm(monkeypatch)
    run(stand.session, Mode.REALTIME)
    stand.model.add(stand.path)
    stand.tasks.end_all()
    stand.tick(0, 1)
    stand.compare()
    stand.model.add(write_bag(tmp_path, 'b.bag'))
    stand.tasks.end_all()
    assert len(stand.followed) == 1, 'it is told once'


def test_what_was_aligned_is_aligned_when_the_reference_is_used_again(stand: Stand) -> None:
    stand.find()
    stand.tick(0, 1)
    stand.compare()
    moment = next(it for it in stand.model.moments if it.run == 3 and it.label == 'stops')
    stand.model.anchor(moment, moment.position_s + 1.0)
    stand.tasks.end_all()
    said = stand.model.anchors(3)
    verdict = column(stand.panel.runs, 2)[3]
    assert said and verdict != 'in range'
    stand.model.set_good(1, False)
    stand.model.set_good(1, True)
    stand.compare()
    assert stand.model.anchors(3) == said and column(stand.panel.runs, 2)[3] == verdict
    stand.model.set_good(0, False)  # another reference
    stand.compare()
    assert stand.model.anchors(3) == () and column(stand.panel.runs, 2)[3] == 'in range'
    stand.model.set_good(0, True)
    stand.compare()
    assert stand.model.anchors(3) == said


def test_the_parts_of_a_recording_are_one(stand: Stand, tmp_path: Path) -> None:
    parts = [write_bag(tmp_path, f'p_{number}.bag', part_of_s=span, cycles=4, poor=2)
             for number, span in enumerate(((0.0, 27.5), (27.5, 48.0)))]
    play(stand.session, *parts)
    stand.panel.find.click()
    stand.tasks.end_all()
    assert column(stand.panel.runs, 0)[2:] == ['p_0.bag#3', 'p_0.bag#4']
    stand.tick(0, 1)
    stand.compare()
    assert len(stand.model.of_recording) == 4
    stand.panel.departures.itemClicked.emit(stand.panel.departures.topLevelItem(0), 0)
    assert stand.sought == [pytest.approx(27.0, abs=0.1)]


def test_what_cannot_be_read_is_told_and_forgotten(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.model.add(str(tmp_path / 'none.bag'))
    stand.tasks.end_all()
    assert len(stand.failures) == 1 and 'none.bag' in stand.failures[0]
    assert stand.model.activity == ''
    stand.panel.find.click()
    stand.tasks.end_all()
    assert len(stand.model.runs) == 4


def test_what_is_canceled_comes_to_nothing(stand: Stand) -> None:
    play(stand.session, stand.path)
    stand.panel.find.click()
    assert stand.panel.cancel.isEnabled()
    stand.panel.cancel.click()
    stand.tasks.end_all()
    assert stand.model.runs == () and stand.failures == []
    assert not stand.panel.cancel.isEnabled()


def test_another_recording_forgets_the_last_ones_runs(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.panel.find.click()  # in progress
    play(stand.session, write_bag(tmp_path, 'b.bag'))
    stand.tasks.end_all()
    assert stand.model.runs == ()
    assert stand.panel.find.isEnabled()


def test_a_row_that_is_ticked_stays_the_same_row(stand: Stand) -> None:
    """It is still used after the models have answered, so it must not be deleted."""
    stand.find()
    stand.tick(0)
    stand.compare()
    rows = [stand.panel.runs.topLevelItem(row) for row in range(4)]
    destroyed: List[Any] = []
    stand.panel.runs.model().rowsRemoved.connect(lambda *what: destroyed.append(what))
    stand.tick(1)
    assert not destroyed and stand.panel.runs.topLevelItem(1) is rows[1]


def test_a_run_is_shared_as_it_was_compared(stand: Stand, tmp_path: Path) -> None:
    assert not stand.panel.share.isEnabled()
    stand.find()
    assert stand.panel.share.isEnabled()
    stand.tick(0, 1)
    stand.compare()
    page = tmp_path / 'seam.html'
    stand.share(2, str(page))
    assert stand.panel.state.text() == 'Writing seam.html…'
    assert not stand.panel.share.isEnabled()
    stand.tasks.end_all()
    assert stand.panel.state.text().startswith('seam.html was written: a.bag#3 from 0:2')
    run, = PageReader(page.read_text(encoding='utf-8')).data['runs']
    assert (run['name'], run['state']) == ('a.bag#3', 'poor')
    assert stand.failures == []
    stand.tick(2)
    stand.compare()
    assert 'was written' not in stand.panel.state.text()


def test_a_run_is_shared_as_a_table_and_for_foxglove(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    for name, said in (('seam.csv', 'rows, '), ('seam.mcap', ' messages.')):
        stand.share(1, str(tmp_path / name))
        stand.tasks.end_all()
        assert said in stand.panel.state.text()
    rows = (tmp_path / 'seam.csv').read_text(encoding='utf-8').splitlines()
    assert rows[0].startswith('run,time [s]') and rows[1].startswith('a.bag#2,11.')
    assert (tmp_path / 'seam.mcap').read_bytes().startswith(b'\x89MCAP')
    assert stand.failures == []


def test_a_film_says_how_far_it_is_and_is_canceled(stand: Stand, tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    """The film itself is drawn in test/browser."""
    told: List[str] = []

    def write_film(path: str, chosen: ChosenSpans, style: film.Style,
                   on_frame: film.OnFrame) -> int:
        for done in range(1, 11):
            if done == 6:
                stand.panel.cancel.click()
            on_frame(done, 10)
            told.append(stand.panel.state.text())
        raise AssertionError('it was canceled')

    monkeypatch.setattr(film, 'write_film', write_film)
    stand.find()
    stand.share(0, str(tmp_path / 'seam.mp4'))
    stand.tasks.end_all()
    assert told == [f'Writing seam.mp4… {10 * done} %' for done in range(1, 6)]
    assert stand.panel.share.isEnabled() and stand.failures == []


def test_a_film_is_written_on_when_another_recording_is_opened(stand: Stand, tmp_path: Path,
                                                               monkeypatch: Any) -> None:
    def write_film(path: str, chosen: ChosenSpans, style: film.Style,
                   on_frame: film.OnFrame) -> int:
        on_frame(9, 10)
        assert stand.panel.state.text() == 'Writing seam.mp4… 90 %'
        return 10

    monkeypatch.setattr(film, 'write_film', write_film)
    stand.find()
    stand.share(0, str(tmp_path / 'seam.mp4'))
    play(stand.session, write_bag(tmp_path, 'b.bag'))
    assert stand.panel.state.text() == 'Writing seam.mp4…' and stand.panel.cancel.isEnabled()
    stand.tasks.end_all()
    assert stand.panel.state.text().startswith('seam.mp4 was written: a.bag#1 from')
    stand.model.add(stand.path)
    stand.tasks.end_all()
    stand.share(0, str(tmp_path / 'seam.mp4'))
    stand.panel.find.click()
    assert stand.panel.state.text() == 'Reading the recordings…'
    stand.panel.cancel.click()  # for the selected run
    assert stand.panel.state.text() == 'Writing seam.mp4…'
    stand.tasks.end_all()
    assert stand.panel.state.text().startswith('seam.mp4 was written')
    assert stand.failures == []


@pytest.mark.parametrize(('path', 'kind', 'expected'), [
    ('/a/seam.MP4', 'Pages (*.html)', '/a/seam.MP4'),
    ('/a/seam', 'Films (*.mp4 *.gif)', '/a/seam.mp4'),
    ('/a/seam.1', 'For Foxglove and Lichtblick (*.mcap)', '/a/seam.1.mcap')])
def test_the_kind_of_a_shared_file_is_in_its_name(path: str, kind: str, expected: str) -> None:
    assert with_ending(path, kind) == expected


def test_the_dialog_proposes_a_name_that_gets_the_ending_of_what_is_chosen(
        stand: Stand, tmp_path: Path) -> None:
    stand.find()
    for kind, name in (('Pages (*.html)', 'a_1.html'), ('Tables (*.csv *.parquet)', 'a_1.csv')):
        stand.panel.share.click()
        dialog, = stand.panel.findChildren(QFileDialog)
        assert dialog.windowTitle() == 'Share a.bag#1, 0:00.00 to 0:10.00'
        dialog.selectNameFilter(kind)
        dialog.filterSelected.emit(kind)
        assert dialog.selectedFiles() == [str(tmp_path / name)]
        dialog.accept()
        dialog.setParent(None)
        stand.tasks.end_all()
        assert (tmp_path / name).stat().st_size > 1000
    assert stand.failures == []


def test_a_run_that_changes_while_the_dialog_is_open_is_not_taken_for_another(
        stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.panel.share.click()
    dialog, = stand.panel.findChildren(QFileDialog)
    play(stand.session, write_bag(tmp_path, 'b.bag', cycles=1))
    stand.find_open()
    dialog.accept()
    stand.tasks.end_all()
    assert stand.failures == ['a_1.html was not written: the runs have changed. Choose a.bag#1 in '
                              'the list and share it again']
    assert not (tmp_path / 'a_1.html').exists()


def test_a_page_that_cannot_be_written_is_told(stand: Stand, tmp_path: Path) -> None:
    stand.find()
    stand.share(0, str(tmp_path / 'no' / 'seam.html'))
    stand.tasks.end_all()
    text, = stand.failures
    assert text.startswith('seam.html cannot be written: ') and 'no/seam.html' in text
    assert column(stand.panel.runs, 0) == [f'a.bag#{number}' for number in (1, 2, 3, 4)]


@pytest.mark.parametrize(('loop', 'expected'), [
    (None, (5.0, 15.0)), ((7.0, 9.0), (7.0, 9.0)), ((0.0, 6.0), (5.0, 6.0)),
    ((16.0, 20.0), (5.0, 15.0))])
def test_of_a_run_what_is_in_the_loop_is_shared(loop: Any, expected: Any) -> None:
    assert shared_span(Run('a', 10.0, ())._replace(begin_s=5.0), loop) == expected
