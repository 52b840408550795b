"""The panel as a whole: a real bag, and a player that the test plays."""
from __future__ import annotations

from pathlib import Path
from typing import Iterator

import genpy
import pytest
import rosbag
from playback_stand import PlaybackStand
from PyQt5.QtWidgets import QInputDialog
from pytestqt.qtbot import QtBot
from std_msgs.msg import Float32

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.gui.models.bag_model import BagModel
from process_visualizer.gui.models.playback_model import PlacedMark
from process_visualizer.gui.tasks import Tasks
from process_visualizer.gui.views.playback_panel import PlaybackPanel

HERE = Location('cell.xml', 1)
MACHINE = Device(DeviceType.OTHER, 'machine', HERE,
                 topics=(Topic('/feed', None, None, True, HERE),))


class Bench:
    """The panel with a bag of 4 s, whose feed rate is its time."""

    def __init__(self, qtbot: QtBot, tasks: Tasks, folder: Path) -> None:
        self.stand = PlaybackStand()
        self.bag = BagModel(tasks)
        self.panel = PlaybackPanel(self.stand.model, self.bag)
        qtbot.addWidget(self.panel)
        self.panel.resize(430, 600)
        self.panel.show()
        path = folder / 'a.bag'
        with rosbag.Bag(str(path), 'w') as bag:
            for row in range(401):
                time = genpy.Time(1000) + genpy.Duration.from_sec(row / 100)
                bag.write('/feed', Float32(row / 100), time)
        self.bag.set_devices([MACHINE])
        self.bag.open([str(path)])
        qtbot.waitUntil(lambda: bool(self.bag.curves.curves))
        self.stand.state(duration_s=4.0, position_s=1.0, files=self.bag.paths)


@pytest.fixture
def bench(qtbot: QtBot, tmp_path: Path) -> Iterator[Bench]:
    tasks = Tasks()
    yield Bench(qtbot, tasks, tmp_path)
    tasks.close()


def test_the_curves_of_the_bag_are_in_the_timeline(bench: Bench) -> None:
    value, largest = bench.panel.timeline.lane_values(0)
    assert float(value) == pytest.approx(1.0, abs=0.01)
    assert largest == 'max 4.00'


def test_its_topics_are_units_of_a_step(bench: Bench) -> None:
    assert bench.panel.transport.unit.findText('/feed') > 0


def test_a_mark_is_asked_for_and_added(bench: Bench, qtbot: QtBot) -> None:
    bench.panel.timeline.mark_wanted.emit(2.5)
    dialog = bench.panel.findChild(QInputDialog, 'mark_label')
    dialog.setTextValue('thread breaks')
    dialog.accept()
    qtbot.waitUntil(lambda: bench.bag.marks == (PlacedMark(2.5, 'thread breaks'),))


def test_what_the_player_cannot_play_is_told(bench: Bench) -> None:
    assert not bench.panel.notes.isVisible()
    bench.stand.state(gaps=('/x has another type',), dropped=7)
    assert bench.panel.notes.isVisible()
    assert bench.panel.notes.text() == ('7 messages were too many for slow subscribers  '
                                        '(and 1 more)')
    assert '/x has another type' in bench.panel.notes.toolTip()
