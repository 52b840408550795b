# SPDX-License-Identifier: BSD-3-Clause
"""Unsaved values are offered again, with the configuration that they belong to."""
from __future__ import annotations

import json
from typing import Any, Dict, List

import pytest
from held_tasks import HeldTasks
from PyQt5.QtCore import QObject
from session_stand import choose

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import BaseFrame, Device, DeviceType, Pose
from process_visualizer.gui.cell.calibration_model import CalibrationModel
from process_visualizer.gui.cell.edited_values import UnsavedModel
from process_visualizer.gui.session import Session

ONE, OTHER = '/cells/one.xml', '/cells/other.xml'
HERE = Location(ONE, 1)
POSE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.5)


class Program:
    """Launcher with the poses of two devices."""

    def __init__(self, kept: Dict[str, Any]) -> None:
        self.tasks, self._parent = HeldTasks(), QObject()
        self.poses = CalibrationModel(self.tasks, lambda *_: None)  # type: ignore[arg-type]
        self.session = Session()
        self.model = UnsavedModel({'the pose': self.poses}, self.session, self._parent)
        self.model.restore(json.loads(json.dumps(kept)))

    def open(self, file: str, *names: str) -> None:
        devices = [Device(DeviceType.OTHER, name, HERE, base=BaseFrame(name, Pose(), HERE))
                   for name in names or ('arm', 'table')]
        choose(self.session, devices, file)
        self.poses.set_devices(devices)

    def end(self) -> 'Program':
        return Program(self.model.settings())


@pytest.fixture
def session(qtbot: Any) -> Program:
    found = Program({})
    found.open(ONE)
    found.poses.set_numbers('table', POSE)
    return found


def test_the_next_session_offers_what_this_one_did_not_save(session: Program) -> None:
    later = session.end()
    assert later.model.offered == []  # no configuration is open yet
    later.open(ONE)
    assert (later.model.offered, later.poses.unsaved) == (['the pose of table'], [])
    later.model.take()
    assert (later.model.offered, later.model.unsaved) == ([], ['the pose of table'])
    assert later.poses.edits() == {'table': POSE}


def test_what_is_neither_taken_nor_discarded_is_offered_again(session: Program) -> None:
    later = session.end()
    later.open(ONE)
    later.poses.set_numbers('arm', POSE)
    last = later.end()
    last.open(ONE)
    assert sorted(last.model.offered) == ['the pose of arm', 'the pose of table']
    last.model.discard_offer()
    assert last.model.settings() == {}


def test_another_configuration_neither_loses_nor_gets_it(session: Program) -> None:
    session.open(OTHER)
    assert (session.model.unsaved, session.model.offered) == ([], [])
    session.open(ONE)
    assert session.model.offered == ['the pose of table']


def test_it_stays_while_the_configuration_is_read_again(session: Program) -> None:
    session.open(ONE)
    assert session.model.unsaved == ['the pose of table']


def test_nothing_is_offered_that_is_in_the_file_by_now_or_has_no_device(session: Program) -> None:
    later = session.end()
    later.open(ONE, 'arm')
    assert later.model.offered == []
    later.open(ONE)
    later.poses.set_numbers('table', POSE)
    assert later.model.offered == []


def test_what_the_operator_discards_is_gone(session: Program) -> None:
    session.model.discard()
    assert session.model.settings() == {}


@pytest.mark.parametrize('numbers', [[1.0], [*POSE[1:], 'wide'], [*POSE[1:], float('nan')], 5])
def test_damaged_numbers_are_refused(qtbot: Any, numbers: List[Any]) -> None:
    with pytest.raises((TypeError, ValueError)):
        Program({ONE: {'the pose': {'table': numbers}}})
