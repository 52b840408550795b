# SPDX-License-Identifier: BSD-3-Clause
"""The panel as a whole: a real bag, and a player that the test controls."""
from __future__ import annotations

from pathlib import Path
from typing import Iterator

import genpy
import pytest
import rosbag
from playback_stand import PlaybackStand
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QDialog, QInputDialog, QTreeWidget
from pytestqt.qtbot import QtBot
from session_stand import choose, play
from std_msgs.msg import Float32

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.gui.compare.compare_model import BandsModel, CompareModel
from process_visualizer.gui.lanes.timeline_lanes import lane_label
from process_visualizer.gui.playback.bag_model import BagModel, placed_marks
from process_visualizer.gui.playback.playback_panel import PlaybackPanel
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.playback.values_model import Played, ValuesModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

HERE = Location('cell.xml', 1)
MACHINE = Device(DeviceType.OTHER, 'machine', HERE,
                 topics=(Topic('/feed', None, None, True, HERE),))


class Bench:
    """Panel with a bag of 4 s, whose feed rate equals its time."""

    def __init__(self, qtbot: QtBot, tasks: Tasks, folder: Path) -> None:
        self.stand = PlaybackStand()
        self.session = Session()
        self.bag = BagModel(tasks, self.session)
        session = self.session
        self.values = ValuesModel(tasks, self.stand.model,
                                  lambda: Played(session.paths, session.played_devices))
        for changed in (session.recording_changed, session.cell_changed):
            changed.connect(self.values.follow)
        self.bands = BandsModel(tasks, CompareModel(tasks, self.session))
        self.panel = PlaybackPanel(self.stand.model, self.bag, self.values, self.bands)
        qtbot.addWidget(self.panel)
        self.panel.resize(430, 600)
        self.panel.show()
        path = folder / 'a.bag'
        with rosbag.Bag(str(path), 'w') as bag:
            for row in range(401):
                time = genpy.Time(1000) + genpy.Duration.from_sec(row / 100)
                bag.write('/feed', Float32(row / 100), time)
        choose(self.session, [MACHINE])
        self.bag.open([str(path)])
        qtbot.waitUntil(lambda: bool(self.bag.curves.curves))
        self.stand.state(duration_s=4.0, position_s=1.0, files=self.session.paths)


@pytest.fixture
def bench(qtbot: QtBot, tmp_path: Path) -> Iterator[Bench]:
    tasks = Tasks()
    yield Bench(qtbot, tasks, tmp_path)
    tasks.close()


def shown(bench: Bench) -> str:
    """The displayed value at the position."""
    return bench.panel.timeline.lane_texts(0).at_position


def test_the_curves_of_the_bag_are_in_the_timeline(bench: Bench, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: shown(bench) == '1.00')
    qtbot.waitUntil(lambda: bench.panel.timeline.stack.pictures.scale(0).high == 4.0)


@pytest.mark.parametrize('position_s, value', [
    (0.0, '0.00'), (2.339, '2.33'), (2.34, '2.34'), (2.341, '2.34'), (4.0, '4.00')])
def test_the_value_is_that_of_the_position_and_not_of_a_column(
        bench: Bench, qtbot: QtBot, position_s: float, value: str) -> None:
    """The last message at the position counts, not the mean of a column of the curve."""
    bench.stand.state(position_s=position_s)
    assert shown(bench) in ('…', value)
    qtbot.waitUntil(lambda: shown(bench) != '…')
    assert shown(bench) == value


def test_the_value_goes_on_while_the_mouse_rests(bench: Bench, qtbot: QtBot) -> None:
    """After a click on the timeline, the window showed the same number while playback continued."""
    timeline = bench.panel.timeline
    timeline._show_hover(timeline.axis.x(1.0))
    bench.stand.state(position_s=3.0)
    qtbot.waitUntil(lambda: shown(bench) == '3.00')
    assert float(timeline.lane_texts(0).at_mouse) == pytest.approx(1.0, abs=0.01)
    timeline._show_hover(None)
    assert timeline.lane_texts(0).at_mouse == ''


