# SPDX-License-Identifier: BSD-3-Clause
"""The watch of the launcher: nodes that do not answer, and problems of the master."""
from __future__ import annotations

import errno
import socket
from contextlib import suppress
from typing import Any, Dict, List, Set, Tuple

import pytest
import rosgraph

from process_visualizer.launching.cell_watch import MASTER_OTHER, MASTER_SILENT, CellLook, CellWatch

NODES = {'/scene_watch', '/cell_frames', '/bag_recorder'}
STEP_S = 0.1
NOTICED_S = 1.0
"""Maximum time until the watch knows the state of a node."""


class Cell:
    """Nodes and a master that answer, hang or are gone, with a fake clock."""

    def __init__(self) -> None:
        self.running, self.hanging = set(NODES), set()  # type: Set[str], Set[str]
        self.refusing: Set[str] = set()
        self.unreachable: Set[str] = set()  # for 3 s, Linux waits; then it says so for an instant
        self.answers_after_s = 0.0
        self.master_id, self.now_s = 7, 100.0
        self.told: List[CellLook] = []
        self.watch = CellWatch(lambda: self.running, self.told.append, self, self.connect)
        self._asked: Dict[socket.socket, Tuple[str, float]] = {}

    # The master.

    def getPid(self) -> int:
        if not self.master_id:
            raise TimeoutError('no answer')
        return self.master_id

    def lookupNode(self, node: str) -> str:
        self.getPid()
        if self.master_id != 7:
            raise rosgraph.MasterException('unknown')
        return node

    def getSystemState(self) -> List[Any]:
        raise NotImplementedError

    def setParam(self, key: str, value: Any) -> None:
        raise NotImplementedError

    # The nodes.

    def connect(self, node: str) -> socket.socket:
        if node in self.refusing:
            raise ConnectionRefusedError
        if node in self.unreachable and self.now_s % 3.0 < 0.5:
            raise OSError(errno.EHOSTUNREACH, 'No route to host')
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        self._asked[theirs] = node, self.now_s + self.answers_after_s
        return ours

    def let_pass(self, duration_s: float) -> CellLook:
        """Let time pass; return the last report."""
        end_s = self.now_s + duration_s
        while self.now_s < end_s:
            self.watch.step(self.now_s, 0.0)
            for theirs in [it for it, (node, due_s) in self._asked.items()
                           if node not in self.hanging | self.unreachable and self.now_s >= due_s]:
                del self._asked[theirs]
                with suppress(BrokenPipeError):  # nobody waits for it any more
                    theirs.sendall(b'HTTP/1.0 200 OK\r\n\r\n<methodResponse></methodResponse>')
                theirs.close()
            self.now_s += STEP_S
        return self.told[-1] if self.told else CellLook()


@pytest.fixture
def cell() -> Cell:
    made = Cell()
    assert made.let_pass(7.0) == CellLook()  # no node is starting any more
    return made


def test_nodes_that_are_starting_may_be_late() -> None:
    cell = Cell()
    cell.let_pass(1.0)
    cell.answers_after_s = 1.5
    cell.let_pass(2.0)
    assert not cell.told
    cell.hanging = {'/bag_recorder'}
    assert cell.let_pass(3.5) == CellLook(frozenset(cell.hanging))


@pytest.mark.parametrize('hanging', [{'/bag_recorder'}, {'/scene_watch', '/cell_frames'}, NODES])
def test_whoever_hangs_is_told_and_whoever_answers_again(cell: Cell, hanging: Set[str]) -> None:
    cell.hanging = hanging
    assert cell.let_pass(NOTICED_S) == CellLook(frozenset(hanging))
    cell.hanging = set()
    assert cell.let_pass(NOTICED_S) == CellLook()
    assert len(cell.told) == 2


def test_one_that_has_ended_is_told_by_roslaunch(cell: Cell) -> None:
    cell.hanging = {'/bag_recorder'}
    cell.let_pass(NOTICED_S)
    cell.running -= {'/bag_recorder'}
    assert cell.let_pass(NOTICED_S) == CellLook()


