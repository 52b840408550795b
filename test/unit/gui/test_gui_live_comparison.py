# SPDX-License-Identifier: BSD-3-Clause
"""The running cell compared with good runs: band behind the curves, texts, alarms."""
from __future__ import annotations

import time
from pathlib import Path
from shutil import rmtree
from typing import List, Optional
from unittest.mock import Mock

import numpy as np
import pytest
from cycle_bags import BEGIN_S, CYCLE_S, write_bag
from pytestqt.qtbot import QtBot
from recent_parts import part_of, parts_of
from session_stand import choose
from session_stand import run as run_in
from test_gui_alarms import NOON_S
from test_gui_alarms import Stand as AlarmStand
from test_gui_live import Stand

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.gui.compare.compare_panel import ComparePanel
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.ros.snapshots import PhaseSnapshot
from process_visualizer.launching.part_report import PartReport, PartState
from process_visualizer.runs.comparison.live_comparison import LiveDeparture, live_bands
from process_visualizer.runs.deviation.signals import Signal, SignalKind
from process_visualizer.runs.run import Run
from process_visualizer.serving.live_cell import verdict_entry

POOR_FROM_S = CYCLE_S + 3.0
"""Time at which the force jumps in the live cell: in its second cycle."""


class Compared:
    """Panel with a poor second cycle, and a good recording to compare with."""

    def __init__(self, qtbot: QtBot, folder: Path) -> None:
        self.stand = Stand(qtbot, folder)
        self.parts = list(parts_of(write_bag(folder, 'poor.bag', poor=1), 1.0))
        self.stand.compare.add(str(folder / 'a.bag'))
        self.stand.tasks_of_runs.end_all()
        self.heard: List[str] = []
        self.model.changed.connect(lambda: self.heard.append(self.model.text))

    @property
    def model(self) -> LiveComparisonModel:
        return self.stand.comparison

    def choose(self, *rows: int) -> Run:
        for row in rows:
            self.stand.compare.set_good(row, True)
        self.stand.compare.compare()
        self.stand.tasks_of_runs.end_all()
        return self.stand.compare.runs[0].run

    def run(self, seconds: int, run: Run, says: bool = True, behind_s: Optional[float] = None,
            first: int = 0) -> None:
        """Let the cell run, second by second, while the node sends its moment."""
        for second in range(first, seconds):
            for tenth in range(10 if says else 0):
                time_s = second + 0.1 * tenth
                cycle_s = time_s % CYCLE_S - run.begin_s
                is_in = 0.0 <= cycle_s <= run.duration_s
                self.model.take_phase(PhaseSnapshot(BEGIN_S + time_s, cycle_s if is_in else None,
                                                    behind_s))
            self.stand.come(self.parts[second])


@pytest.fixture
def compared(qtbot: QtBot, tmp_path: Path) -> Compared:
    return Compared(qtbot, tmp_path)


