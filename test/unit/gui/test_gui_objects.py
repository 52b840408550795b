# SPDX-License-Identifier: BSD-3-Clause
"""Unmodeled objects in the window's models and timelines."""
from __future__ import annotations

from typing import Any, List, Tuple

import pytest

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell, Device, DeviceType, Mode, SoughtObjects
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.cell.objects_model import SILENT_S, START_S, ObjectsModel
from process_visualizer.gui.ros.snapshots import ObjectsSnapshot, PlayerSnapshot
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import HOLD_S, SeenObject, times

HERE = Location('cell.xml', 1)
KINECT = Device(DeviceType.DEPTH_SENSOR, 'kinect', HERE,
                objects=SoughtObjects(0.5, 0.2, 0.03, 0.5, None, None, (), HERE))
ARM = Device(DeviceType.ROBOT, 'arm', HERE)
CELL = Cell('cell.xml', 'world', (KINECT, ARM))
NEAR, TOO_NEAR = (
    SeenObject(1, 'arm/hand', distance_m, (0.2, 0.2, 0.2), level)
    for distance_m, level in ((0.4, Level.WARNING), (0.1, Level.BAD)))


class Stand:
    """Model of a cell with a depth sensor; its clock is set by hand."""

    def __init__(self, qtbot: Any) -> None:
        self.now_s = 1000.0
        self.model = ObjectsModel(wall_s=lambda: self.now_s)
        self.followed: List[Tuple[str, ...]] = []
        self.model.sensors_wanted.connect(self.followed.append)
        self._qtbot = qtbot

    def run(self, mode: Mode, bag: str = '') -> None:
        self.model.set_running(Choice(CELL, mode, CELL.devices, bag=bag or None))

    def see(self, *objects: SeenObject) -> None:
        self.model.take(ObjectsSnapshot('kinect', self.now_s, objects))

    def play(self, position_s: float, segment: int = 1, rate: float = 1.0) -> None:
        self.model.take_player(PlayerSnapshot(self.now_s, 0.0, 60.0, position_s, rate, rate,
                                              False, segment=segment, since_s=self.now_s))

    def texts(self) -> List[str]:
        return [it.text.split(' m ')[0] for it in self.model.conditions]

    def let_the_timer_end(self, after_s: float) -> None:
        """Advance the clock, and the timer with it."""
        assert self.model._timer.isActive()
        self.now_s += after_s
        self.model._timer.timeout.emit()


@pytest.fixture
def stand(qtbot: Any) -> Stand:
    made = Stand(qtbot)
    made.run(Mode.REALTIME)
    return made


def test_sensors_are_followed_while_they_run(stand: Stand) -> None:
    assert stand.followed == [('kinect',)]
    stand.run(Mode.PLAYBACK)
    stand.model.set_running(None)
    assert stand.followed == [('kinect',), ()]


def test_a_sensor_of_which_no_cloud_is_evaluated_is_told(stand: Stand) -> None:
    stand.let_the_timer_end(START_S)
    assert [(it.source, it.level) for it in stand.model.conditions] == [('kinect', Level.WARNING)]
    assert 'none of its clouds is evaluated' in stand.texts()[0]
    stand.see()
    assert stand.texts() == []
    stand.let_the_timer_end(SILENT_S)
    assert stand.model.conditions[0].since_s == stand.now_s - SILENT_S
    stand.run(Mode.PLAYBACK)
    assert stand.texts() == []


def test_a_sensor_that_starts_is_not_told_to_be_blind(stand: Stand) -> None:
    stand.model.set_starting(['kinect'])
    stand.now_s += START_S + 5.0
    stand.model.set_starting([])
    stand.let_the_timer_end(START_S - 1.0)
    assert stand.texts() == []
    stand.let_the_timer_end(1.0)
    assert stand.model.conditions[0].since_s == stand.now_s - START_S
    stand.see()
    stand.model.set_starting(['kinect'])  # it is restarted
    stand.now_s += SILENT_S
    stand.model.set_starting([])
    stand.let_the_timer_end(START_S - 1.0)
    assert stand.texts() == []


def test_a_clear_cell_is_told_once(stand: Stand, qtbot: Any) -> None:
    stand.see()
    told: List[float] = []
    stand.model.changed.connect(lambda: told.append(stand.now_s))
    for _ in range(60):
        stand.now_s += 1.0
        stand.see()
    assert told == []


def test_an_object_is_told_at_once_and_its_distance_calmly(stand: Stand) -> None:
    stand.see(NEAR)
    assert stand.texts() == ['object 1 is 0.40']
    stand.now_s += 0.05
    stand.see(NEAR._replace(distance_m=0.39))
    assert stand.texts() == ['object 1 is 0.40']
    stand.let_the_timer_end(0.2)
    assert stand.texts() == ['object 1 is 0.39']
    stand.see(TOO_NEAR)
    assert (stand.texts(), stand.model.conditions[0].level) == (['object 1 is 0.10'], Level.BAD)


def test_its_distance_is_told_while_clouds_keep_the_timer_from_ending(stand: Stand) -> None:
    told: List[float] = []
    stand.model.changed.connect(lambda: told.append(stand.now_s))
    begin_s = stand.now_s
    for number in range(1, 51):  # the timer ends shortly after a cloud, which restarts it
        stand.see(NEAR._replace(distance_m=0.4 - number / 1000.0))
        stand.now_s = begin_s + 0.1 * number
    assert len(told) > 15
    assert max(after - before for before, after in zip(told, told[1:])) < 0.35


def test_it_goes_away(stand: Stand) -> None:
    stand.see(NEAR)
    stand.now_s += 0.1
    stand.see()
    assert len(stand.model.conditions) == 1
    stand.let_the_timer_end(HOLD_S)
    assert stand.model.conditions == ()
    assert times(stand.model.live, Level.WARNING) == ((1000.0, 1000.0),)


def test_a_sensor_that_is_silent_does_not_know(stand: Stand) -> None:
    stand.see(NEAR)
    stand.let_the_timer_end(SILENT_S)
    stand.let_the_timer_end(HOLD_S) if stand.model.conditions else None
    assert stand.model.conditions == () and stand.model.silent == ('kinect',)
    stand.see()
    assert stand.model.silent == ()


def test_quitting_ends_it(stand: Stand) -> None:
    stand.see(NEAR)
    stand.model.set_running(None)
    assert stand.model.conditions == ()
    stand.see(NEAR)  # a message that was on its way
    assert stand.model.conditions == ()


def test_in_a_recording_that_stands_it_stays(stand: Stand) -> None:
    stand.run(Mode.PLAYBACK, 'a.bag')
    stand.play(10.0)
    stand.now_s += 2.0
    stand.see(NEAR)
    (condition,) = stand.model.conditions
    assert condition.position_s == 12.0
    stand.now_s += 3600.0
    stand.see(NEAR)
    assert len(stand.model.conditions) == 1


def test_where_in_the_recording(stand: Stand) -> None:
    stand.run(Mode.PLAYBACK, 'a.bag')
    stand.play(10.0)
    for _ in range(3):
        stand.now_s += 1.0
        stand.see(NEAR)
    stand.play(30.0, segment=2)
    stand.see(TOO_NEAR)
    assert times(stand.model.played, Level.WARNING) == ((11.0, 13.0), (30.0, 30.0))
    assert times(stand.model.played, Level.BAD) == ((30.0, 30.0),)
    stand.run(Mode.PLAYBACK, 'b.bag')
    assert stand.model.played == ()