def test_values_of_another_recording_are_not_shown(bench: Bench, qtbot: QtBot,
                                                   tmp_path: Path) -> None:
    qtbot.waitUntil(lambda: shown(bench) == '1.00')
    path = tmp_path / 'b.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        for row in range(401):
            bag.write('/feed', Float32(7.0), genpy.Time(2000) + genpy.Duration.from_sec(row / 100))
    play(bench.session, str(path))
    assert shown(bench) == '…'
    qtbot.waitUntil(lambda: shown(bench) == '7.00')


def test_a_hidden_curve_is_not_shown(bench: Bench) -> None:
    timeline, choices = bench.panel.timeline, bench.bag.curves.choices
    choices.choose(choices.choice.with_hidden(timeline.stack.lanes[0].key))
    assert timeline.stack.lanes == ()
    choices.set_configuration('/another.xml')
    assert len(timeline.stack.lanes) == 1


def test_the_curves_are_asked_for(bench: Bench) -> None:
    bench.panel.timeline.curves_wanted.emit()
    dialog = bench.panel.findChild(QDialog, 'curves')
    row = dialog.tree.topLevelItem(0)
    assert row.text(0) == bench.panel.timeline.stack.lanes[0].label
    row.setCheckState(0, Qt.Unchecked)
    assert bench.panel.timeline.stack.lanes == ()


def test_topics_are_ticked_to_be_played(bench: Bench, qtbot: QtBot) -> None:
    table = bench.panel.findChild(QTreeWidget, 'bag_topics')
    row = table.topLevelItem(0)
    assert row.checkState(0) == Qt.Checked
    row.setCheckState(0, Qt.Unchecked)
    assert bench.bag.played.left_out == ('/feed',)
    assert bench.panel.bag.details.text() == '0 of 1 topic, 401 messages'
    assert bench.panel.bag.details.minimumWidth() >= bench.panel.bag.details.sizeHint().width()
    choose(bench.session, [])
    assert row.data(0, Qt.CheckStateRole) is None
    assert 'it is not played' in row.toolTip(0)
    assert bench.bag.played.left_out == ()
    choose(bench.session, [MACHINE])
    assert row.checkState(0) == Qt.Unchecked


def test_of_another_recording_all_topics_are_ticked(bench: Bench, qtbot: QtBot) -> None:
    bench.bag.played.tick('/feed', False)
    bench.bag.open(bench.session.paths)
    qtbot.waitUntil(lambda: not bench.bag.is_loading)
    assert bench.bag.played.left_out == ('/feed',)
    other = Path(bench.session.paths[0]).with_name('b.bag')
    Path(bench.session.paths[0]).rename(other)
    bench.bag.open([str(other)])
    qtbot.waitUntil(lambda: bench.session.paths[0] == str(other))
    assert bench.bag.played.left_out == ()


def test_its_topics_are_units_of_a_step(bench: Bench) -> None:
    assert bench.panel.transport.unit.findText('/feed') > 0


def test_a_mark_is_asked_for_and_added(bench: Bench, qtbot: QtBot) -> None:
    bench.panel.timeline.mark_wanted.emit(2.5)
    dialog = bench.panel.findChild(QInputDialog, 'mark_label')
    dialog.setTextValue('thread breaks')
    dialog.accept()
    qtbot.waitUntil(lambda: placed_marks(bench.session.recording) == (
        PlacedMark(2.5, 'thread breaks'),))


def test_what_the_player_cannot_play_is_told(bench: Bench) -> None:
    assert not bench.panel.notes.isVisible()
    bench.stand.state(gaps=('/x has another type',), dropped=7)
    assert bench.panel.notes.isVisible()
    assert bench.panel.notes.text() == ('7 messages were dropped for slow subscribers  '
                                        '(and 1 more)')
    assert '/x has another type' in bench.panel.notes.toolTip()


@pytest.mark.parametrize('device, label, expected', [
    ('ur5e', 'v', 'ur5e  tool speed v'), ('ur5e', 'F', 'ur5e  tool force F'),
    ('oven', 'oven', 'oven'), ('oven', 'Oven temperature', 'Oven temperature'),
    ('oven', 'oven/temperature', 'oven/temperature'), ('oven', 'oven_heat', 'oven_heat'),
    ('oven', 'ovenware', 'oven  ovenware'), ('oven', 'heat', 'oven  heat')])
def test_a_curve_is_called_as_in_rviz_and_its_device_named_once(
        device: str, label: str, expected: str) -> None:
    assert lane_label(device, label) == expected