def test_what_is_out_of_the_band_is_said_with_since_when(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(int(CYCLE_S), run, behind_s=0.4)
    assert compared.model.text == 'Waiting for a run to start (reference a.bag#1)'
    within = [it for it in compared.heard if it.startswith('Run in range (reference at 0:')]
    assert within and within[0].endswith(', 0.4 s behind)')
    assert not any('above range' in it for it in compared.heard)
    compared.run(int(POOR_FROM_S) + 3, run)
    text = compared.model.text
    assert text.startswith('arm tool force +') and ' N above range for ' in text
    found, = compared.model.departed
    assert found[:2] == ('arm', 'tool force') and found[2].endswith('N above range')
    assert found[3] == pytest.approx(BEGIN_S + POOR_FROM_S, abs=0.2)


def test_a_run_that_was_out_of_range_is_not_said_to_be_in_range(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(len(compared.parts), run)
    first = next(row for row, text in enumerate(compared.heard) if 'above range' in text)
    after = compared.heard[first:]
    end = next(row for row, text in enumerate(after) if text.startswith('Waiting'))
    within = [it for it in after[:end] if 'above range' not in it]
    assert within and all(it.startswith('Back in range (reference at ') for it in within)
    assert not any(it.startswith('Back') for it in compared.heard[:first])
    assert not any(it.startswith('Back') for it in after[end:])


def test_a_departure_that_comes_again_begins_after_the_end_of_the_last_one(
        compared: Compared) -> None:
    """Its alarm was dated back before the end of the previous one."""
    model, signal = compared.model, Signal('arm', 'tool force', 'N', SignalKind.FORCE)
    for now_s, since_s in ((10.0, 5.0), (12.0, None), (14.0, 5.0)):
        model._now_s = now_s
        model._take_departures(() if since_s is None else (LiveDeparture(signal, since_s, 1.0),))
    assert [it.since_s for it in model.departures] == [12.0]


def test_programs_are_told_the_same(compared: Compared) -> None:
    assert verdict_entry(compared.model.told) == {}
    run = compared.choose(0, 1)
    compared.run(6, run)
    told = verdict_entry(compared.model.told)
    assert (told['state'], told['text'], told['departed']) == ('good', compared.model.text, [])
    compared.run(int(POOR_FROM_S) + 3, run)
    told = verdict_entry(compared.model.told)
    assert (told['state'], told['reference']) == ('poor', 'a.bag#1')
    assert told['departed'] == [list(it) for it in compared.model.departed]


def test_programs_are_told_the_bands_behind_the_last_seconds(compared: Compared) -> None:
    assert compared.model.told_bands == ''
    run = compared.choose(0, 1)
    compared.run(6, run)
    good = live_bands(compared.model.told_bands)
    band = good.channels['arm', 'tool force']
    assert good.step_s == pytest.approx(0.1)
    assert len(band.low) == 30
    assert good.begin_s + 30 * good.step_s == pytest.approx(BEGIN_S + 6.0, abs=0.1)
    known = np.isfinite(band.low)
    assert known.sum() > 20 and (band.low[known] < band.high[known]).all()
    assert not band.departed.any()
    compared.run(int(POOR_FROM_S) + 3, run)
    poor = live_bands(compared.model.told_bands)
    assert poor.channels['arm', 'tool force'].departed.any()
    run_in(compared.stand.session, None)
    assert compared.model.told_bands == ''


def test_old_values_say_nothing_about_ranges(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(int(POOR_FROM_S) + 3, run)
    assert 'above range' in compared.model.text and compared.model.departed
    at = time.strftime('%H:%M:%S', time.localtime(compared.model.now_s))
    compared.stand.come(ServiceUnreachable('gone'))
    assert compared.model.text == compared.heard[-1] == f'Not compared: no data since {at}'
    assert not compared.model.departed and ('arm', 'tool force') in compared.model.lost
    told = verdict_entry(compared.model.told)
    assert (told['state'], told['departed']) == ('plain', [])
    assert ('arm', 'tool force') in told['lost']
    compared.stand.come(compared.parts[int(POOR_FROM_S) + 3])
    assert ('arm', 'tool force') not in compared.model.lost
    assert 'above range' in compared.heard[-1]


def test_without_new_values_nothing_is_said_to_be_in_range(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(6, run)
    assert compared.model.text.startswith('Run in range')
    known_s, last = compared.model.now_s, compared.parts[5]
    for second in range(26):  # /ghost keeps sending: the robots stay where they were
        for tenth in range(10):
            compared.model.take_phase(PhaseSnapshot(
                BEGIN_S + 6.0 + second + 0.1 * tenth, 5.9 - run.begin_s, None))
        compared.stand.come(part_of(last.connections, [], last.now_ns + (second + 1) * 10 ** 9))
        assert second < 2 or compared.model.text.startswith('Not compared: no data since ')
    text = compared.model.text
    assert text[-8:] in [time.strftime('%H:%M:%S', time.localtime(known_s - it))
                         for it in (0.0, 0.5)]
    assert verdict_entry(compared.model.told)['state'] == 'plain'
    assert 'Δ' not in compared.stand.timeline.lane_texts(1).at_position
    finished, = compared.model.finished
    assert finished.verdict.startswith('in range, no data from 0:0')


def test_data_that_has_just_resumed_is_not_called_missing(compared: Compared) -> None:
    """Its first values cannot be judged yet, as robots begin to move then."""
    run = compared.choose(0, 1)
    compared.run(6, run)
    model = compared.model
    model._is_stale, model._known_s = True, model._now_s - 1.4
    assert model.text.startswith('Not compared: no data since ')
    model._known_s = model._now_s - 0.1
    assert model.text == 'Not compared yet: data has resumed'


def test_what_a_restart_of_a_device_does_to_the_values_is_no_fault(compared: Compared) -> None:
    """A good run was poor, as its simulator began anew in the middle."""
    run = compared.choose(0, 1)
    model, session = compared.model, compared.stand.session
    compared.run(int(CYCLE_S) + 2, run)
    before = len(model.finished)

    def restart(state: PartState) -> None:
        session.reports = {it.name: PartReport(it.name, state) for it in session.running.devices}
        session.run_changed.emit()

    restart(PartState.STOPPING)
    assert model.text == 'Not compared: a device is being restarted'
    interrupted = model.finished[before:]
    assert interrupted and all('not compared after' in it.verdict for it in interrupted)
    restart(PartState.RUNNING)  # its run begins anew, and the ghost still expects the rest
    after, end = int(CYCLE_S) + 2, int(CYCLE_S + run.begin_s + run.duration_s)
    compared.heard.clear()
    compared.run(end, run, first=after)
    assert not compared.heard and model.text == (
        'Not compared before the next run: a device was restarted during this one')
    assert not model.departures and model.finished[before:] == interrupted
    compared.run(end + 2, run, first=end)
    assert model.text.startswith('Waiting for a run to start')
    compared.run(int(CYCLE_S), run)
    assert model.finished[-1].verdict == 'in range'


def test_every_run_that_is_over_leaves_a_row_with_its_verdict(compared: Compared,
                                                              qtbot: QtBot) -> None:
    run = compared.choose(0, 1)
    panel = ComparePanel(compared.stand.compare, Mock(is_wanted=True), compared.model, lambda: '')
    qtbot.addWidget(panel)
    panel.set_live(True)
    compared.run(len(compared.parts), run)
    run_in(compared.stand.session, None)
    good, poor = compared.model.finished[:2]
    assert (good.verdict, good.is_good) == ('in range', True)
    assert poor.verdict.startswith('out of range: arm tool force +') and not poor.is_good
    def rows() -> List[str]:
        return [panel.finished.topLevelItem(row).text(2)
                for row in range(panel.finished.topLevelItemCount())]

    assert rows() == [it.verdict for it in compared.model.finished]
    hint = panel.finished.topLevelItem(0).toolTip(2)
    assert 'in range' in hint and 'places, timing and roughness only in a recording' in hint
    chosen, before = panel.finished.topLevelItem(1), len(rows())
    panel.finished.setCurrentItem(chosen)
    compared.model.restore([*compared.model.settings(), compared.model.settings()[0]])
    assert len(rows()) == before + 1
    assert panel.finished.topLevelItem(1) is chosen is panel.finished.currentItem()
    bar = panel.finished.verticalScrollBar()
    compared.model.restore(40 * compared.model.settings()[:1])
    panel.show()
    qtbot.waitUntil(lambda: 0 < bar.maximum() == bar.value())
    bar.setValue(3)
    compared.model.restore(41 * compared.model.settings()[:1])
    qtbot.waitUntil(lambda: bar.maximum() > 3)
    assert bar.value() == 3, 'somebody reads there'
    panel.set_live(False)
    assert panel.finished.isHidden()


def test_moments_while_the_nodes_end_are_not_compared(compared: Compared) -> None:
    run = compared.choose(0, 1)
    begin = round(run.begin_s) + 1
    compared.run(begin + 4, run)
    run_in(compared.stand.session, None)  # as after a click on Playback; the node still says where
    (row,) = compared.model.finished
    assert 'not compared after' in row.verdict
    for tenth in range(30):
        compared.model.take_phase(PhaseSnapshot(
            BEGIN_S + begin + 4 + 0.1 * tenth, begin + 4 + 0.1 * tenth - run.begin_s, None))
    compared.model._follow()
    assert compared.model.finished == (row,)


def test_it_is_judged_while_nobody_looks_and_while_the_curves_are_held(compared: Compared) -> None:
    run = compared.choose(0)
    compared.stand.model.hold(True)
    compared.stand.panel.hide()
    compared.run(int(POOR_FROM_S) + 2, run)
    assert compared.stand.memory.parts == []
    assert 'above range' in compared.model.text


def test_the_band_is_drawn_behind_the_curves_and_read_beside_the_value(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(6, run)
    speed, force, _ = compared.stand.timeline.stack.lanes
    assert force.band is not None and speed.band is not None
    assert not force.band.departed.any()
    assert '5.00 N  (reference 4.9' in compared.stand.timeline.lane_texts(1).at_position
    assert not compared.stand.timeline.grab().isNull()
    compared.stand.compare.set_good(1, False)
    compared.stand.panel._show()
    assert compared.stand.timeline.stack.lanes[1].band is None
    assert compared.model.text == ''


def test_a_node_that_says_nothing_is_told_when_it_has_had_time_to_answer(compared: Compared
                                                                          ) -> None:
    run = compared.choose(0)
    compared.run(22, run, says=False)
    first = next(row for row, text in enumerate(compared.heard) if '/ghost does not say' in text)
    before = {it for it in compared.heard[:first] if it}
    assert before == {'Not compared yet: looking for this moment in a.bag#1'}
    assert compared.model.text.startswith('Not compared: /ghost does not say which moment')
    compared.parts = compared.parts[:4]
    compared.stand.come(compared.parts[0]._replace(is_anew=True))
    compared.run(4, run)
    assert compared.model.text.startswith('Run in range')
    run_in(compared.stand.session, None)
    assert compared.model.text == '' and compared.model.departed == []


def test_good_runs_of_another_cell_are_told(compared: Compared, tmp_path: Path) -> None:
    other = tmp_path / 'other'
    other.mkdir()
    path = write_bag(other, robot='other_arm')
    compared.stand.session.cell = None  # the recording's own configuration, in its bag
    compared.stand.compare.add(path)
    compared.stand.tasks_of_runs.end_all()
    compared.choose(2)
    run = compared.stand.compare.runs[2].run
    compared.run(3, run)
    assert compared.model.text.startswith('Run in range'), 'the machine is the same'
    assert compared.model.judged_with == 'a.bag#1'
    assert ('arm', 'tool force') not in run.by_key
    choose(compared.stand.session,
           XmlParser().parse(str(tmp_path / 'cell.xml')).devices[:1])
    run_in(compared.stand.session, compared.stand.session.mode)
    compared.run(3, run)
    assert compared.model.text.startswith('Not compared: a.bag#1 has none of the variables')
    assert (compared.model.reference, compared.model.judged_with) == ('a.bag#1', '')
    kept = compared.model.finished
    compared.run(4, run)
    run_in(compared.stand.session, None)
    assert compared.model.finished == kept, 'nothing of that run was compared'


def test_nothing_is_compared_without_good_runs(compared: Compared) -> None:
    compared.stand.come(compared.parts[0])
    assert compared.model.text == '' and compared.heard == []


def test_it_is_an_alarm() -> None:
    stand = AlarmStand()
    since_s = NOON_S + 98.0
    stand.model.set_departed([('arm', 'tool force', '+4.1 N above range', since_s)])
    stand.model.set_departed([('arm', 'tool force', '+4.3 N above range', since_s)])
    assert [it.condition.text for it in stand.model.alarms] == ['tool force +4.3 N above range']
    assert [it.text for it in stand.model.events] == ['arm: tool force +4.1 N above range']
    stand.now_s = 103.0
    stand.model.set_departed([])
    assert stand.model.alarms == ()
    assert stand.model.events[-1].text == 'arm: tool force out of range: over after 5.0 s'
    stand.model.set_departed([('arm', 'tool force', '+4.3 N above range', since_s)])
    stand.model.set_departed([], {('arm', 'tool force')})
    assert stand.model.events[-1].text == (
        'arm: tool force out of range: no data after 5.0 s')
    rmtree(stand.launch.folder)


def test_the_tab_lists_what_is_out_now(compared: Compared) -> None:
    tasks = compared.stand.tasks_of_runs
    ghost = GhostModel(tasks, compared.stand.compare,  # type: ignore[arg-type]
                       compared.stand.session, lambda _tracks: None, lambda *_what: None)
    panel = ComparePanel(compared.stand.compare, ghost, compared.model, lambda: '')
    panel.set_live(True)
    run = compared.choose(0)
    compared.run(int(POOR_FROM_S) + 2, run)
    row, head = panel.departures.topLevelItem(0), panel.departures.headerItem()
    assert row.text(0) == 'arm tool force' and row.text(2).endswith('N above range')
    assert row.text(1).startswith('for ') and head.text(0) == 'What differs now'
    panel.departures.itemClicked.emit(row, 0)
    run_in(compared.stand.session, None)
    assert panel.state.text().endswith('they run.')


def test_all_who_show_the_result_show_the_same_at_any_time(compared: Compared) -> None:
    run = compared.choose(0, 1)
    compared.run(3, run)
    told = compared.heard[-1], compared.model.told
    for place_s in (None, 1.0):  # no window is judged in between
        compared.model.take_phase(PhaseSnapshot(BEGIN_S + 3.05, place_s))
        assert (compared.model.text, compared.model.told) == told
    compared.stand.come(compared.parts[3])
    assert compared.model.text == compared.heard[-1] != told[0]
    heard = len(compared.heard)
    run_in(compared.stand.session, None)
    assert compared.model.text == compared.heard[-1] == ''
    assert len(compared.heard) > heard
