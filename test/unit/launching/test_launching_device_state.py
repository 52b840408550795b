# SPDX-License-Identifier: BSD-3-Clause
"""A device's state in words."""
from __future__ import annotations

from dataclasses import replace
from typing import Optional

import pytest

from process_visualizer.bagio.catalog import CatalogTopic
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, LaunchFile, Topic
from process_visualizer.health.device_state import (
    Level,
    Line,
    TopicActivity,
    device_state,
    live_line,
    recorded_line,
    said_of,
    worst,
)
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState

HERE = Location('cell.xml', 1)
ARM = Device(DeviceType.ROBOT, 'arm', HERE,
             topics=(Topic('/arm/q', None, None, True, HERE),
                     Topic('/arm/cloud', None, None, False, HERE)))
UP = NodeReport('/arm/driver', NodeState.RUNNING)
STARTING = NodeReport('/arm/robot_proc', NodeState.STARTING)
DIED = NodeReport('/arm/driver', NodeState.EXITED, -9)
ENDED = NodeReport('/arm/driver', NodeState.EXITED, 0)
NAMESAKE = NodeReport('/arm/arm', NodeState.EXITED, -9)
REFUSED = NodeReport('/arm/driver', NodeState.FAILED, reason='no such executable')
FLOWING = TopicActivity(125.0, 0.004, False)
SILENT = TopicActivity(0.0, 3.24, True)


def summary(state: PartState, *nodes: NodeReport, topic: Optional[TopicActivity] = None,
            reason: str = '') -> Line:
    lines = {} if topic is None else {'/arm/q': live_line(topic)}
    return device_state(ARM, PartReport('arm', state, nodes, reason), lines).summary


@pytest.mark.parametrize('line, level, text', [
    (summary(PartState.RUNNING, UP, topic=FLOWING), Level.GOOD, 'running'),
    (summary(PartState.STARTING, UP, STARTING), Level.WAITING, 'starting, 1 of 2 nodes up'),
    (summary(PartState.RUNNING, DIED), Level.BAD, 'driver killed by SIGKILL'),
    (summary(PartState.RUNNING, NAMESAKE, UP), Level.BAD, 'killed by SIGKILL'),
    (summary(PartState.RUNNING, ENDED, UP), Level.WARNING, 'driver ended with code 0'),
    (summary(PartState.RUNNING, REFUSED, ENDED), Level.BAD,
     'driver cannot be started: no such executable (and 1 more)'),
    (summary(PartState.FAILED, reason='no such file'), Level.BAD, 'no such file'),
    (summary(PartState.RUNNING, UP, topic=SILENT), Level.WARNING, 'No data from /arm/q'),
    (summary(PartState.RUNNING, DIED, topic=SILENT), Level.BAD,
     'driver killed by SIGKILL'),
    (summary(PartState.STOPPING, UP), Level.WAITING, 'stopping'),
])
def test_summary(line: Line, level: Level, text: str) -> None:
    assert (line.level, line.text) == (level, text)


@pytest.mark.parametrize('text, said', [
    ('killed by SIGKILL', 'arm: killed by SIGKILL'),
    ('arm is above 200', 'arm is above 200'),
    ('armature is above 200', 'arm: armature is above 200')])
def test_a_name_is_said_once(text: str, said: str) -> None:
    assert said_of('arm', text) == said


def test_of_several_silent_topics_the_number_is_told() -> None:
    lines = {topic.name: live_line(SILENT) for topic in ARM.topics}
    state = device_state(ARM, PartReport('arm', PartState.RUNNING, (UP,)), lines)
    assert (state.summary.level, state.summary.text) == (Level.WARNING, 'No data from 2 topics')


def test_device_that_does_not_run_says_nothing() -> None:
    state = device_state(ARM, None, {'/arm/q': live_line(SILENT)})
    assert state.summary == Line(Level.OFF, '')
    assert set(state.topics.values()) == {Line(Level.OFF, '')}


def test_nodes_and_topics_have_lines_of_their_own() -> None:
    report = PartReport('arm', PartState.RUNNING, (UP, STARTING))
    state = device_state(ARM, report, {'/arm/q': live_line(FLOWING)})
    assert state.nodes == {'/arm/driver': Line(Level.GOOD, 'running'),
                           '/arm/robot_proc': Line(Level.WAITING, 'starting')}
    assert state.topics == {'/arm/q': Line(Level.GOOD, '125\u2009Hz'),
                            '/arm/cloud': Line(Level.OFF, '')}  # nobody counts its messages


def test_topic_without_a_message_waits() -> None:
    state = device_state(ARM, PartReport('arm', PartState.RUNNING, (UP,)),
                         {'/arm/q': live_line(TopicActivity(0.0, None, False))})
    assert state.topics['/arm/q'] == Line(Level.WAITING, 'no message yet')
    assert state.summary.level is Level.GOOD


@pytest.mark.parametrize('line, text', [
    (live_line(TopicActivity(1250.0, 0.0, False)), '1250 Hz'),
    (live_line(TopicActivity(0.0, 12.3, False)), 'last 12 s ago'),  # now and then
    (live_line(TopicActivity(0.0, 12.3, False), is_latched=True), 'latched'),
    (live_line(TopicActivity(2.0, 0.3, False), is_latched=True), '2.0 Hz'),
    (recorded_line(CatalogTopic('/arm/q', ('x/Y',), 500, 125.0), True), '125 Hz'),
    (recorded_line(CatalogTopic('/arm/q', ('x/Y',), 2, 0.04), True), '0.04 Hz'),
    (recorded_line(CatalogTopic('/arm/q', ('x/Y',), 3, 0.987, True), True), 'latched'),
    (recorded_line(CatalogTopic('/arm/q', ('x/Y',), 1, 0.0), True), 'once'),
    (recorded_line(CatalogTopic('/arm/q', ('x/Y',), 1, 0.0), False), 'not played'),
])
def test_rates(line: Line, text: str) -> None:
    assert line.text.replace('\u2009', ' ') == text


def test_the_worst_of_lines() -> None:
    assert worst(()) == Line(Level.OFF, '')
    lines = (Line(Level.GOOD, 'a'), Line(Level.BAD, 'b'), Line(Level.WAITING, 'c'))
    assert worst(lines).text == 'b'


def test_a_driver_that_is_not_started_in_a_mode_does_not_run() -> None:
    driver = replace(ARM, launch_files=(LaunchFile('arm', 'driver.launch', None, (), HERE),))
    report = PartReport('arm', PartState.RUNNING, ())
    assert device_state(driver, report, {}).summary == Line(Level.OFF, 'no nodes in this mode')
    assert device_state(ARM, report, {}).summary.text == 'running'  # its model is displayed
