# SPDX-License-Identifier: BSD-3-Clause
"""The selected recording: read in the background, with every kind of defect."""
from __future__ import annotations

import json
import math
import os
import re
import threading
from pathlib import Path
from typing import Iterator, List, Tuple

import genpy
import pytest
import rosbag
from held_tasks import wait_for_line
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from session_stand import choose, run
from std_msgs.msg import Float32, String

from process_visualizer.bagio.marks import marks_path
from process_visualizer.bagio.recorder_topics import CONFIGURATION, MARKS
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell, Device, DeviceType, Mode, Topic
from process_visualizer.gui.playback import bag_model
from process_visualizer.gui.playback.bag_model import BagModel, placed_marks
from process_visualizer.gui.playback.bag_view import BagView
from process_visualizer.gui.playback.playback_panel import CurvesRow
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.labels import parted
from process_visualizer.gui.toolkit.tasks import Tasks

HERE = Location('cell.xml', 1)
BEGIN_S = 1_600_000_000


def machine(*topics: str) -> Device:
    return Device(DeviceType.OTHER, 'machine', HERE,
                  topics=tuple(Topic(topic, None, None, True, HERE) for topic in topics))


def write_bag(path: Path, begin_s: int = BEGIN_S, seconds: int = 10) -> str:
    """A feed rate at 50 Hz, with a mark after 2 s."""
    with rosbag.Bag(str(path), 'w', chunk_threshold=4096) as bag:
        for row in range(50 * seconds):
            time = genpy.Time(begin_s) + genpy.Duration.from_sec(row / 50)
            bag.write('/feed_rate', Float32(math.sin(row / 20)), time)
        bag.write(MARKS, String('seam begins'), genpy.Time(begin_s + 2))
    return str(path)


def write_strange_bag(folder: Path) -> str:
    """A recording of another cell."""
    path = str(folder / 'other.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/strange', String('a'), genpy.Time(BEGIN_S + 100))
    return path


class Bench:
    """The model and its signals."""

    def __init__(self, qtbot: QtBot, tasks: Tasks) -> None:
        self.qtbot = qtbot
        self.tasks = tasks
        self.session = Session()
        self.model = BagModel(tasks, self.session)
        self.failures: List[str] = []
        self.chosen: List[str] = []
        self.model.failed.connect(self.failures.append)
        self.model.chosen.connect(lambda: self.chosen.append(self.session.paths[0]))

    @property
    def marks(self) -> Tuple[PlacedMark, ...]:
        return placed_marks(self.session.recording)

    def open(self, *paths: str) -> None:
        self.model.open(paths)
        self.qtbot.waitUntil(lambda: not self.model.is_loading)


@pytest.fixture
def bench(qtbot: QtBot) -> Iterator[Bench]:
    tasks = Tasks()
    yield Bench(qtbot, tasks)
    tasks.close()


@pytest.fixture
def path(tmp_path: Path) -> str:
    return write_bag(tmp_path / 'a.bag')


