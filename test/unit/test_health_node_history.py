# SPDX-License-Identifier: BSD-3-Clause
"""Nodes that never start up, and nodes that end again and again."""
from __future__ import annotations

from typing import List

from process_visualizer.health.alarm_board import Action, AlarmBoard, Condition
from process_visualizer.health.alarm_conditions import part_conditions
from process_visualizer.health.device_state import Level
from process_visualizer.health.node_history import STARTS_WITHIN_S, STEADY_AFTER_S, NodeHistory
from process_visualizer.launching.part_report import NodeReport, PartReport

NODE = '/arm/driver'
RESTART = Action.RESTART_DEVICE


class Stand:
    """Part with a driver, and all messages about it."""

    def __init__(self) -> None:
        self.history, self.board = NodeHistory(), AlarmBoard()
        self.report = PartReport('arm').starting([NODE])
        self.now_s = 0.0

    def at(self, now_s: float, node: 'NodeReport | None' = None) -> List[Condition]:
        self.now_s = now_s
        if node is not None:
            self.report = self.report.node_changed(node)
        self.history.take([self.report], now_s)
        found = [*part_conditions('arm', self.report, RESTART),
                 *self.history.conditions('arm', self.report, RESTART, now_s)]
        self.board = self.board.seen(found, now_s)
        return found

    @property
    def driver(self) -> NodeReport:
        return self.report.nodes[0]


def test_a_node_that_never_gets_up_is_told_until_it_does() -> None:
    stand = Stand()
    assert stand.at(0.0) == stand.at(STARTS_WITHIN_S - 0.1) == []
    (found,) = stand.at(STARTS_WITHIN_S)
    assert found.said == ('arm: driver is still starting after 30 s: it may be hanging, or not be '
                          'a ROS node')
    assert found.actions == (RESTART, Action.SHOW_LOG)
    assert stand.at(50.0, stand.driver.registered()) == []


def test_a_node_that_is_started_anew_has_as_much_time_again() -> None:
    stand = Stand()
    stand.at(0.0)
    stand.report = stand.report.stopping()
    stand.at(20.0)
    stand.report = stand.report.stopped().starting([NODE])
    assert stand.at(21.0) == stand.at(STARTS_WITHIN_S) == []


def test_a_node_that_ends_again_and_again_is_one_alarm() -> None:
    stand = Stand()
    stand.at(0.0)
    stand.at(1.0, stand.driver.registered())
    for second in range(2, 12):
        stand.at(second, stand.driver.exited(3))
        stand.at(second + 0.1, stand.driver.started())
        stand.at(second + 0.4, stand.driver.registered())
    (alarm,) = stand.board.alarms
    assert alarm.condition.text == 'driver ended with code 3, and was started again 10 times'
    assert alarm.condition.level is Level.BAD
    assert alarm.since_s == 2.0
    assert [it.text for it in stand.board.events] == ['arm: driver ended with code 3']
    stand.at(11.1 + STEADY_AFTER_S)
    assert stand.board.alarms == ()


def test_a_part_without_nodes_is_not_waited_for_forever() -> None:
    history, report = NodeHistory(), PartReport('arm').starting([])
    history.take([report], 0.0)
    assert not history.is_up(report, STARTS_WITHIN_S - 0.1)
    assert history.is_up(report, STARTS_WITHIN_S)