def test_a_master_that_hangs_makes_no_node_silent(cell: Cell) -> None:
    cell.master_id = 0
    assert cell.let_pass(3.0) == CellLook(master_problem=MASTER_SILENT)
    cell.hanging = {'/bag_recorder'}
    assert cell.let_pass(NOTICED_S) == CellLook(frozenset(cell.hanging), MASTER_SILENT)
    cell.hanging = set()  # asked again at its last address, although the master is silent
    assert cell.let_pass(NOTICED_S) == CellLook(master_problem=MASTER_SILENT)
    cell.master_id = 7
    assert cell.let_pass(1.2) == CellLook()


def test_a_master_that_misses_one_question_is_not_told(cell: Cell) -> None:
    cell.master_id = 0
    cell.let_pass(1.0)
    cell.master_id = 7
    assert cell.let_pass(2.0) == CellLook() and not cell.told


def test_another_master_does_not_know_the_nodes(cell: Cell) -> None:
    cell.master_id = 8
    assert cell.let_pass(1.2) == CellLook(master_problem=MASTER_OTHER)
    cell.running = set()
    assert cell.let_pass(0.5) == CellLook()  # the cell was stopped: the next one begins with this


def test_nothing_is_told_after_the_end(cell: Cell) -> None:
    cell.watch.close()
    cell.hanging = set(NODES)
    cell.let_pass(NOTICED_S)
    assert not cell.told


def test_one_that_runs_but_takes_no_questions_is_told(cell: Cell) -> None:
    cell.refusing = {'/bag_recorder'}
    assert cell.let_pass(2.5) == CellLook()  # roslaunch may be about to report its end
    assert cell.let_pass(1.0) == CellLook(frozenset(cell.refusing))
    cell.refusing = set()
    assert cell.let_pass(NOTICED_S) == CellLook()


def test_one_on_a_computer_that_cannot_be_reached_is_silent_all_the_time(cell: Cell) -> None:
    cell.unreachable = {'/bag_recorder'}
    cell.let_pass(12.0)
    assert cell.told == [CellLook(frozenset(cell.unreachable))], 'it was told once'
    cell.unreachable = set()
    assert cell.let_pass(NOTICED_S) == CellLook()


def test_one_that_was_started_again_is_not_told_for_its_last_process(cell: Cell) -> None:
    cell.running, cell.refusing = NODES - {'/bag_recorder'}, {'/bag_recorder'}
    cell.let_pass(10.0)
    cell.running, cell.refusing = set(NODES), set()
    cell.let_pass(2.0)
    assert not cell.told


def test_on_a_busy_computer_nobody_is_called_silent_who_answers_as_late_as_the_others(
        cell: Cell) -> None:
    cell.answers_after_s = 0.3
    cell.let_pass(5.0)
    cell.answers_after_s = 0.7
    cell.let_pass(5.0)
    assert not cell.told
    cell.answers_after_s = 1.5
    cell.let_pass(5.0)
    assert not cell.told
    cell.hanging = {'/bag_recorder'}
    assert cell.let_pass(3.0) == CellLook(frozenset(cell.hanging))


def test_an_answer_that_is_too_late_is_heard_and_teaches_patience(cell: Cell) -> None:
    cell.answers_after_s = 0.9
    assert cell.let_pass(20.0) == CellLook()
    assert len(cell.told) == 2  # at first it could not be known


def test_one_that_hung_does_not_teach_patience_with_the_next(cell: Cell) -> None:
    cell.hanging = {'/bag_recorder'}
    cell.let_pass(1.5)
    cell.hanging = set()  # its answer arrives now, late
    cell.let_pass(NOTICED_S)
    cell.hanging = {'/scene_watch'}
    assert cell.let_pass(NOTICED_S) == CellLook(frozenset(cell.hanging))