class TestOpening:
    """The contents of a recording, and other files that may be given instead."""

    def test_a_bag(self, bench: Bench, path: str) -> None:
        bench.open(path)
        assert bench.session.paths == (path,)
        assert bench.chosen == [path]
        assert bench.session.recording.duration_s == pytest.approx(9.98)
        assert bench.marks == (PlacedMark(2.0, 'seam begins'),)

    def test_several_files_of_one_recording_in_any_order(self, bench: Bench, tmp_path: Path,
                                                         path: str) -> None:
        second = write_bag(tmp_path / 'b.bag', BEGIN_S + 10)
        bench.open(second, path)
        assert bench.session.paths == (path, second)
        assert bench.session.recording.duration_s == pytest.approx(19.98)

    def test_a_recording_of_another_cell_does_not_replace_the_one_that_is_played(
            self, bench: Bench, tmp_path: Path, path: str) -> None:
        choose(bench.session, [machine('/feed_rate')])
        bench.open(path)
        run(bench.session, Mode.PLAYBACK)
        other = write_strange_bag(tmp_path)
        bench.open(other)
        assert bench.session.paths == (path,) and bench.model.foreign_paths == (other,)
        assert bench.model.waiting_note == (
            'other.bag has no topic of the ticked devices. It is from another cell. '
            'a.bag stays open.')
        bench.model.add_mark(5.0, 'here')
        bench.qtbot.waitUntil(lambda: PlacedMark(5.0, 'here') in bench.marks)
        assert not Path(marks_path(other)).exists()
        choose(bench.session, [machine('/strange')])  # its configuration is used
        assert bench.session.paths == (other,) and bench.model.waiting_note == ''

    def test_until_apply_all_is_of_the_recording_that_is_played(
            self, bench: Bench, tmp_path: Path, path: str) -> None:
        """Its configuration is open, but the view and the position are still the old ones."""
        curves = bench.model.curves
        devices = (machine('/feed_rate'),)
        bench.session.set_cell(Cell('/old.xml', 'world', devices), devices)
        bench.open(path)
        run(bench.session, Mode.PLAYBACK)
        other = write_strange_bag(tmp_path)
        bench.open(other)
        new = (machine('/strange'),)
        bench.session.set_cell(Cell('/new.xml', 'world', new), new)
        assert bench.session.paths == (path,) and bench.model.next_paths == (other,)
        assert bench.session.played_devices == devices
        assert not bench.model.is_foreign and bench.model.missing == {}
        assert bench.model.waiting_note == (
            'other.bag is played once you press Apply. Until then a.bag is shown.')
        assert curves.reading is None
        run(bench.session, Mode.PLAYBACK)  # of the new configuration
        assert bench.session.paths == (other,) and bench.model.waiting_note == ''
        assert bench.session.played_devices == new

    @pytest.mark.parametrize('closes', [False, True])
    def test_what_had_to_wait_is_open_when_nothing_is_played(
            self, bench: Bench, tmp_path: Path, path: str, closes: bool) -> None:
        """Except when the window closes: the next session begins with the recording that played."""
        choose(bench.session, [machine('/feed_rate')])
        bench.open(path)
        run(bench.session, Mode.PLAYBACK)
        other = write_strange_bag(tmp_path)
        bench.open(other)
        if closes:
            bench.model.keep_open()
        run(bench.session, None)
        open_one = path if closes else other
        assert bench.session.paths == (open_one,)
        assert bench.model.settings() == {'recent': [[other], [path]], 'open': [open_one]}
        assert bench.model.waiting_note.endswith('It is from another cell.') is not closes

    @pytest.mark.parametrize('content', [None, b'', b'#ROSBAG V1.2\n', b'nothing of the kind'])
    def test_what_is_no_bag_is_told_and_the_open_one_stays(
            self, bench: Bench, path: str, tmp_path: Path, content: bytes) -> None:
        bench.open(path)
        other = tmp_path / 'other.bag'
        if content is not None:
            other.write_bytes(content)
        bench.open(str(other))
        assert bench.session.paths == (path,) and bench.chosen == [path]
        assert len(bench.failures) == 1 and str(other) in bench.failures[0]
        assert bench.model.recent.all == ((path,),)

    def test_only_the_last_choice_counts(self, bench: Bench, path: str, tmp_path: Path) -> None:
        second = write_bag(tmp_path / 'b.bag')
        bench.model.open([path])
        bench.open(second)
        assert bench.chosen == [second]

    def test_missing_topics(self, bench: Bench, path: str) -> None:
        bench.open(path)
        choose(bench.session, [machine('/feed_rate', '/edge')])
        assert bench.model.missing == {'machine': ('/edge',)}

    def test_a_bag_that_is_deleted_while_open(self, bench: Bench, path: str) -> None:
        bench.open(path)
        os.remove(path)
        bench.qtbot.waitUntil(lambda: bench.model.gone == (path,))
        # The program that still reads it reports this, too.
        assert any('deleted or moved' in it and path in it for it in bench.failures)


