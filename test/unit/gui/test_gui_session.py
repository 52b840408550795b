# SPDX-License-Identifier: BSD-3-Clause
"""The session: its current values, and the signals when they change."""
from __future__ import annotations

from typing import Any, List

import pytest
from playback_stand import PAUSED
from session_stand import choose, run

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Mode
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.gui.session import Session
from process_visualizer.launching.part_report import (
    NodeReport,
    NodeState,
    PartReport,
    PartState,
)

OVEN, PRESS = (Device(DeviceType.OTHER, name, Location('cell.xml', 1))
               for name in ('oven', 'press'))


class Told:
    """Session, and the names of the signals that it emits."""

    def __init__(self) -> None:
        self.session = Session()
        self._names: List[str] = []
        for name in ('opened', 'cell_changed', 'run_changed', 'player_changed',
                     'recording_changed'):
            getattr(self.session, name).connect(lambda name=name: self._names.append(name))

    def names(self) -> List[str]:
        """Return the signals since the last call."""
        told, self._names = self._names, []
        return told


@pytest.fixture
def told(qtbot: Any) -> Told:
    return Told()


def test_another_file_is_told_before_its_devices(told: Told) -> None:
    choose(told.session, [OVEN], '/one.xml')
    assert told.names() == ['opened', 'cell_changed']
    choose(told.session, [OVEN, PRESS], '/one.xml')  # read again
    assert told.names() == ['cell_changed']
    choose(told.session, [OVEN], '/other.xml')
    assert told.names() == ['opened', 'cell_changed']
    assert (told.session.file, told.session.devices) == ('/other.xml', (OVEN,))


def test_what_stays_the_same_is_not_told(told: Told) -> None:
    choose(told.session, [OVEN, PRESS])
    told.names()
    told.session.choose((OVEN, PRESS))
    told.session.set_mode(Mode.REALTIME)
    assert told.names() == []
    told.session.choose((PRESS,))
    told.session.set_mode(Mode.PLAYBACK)
    assert told.names() == ['cell_changed', 'cell_changed']


def test_the_mode_of_what_runs_counts_before_the_chosen_one(told: Told) -> None:
    choose(told.session, [OVEN])
    told.session.set_mode(Mode.PLAYBACK)
    run(told.session, Mode.REALTIME)
    assert told.session.mode_in_force is Mode.REALTIME
    run(told.session, None)
    assert (told.session.running_mode, told.session.mode_in_force) == (None, Mode.PLAYBACK)


def test_what_is_still_launched_does_not_run(told: Told) -> None:
    run(told.session, Mode.REALTIME)
    launched = told.session.running
    told.session.set_run(launched, False, {})
    assert (told.session.launched, told.session.running) == (launched, None)


def test_a_part_has_ended_with_a_node_of_it(told: Told) -> None:
    recorder = NodeReport('/recorder', NodeState.RUNNING)
    for node, has_ended in ((recorder, False), (recorder.exited(-9), True)):
        told.session.set_run(None, False, {
            BAG_PART: PartReport(BAG_PART, PartState.RUNNING, (node,))})
        assert told.session.has_ended(BAG_PART) is has_ended
    assert told.session.runs(BAG_PART) and told.session.nodes == ['/recorder']
    assert not told.session.runs('another') and not told.session.has_ended('another')


def test_the_player_is_gone_with_its_mode(told: Told) -> None:
    run(told.session, Mode.PLAYBACK)
    told.session.take_player(PAUSED)
    run(told.session, Mode.PLAYBACK)  # a part has changed its state
    assert told.session.player is PAUSED
    told.names()
    run(told.session, Mode.REALTIME)
    run(told.session, Mode.REALTIME)
    assert told.session.player is None
    assert told.names() == ['run_changed', 'player_changed', 'run_changed']