class TestForeign:
    """A recording of another cell."""

    def test_nothing_of_it_can_be_played(self, bench: Bench, path: str) -> None:
        bench.open(path)
        assert not bench.model.is_foreign  # nothing is ticked
        choose(bench.session, [machine('/edge', '/feed_rate'), machine('/q')])
        assert not bench.model.is_foreign and bench.model.foreign_text == ''
        choose(bench.session, [machine('/edge'), machine('/q')])
        assert bench.model.foreign_text == 'a.bag has no topic of the ticked devices'

    def test_a_configuration_of_its_own_is_offered(self, bench: Bench, path: str) -> None:
        view = BagView(bench.model)
        bench.qtbot.addWidget(view)
        view.show()
        choose(bench.session, [machine('/edge')])
        bench.open(path)
        button = view.findChild(QPushButton, 'configuration_of_bag')
        assert button.isVisible() and button.text() == 'Make a configuration from it…'
        with rosbag.Bag(path, 'a') as bag:
            text = json.dumps({'file': '/cell.xml', 'files': {'/cell.xml': '<visualizer/>'},
                               'arguments': {}})
            bag.write(CONFIGURATION, String(text), genpy.Time(BEGIN_S))
        bench.open(path)
        bench.qtbot.waitUntil(lambda: button.text() == 'Use the configuration in it…')
        with bench.qtbot.waitSignal(view.configuration_wanted) as wanted:
            button.click()
        assert wanted.args == [(path,)]
        choose(bench.session, [machine('/feed_rate')])
        assert not button.isVisible()


class TestRecent:
    """The last recordings, the newest first."""

    def test_they_are_remembered(self, bench: Bench, path: str, tmp_path: Path) -> None:
        second = write_bag(tmp_path / 'b.bag')
        bench.open(path)
        bench.open(second)
        bench.open(path)
        assert bench.model.recent.all == ((path,), (second,))
        other = BagModel(Tasks(), Session())
        other.restore(bench.model.settings())
        assert other.recent.all == bench.model.recent.all
        assert other.recent.folder == str(tmp_path)

    def test_what_was_open_is_opened_again(self, bench: Bench, path: str, tmp_path: Path) -> None:
        """Also a recording that was still being read; and only once."""
        second = write_bag(tmp_path / 'b.bag', BEGIN_S + 10)
        for is_read in (True, False):
            before = BagModel(bench.tasks, Session())
            before.open([path, second])
            if is_read:
                bench.qtbot.waitUntil(lambda at=before: not at.is_loading)
            bench.model.restore(before.settings())
            assert bench.model.settings()['open'] == [path, second]
            bench.session.set_mode(Mode.PLAYBACK)
            bench.qtbot.waitUntil(lambda: bench.session.paths == (path, second))
        bench.open(path)
        choose(bench.session, [])
        assert bench.session.paths == (path,) and not bench.model.is_loading

    def test_what_was_open_and_is_gone_is_told_without_a_message(
            self, bench: Bench, path: str) -> None:
        bench.model.restore({'recent': [[path]], 'open': [path]})
        view = BagView(bench.model)
        os.remove(path)
        bench.session.set_mode(Mode.PLAYBACK)
        bench.qtbot.waitUntil(lambda: bench.model.gone == (path,))
        assert bench.failures == [] and bench.model.recent.all == () and not bench.model.is_loading
        assert 'a.bag no longer exists' in view.warnings.text()
        assert bench.model.settings()['open'] == []

    def test_the_dialog_begins_where_the_last_recording_is(
            self, bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """Otherwise in the folder for recordings or, if that does not exist yet, at home."""
        monkeypatch.setenv('HOME', str(tmp_path))
        recorded, elsewhere = tmp_path / 'bags', tmp_path / 'stick'
        model = BagModel(bench.tasks, Session(), None, lambda: str(recorded))
        assert model.recent.folder == str(tmp_path)
        recorded.mkdir()
        assert model.recent.folder == str(recorded)
        elsewhere.mkdir()
        model.add_recent(str(elsewhere / 'a.bag'))
        assert model.recent.folder == str(elsewhere)
        model.add_recent(str(recorded / 'b.bag'))
        assert model.recent.folder == str(recorded)
        model.add_recent(str(tmp_path / 'gone' / 'c.bag'))
        assert model.recent.folder == str(recorded)

    def test_there_are_not_too_many(self, bench: Bench) -> None:
        for number in range(20):
            bench.model.add_recent(f'/bags/{number}.bag')
        assert bench.model.recent.all[0] == ('/bags/19.bag',) and len(bench.model.recent.all) == 8

    def test_settings_of_another_version_do_no_harm(self, bench: Bench) -> None:
        bench.model.restore({})
        assert bench.model.recent.all == ()


class TestWithoutIndex:
    """A bag of a killed recorder."""

    @pytest.fixture
    def cut(self, path: str) -> str:
        data = Path(path).read_bytes()
        Path(path).write_bytes(data[:int(0.8 * len(data))])
        return path

    def test_a_copy_is_offered_and_opened(self, bench: Bench, cut: str) -> None:
        bench.open(cut)
        assert bench.model.unindexed == cut and bench.session.recording is None
        assert bench.failures == []
        bench.model.reindex()
        assert bench.model.reindexing is not None
        bench.qtbot.waitUntil(lambda: bench.session.recording is not None)
        assert bench.session.paths[0].endswith('a.reindexed.bag')
        assert (bench.model.unindexed, bench.model.reindexing) == ('', None)

    def test_a_copy_that_is_there_already_is_taken(self, bench: Bench, cut: str) -> None:
        bench.open(cut)
        bench.model.reindex()
        bench.qtbot.waitUntil(lambda: bench.session.recording is not None)
        bench.open(cut)
        assert bench.model.unindexed == '' and bench.session.paths[0].endswith('a.reindexed.bag')

    @pytest.mark.parametrize('is_made', [False, True])
    def test_it_can_be_left(self, bench: Bench, cut: str, is_made: bool) -> None:
        bench.open(cut)
        bench.model.reindex()
        if is_made:  # but not reported yet
            bench.tasks.run_and_wait('reindexing', lambda: None, 60.0)
        bench.model.dismiss()
        assert (bench.model.unindexed, bench.model.reindexing) == ('', None)
        wait_for_line(bench.tasks, 'reindexing', bench.qtbot)
        wait_for_line(bench.tasks, 'files', bench.qtbot)
        assert bench.session.recording is None and bench.failures == []

    def test_how_much_was_recovered_is_told_first(self, bench: Bench, cut: str) -> None:
        bench.open(cut)
        bench.model.reindex()
        bench.qtbot.waitUntil(lambda: bool(bench.failures))
        text, details = parted(bench.failures[0])
        assert re.fullmatch(r'a\.reindexed\.bag: recovered the first \d\.\d s; '
                            r'the rest is unreadable\.', text), text
        assert 'at byte' in details and 'at byte' not in text

    def test_the_view_offers_it(self, bench: Bench, cut: str) -> None:
        view = BagView(bench.model)
        bench.qtbot.addWidget(view)
        view.show()
        bench.open(cut)
        button = view.findChild(QPushButton, 'reindex')
        assert button.isVisible()
        bench.qtbot.mouseClick(button, Qt.LeftButton)
        bench.qtbot.waitUntil(lambda: bench.session.recording is not None)
        assert not button.isVisible()


class TestMarks:
    """Marks that are added afterward."""

    def test_a_mark_is_written_beside_the_bag(self, bench: Bench, path: str) -> None:
        bench.open(path)
        before = Path(path).read_bytes()
        bench.model.add_mark(7.5, 'thread breaks')
        bench.qtbot.waitUntil(lambda: len(bench.marks) == 2)
        assert bench.marks[1] == PlacedMark(7.5, 'thread breaks')
        assert Path(path).read_bytes() == before
        bench.open(path)
        assert len(bench.marks) == 2

    def test_where_it_is_kept_is_told_if_that_is_elsewhere(
            self, bench: Bench, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(bag_model, 'add_mark', lambda _bag, _mark: '/home/anna/a.marks.json')
        told: List[str] = []
        bench.model.noted.connect(told.append)
        bench.open(path)
        bench.model.add_mark(7.5, 'thread breaks')
        bench.qtbot.waitUntil(lambda: len(bench.marks) == 2)
        assert told == [f'{os.path.dirname(path)} cannot be written: the mark is kept in '
                        '/home/anna/a.marks.json']
        assert bench.failures == []

    def test_where_it_cannot_be_written_that_is_told(self, bench: Bench, path: str) -> None:
        bench.open(path)
        Path(f'{path}.marks.json').mkdir()
        bench.model.add_mark(7.5, 'thread breaks')
        bench.qtbot.waitUntil(lambda: bool(bench.failures))
        assert len(bench.marks) == 1


class TestCurves:
    """Curves in the background."""

    def test_they_come_with_bag_and_devices(self, bench: Bench, path: str) -> None:
        choose(bench.session, [machine('/feed_rate', '/edge')])
        bench.open(path)
        curves = bench.model.curves
        bench.qtbot.waitUntil(lambda: curves.reading is None)
        assert [curve.topic for curve in curves.curves] == ['/feed_rate']
        choose(bench.session, [machine('/edge')])
        bench.qtbot.waitUntil(lambda: curves.reading is None)
        assert curves.curves == ()

    def test_the_same_devices_do_not_read_again(self, bench: Bench, path: str) -> None:
        choose(bench.session, [machine('/feed_rate')])
        bench.open(path)
        bench.qtbot.waitUntil(lambda: bench.model.curves.reading is None)
        choose(bench.session, [machine('/feed_rate')])
        assert bench.model.curves.reading is None

    def test_they_can_be_canceled_and_read_after_all(self, bench: Bench, path: str) -> None:
        going_on = threading.Event()
        bench.tasks.run('curves', lambda: going_on.wait(60.0))
        row = CurvesRow(bench.model.curves)
        bench.qtbot.addWidget(row)
        choose(bench.session, [machine('/feed_rate')])
        bench.open(path)
        assert row.bar.isVisibleTo(row) and row.button.text() == 'Cancel'
        row.button.click()
        assert bench.model.curves.is_canceled and not row.isHidden()
        assert row.button.text() == 'Read them'
        going_on.set()
        wait_for_line(bench.tasks, 'curves', bench.qtbot)
        assert bench.model.curves.curves == ()
        row.button.click()
        bench.qtbot.waitUntil(lambda: len(bench.model.curves.curves) == 1)
        assert row.isHidden()


class TestView:
    """Texts for the operator."""

    @pytest.fixture
    def view(self, bench: Bench) -> BagView:
        view = BagView(bench.model)
        bench.qtbot.addWidget(view)
        view.resize(430, 300)
        view.show()
        return view

    def test_facts_and_topics(self, bench: Bench, view: BagView, path: str) -> None:
        assert 'Choose a recording' in view.facts.text()
        bench.open(path)
        assert '0:09.980' in view.facts.text() and '2020-09-1' in view.facts.text()
        assert view.details.text() == '1 topic, 501 messages'  # with the mark
        assert not view.topics.isVisible()
        bench.qtbot.mouseClick(view.details, Qt.LeftButton)
        assert view.topics.isVisible()
        row = view.topics.topLevelItem(0)
        assert [row.text(column) for column in range(4)] == ['/feed_rate', '500', '50\u2009Hz',
                                                             'Float32']

    def test_missing_topics_are_told_by_device(self, bench: Bench, view: BagView,
                                               path: str) -> None:
        bench.open(path)
        assert not view.warnings.isVisible()
        choose(bench.session, [machine('/feed_rate', '/a', '/b', '/c', '/d', '/e')])
        assert view.warnings.isVisible()
        assert 'machine</b>: not in the recording: /a, /b, /c and 2 more' in view.warnings.text()
        assert '/e' in view.warnings.toolTip()

    def test_messages_without_a_time_are_told(self, bench: Bench, view: BagView,
                                              path: str) -> None:
        with rosbag.Bag(path, 'a') as bag:
            for topic in ('/a', '/b', '/c<d>'):
                bag.write(topic, Float32(0.0), genpy.Time(0))
        bench.open(path)
        assert '0:09.980' in view.facts.text()
        assert '/a: one message has no time (0) and is left out' in view.warnings.text()
        assert 'and 1 more such remark' in view.warnings.text()
        assert '/c<d>' in view.warnings.toolTip()

    def test_a_recent_bag_is_opened_again(self, bench: Bench, view: BagView, path: str,
                                          tmp_path: Path) -> None:
        second = write_bag(tmp_path / 'b.bag')
        bench.open(path)
        bench.open(second)
        assert [view.recent.itemText(row) for row in range(2)] == ['b.bag', 'a.bag']
        view.recent.activated.emit(1)
        bench.qtbot.waitUntil(lambda: bench.session.paths == (path,))
        assert view.recent.currentText() == 'a.bag'
