# SPDX-License-Identifier: BSD-3-Clause
"""Texts in the scene about display nodes that have ended, hang, or were shut down."""
from __future__ import annotations

import socket
from contextlib import suppress
from typing import Any, Dict, List, Set, Tuple

import pytest
import rosgraph
from simulated_node import SimulatedNode
from std_msgs.msg import Float32
from visualization_msgs.msg import Marker

from process_visualizer.nodes.scene_watch import SceneWatch
from process_visualizer.parameters.cell_parameters import SceneParameters, WatchedDevice
from process_visualizer.ros_names import CONCERNED_KEY, STALE_POINTS_KEY

STATE_PUBLISHER, PROCESSOR, NEVER = '/r/robot_state_publisher', '/r/robot_proc', '/r/variable_proc'
PARAMETERS = SceneParameters('r/link0', (
    WatchedDevice('r', 'r/link0', (0.0, 0.0, 0.7), {
        STATE_PUBLISHER: 'the robot does not move', PROCESSOR: 'no arrows or numbers',
        NEVER: 'never started'}, ('/r/marker',)),
    WatchedDevice('c', 'world', (0.0, 0.0, 0.0), {'/c/depth_proc': 'the points are out of date'},
                  ('/c/points',), '/c/points_age')), 0.7)
STEP_S = 0.05
NOTICED_S = 1.0
"""Maximum time until the watch reacts: it asks every 0.3 s, and waits 0.5 s for an answer."""


class Processes:
    """Master, and the processes of nodes as far as they can be asked."""

    def __init__(self, *nodes: str) -> None:
        self.running = set(nodes)
        self.hanging: Set[str] = set()
        self.killed: Set[str] = set()
        self.publishers: Dict[str, List[str]] = {}
        self.is_master_there = True
        self.parameters: Dict[str, Any] = {}
        self._questions: List[Tuple[str, socket.socket]] = []

    def getSystemState(self) -> List[Any]:
        if not self.is_master_there:
            raise rosgraph.MasterException('no master')
        return [list(self.publishers.items()), [], []]

    def setParam(self, key: str, value: Any) -> None:
        self.parameters[key] = value

    def lookupNode(self, node: str) -> str:
        if not self.is_master_there:
            raise ConnectionError('no master')
        if node not in self.running | self.killed:
            raise rosgraph.MasterException(f'unknown node {node}')
        return node

    def connect(self, node: str) -> socket.socket:
        """Connect as the kernel does: refuse for a stopped process, but not for one that hangs."""
        if node not in self.running:
            raise ConnectionRefusedError(node)
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        self._questions.append((node, theirs))
        return ours

    def answer(self) -> None:
        """Let all processes that do not hang answer."""
        waiting = [it for it in self._questions if it[0] in self.hanging]
        for node, connection in self._questions:
            if node in self.hanging:
                continue
            if node in self.running:
                assert b'getPid' in connection.recv(4096)
                with suppress(BrokenPipeError):  # nobody waits for it any more
                    connection.sendall(b'HTTP/1.0 200 OK\r\n\r\n<methodResponse></methodResponse>')
            connection.close()
        self._questions = waiting


class Watch:
    """The node, and its markers in RViz."""

    def __init__(self) -> None:
        self.processes = Processes(STATE_PUBLISHER, PROCESSOR, '/c/depth_proc')
        self.node = SimulatedNode('/scene_watch')
        self.start()

    def start(self) -> None:
        """Start the node, or restart it after its last process has ended."""
        for name, value in self.processes.parameters.items():
            self.node.set_param(name, value)
        self._watch = SceneWatch(self.node, self.processes, PARAMETERS, self.processes.connect)
        self.wait(NOTICED_S)

    def wait(self, duration_s: float) -> None:
        """Let time pass, step by step."""
        end_s = self.node.now_s + duration_s
        while self.node.now_s < end_s:
            self._watch.step(0.0)
            self.processes.answer()
            self.node.advance(STEP_S)

    def markers(self) -> Dict[str, Marker]:
        """Return the last published markers."""
        return {it.ns: it for it in self.node.sent('~marker_array')[-1].markers}

    def words(self, device: str = 'r') -> str:
        """Return the text about a device; '' if there are no problems."""
        marker = self.markers().get(device)
        return '' if marker is None else str(marker.text)


@pytest.fixture
def watch() -> Watch:
    made = Watch()
    made.wait(6.0)  # no node is starting any more
    made.node.sent('~marker_array').clear()
    return made


def test_of_those_that_answer_nothing_is_said_but_something_is_published(watch: Watch) -> None:
    watch.wait(10.0)
    assert list(watch.markers()) == ['all is well']  # a display without messages shows a warning
    assert 10 <= len(watch.node.sent('~marker_array')) <= 13


@pytest.mark.parametrize('name, meaning', [
    (STATE_PUBLISHER, 'the robot does not move'), (PROCESSOR, 'no arrows or numbers')])
def test_one_that_hangs_is_named_until_it_goes_on(watch: Watch, name: str, meaning: str) -> None:
    watch.processes.hanging.add(name)
    watch.wait(NOTICED_S)
    assert watch.words() == f'r: {name.rpartition("/")[2]} is not responding; {meaning}'
    marker = watch.markers()['r']
    assert (marker.header.frame_id, marker.pose.position.z) == ('r/link0', 0.7)
    assert marker.lifetime.to_sec() > 0.0
    watch.processes.hanging.clear()
    watch.wait(2.0)
    assert watch.words() == ''


def test_one_that_is_killed_is_named_and_started_anew_it_is_well(watch: Watch) -> None:
    watch.processes.running.remove(PROCESSOR)
    watch.wait(NOTICED_S)
    assert watch.words() == 'r: robot_proc stopped; no arrows or numbers'
    watch.processes.running.add(PROCESSOR)
    watch.wait(2.0)
    assert watch.words() == ''


def test_several_are_named_and_drawn_before_rviz_removes_the_words(watch: Watch) -> None:
    watch.processes.running.difference_update((STATE_PUBLISHER, '/c/depth_proc'))
    watch.processes.hanging.add(PROCESSOR)
    watch.wait(NOTICED_S)
    assert watch.words().splitlines() == [
        'r: robot_state_publisher stopped; the robot does not move',
        'r: robot_proc is not responding; no arrows or numbers']
    assert watch.words('c') == 'c: depth_proc stopped; the points are out of date'
    watch.node.sent('~marker_array').clear()
    watch.wait(4.0)
    assert len(watch.node.sent('~marker_array')) >= 4.0 / 0.8 * 2


def test_publisher_of_a_shown_topic_that_takes_its_leave(watch: Watch) -> None:
    watch.processes.running.add('/other')
    watch.processes.publishers['/r/marker'] = ['/other']
    watch.wait(4.0)  # the watch asks the master every two seconds
    assert watch.words() == ''
    watch.processes.running.remove('/other')
    watch.processes.publishers.clear()
    watch.wait(NOTICED_S)
    assert watch.words() == 'r: other stopped; this picture is out of date'


@pytest.mark.parametrize('is_killed', [False, True])
def test_publisher_that_comes_back_with_another_name(watch: Watch, is_killed: bool) -> None:
    watch.processes.running.add('/other_1')
    watch.processes.publishers['/r/marker'] = ['/other_1']
    watch.wait(4.0)
    watch.processes.running.remove('/other_1')
    watch.processes.killed.update(['/other_1'] if is_killed else [])
    watch.processes.publishers['/r/marker'] = ['/other_1'] if is_killed else []
    watch.wait(4.0)
    assert watch.words() == 'r: other_1 stopped; this picture is out of date'
    watch.processes.running.add('/other_2')
    watch.processes.publishers['/r/marker'] = [*watch.processes.publishers['/r/marker'], '/other_2']
    watch.wait(6.0)
    assert watch.words() == ''
    watch.processes.running.remove('/other_2')
    watch.wait(4.0)
    assert watch.words() == 'r: other_2 stopped; this picture is out of date'


def test_publisher_that_ends_beside_another_one_is_not_replaced_by_it(watch: Watch) -> None:
    """The markers of the first one remain in the view."""
    watch.processes.running.update(('/first', '/second'))
    watch.processes.publishers['/r/marker'] = ['/first', '/second']
    watch.wait(6.0)
    watch.processes.running.remove('/first')
    watch.processes.publishers['/r/marker'] = ['/second']
    watch.wait(6.0)
    assert watch.words() == 'r: first stopped; this picture is out of date'


def test_cloud_that_comes_no_more(watch: Watch) -> None:
    for age_s, words in ((0.7, ''), (2.34, 'c: points 2.3 s old')):
        watch.node.send('/c/points_age', Float32(age_s))
        watch.wait(1.0 - STEP_S)
        assert watch.words('c') == words
    watch.wait(2.0)  # the depth processor, which publishes the age, is silent from now on
    assert watch.words('c') == ''


def test_a_cloud_that_stays_away_is_told_outside_of_the_scene_too(watch: Watch) -> None:
    def told(age_s: float) -> List[str]:
        for _ in range(10):
            watch.node.send('/c/points_age', Float32(age_s))
            watch.wait(0.2)
        return [it.message for sent in watch.node.sent('/diagnostics') for it in sent.status
                if it.values and it.values[0].key == 'messages'
                and {value.key: value.value for value in it.values}.get(STALE_POINTS_KEY) == 'c']

    assert told(1.5) == []
    assert set(told(2.5)) == {'no cloud is arriving; the points in the picture are out of date'}
    [first, *_] = [it for sent in watch.node.sent('/diagnostics') for it in sent.status]
    assert {it.key: it.value for it in first.values}['for_s'] == '2.5', 'since the last cloud'
    watch.wait(10.0)  # the depth processor is gone: still no cloud arrives
    count = len(told(0.1))
    assert len(told(0.1)) == count
    assert watch.node.sent('/diagnostics')[-1].status[0].message == 'all is well'


def test_a_master_that_does_not_answer_is_told_now_and_then(watch: Watch) -> None:
    watch.processes.is_master_there = False
    watch.wait(15.0)
    assert watch.node.log == 2 * [('warn', 'scene_watch: the master does not answer: no master')]
    assert watch.words() == ''
    assert watch.words('the cell') == (
        'the cell: the ROS master is not responding; robots may freeze')
    watch.processes.is_master_there = True
    watch.wait(3.0)
    assert watch.words('the cell') == ''


def test_one_that_had_ended_when_the_watch_was_started_anew_is_still_missed(watch: Watch) -> None:
    watch.processes.running.remove(PROCESSOR)
    watch.start()
    watch.wait(NOTICED_S)
    assert watch.words() == ''  # it may just as well be starting
    watch.wait(6.0)
    assert watch.words() == 'r: robot_proc stopped; no arrows or numbers'
    watch.processes.running.add(PROCESSOR)
    watch.wait(2.0)
    assert watch.words() == ''


def test_one_that_was_killed_before_the_watch_began_is_missed(watch: Watch) -> None:
    """The master knows it, but its address does not answer."""
    watch.processes.killed.add(NEVER)
    watch.wait(7.0)
    assert watch.words() == 'r: variable_proc stopped; never started'


def test_own_nodes_of_the_program_are_watched_too_and_it_is_told(watch: Watch) -> None:
    watch.processes.running.add('/cell_frames')
    watch.wait(7.0)
    watch.processes.hanging.update(('/cell_frames', PROCESSOR))
    watch.wait(2.0)
    assert watch.words('the cell') == (
        'the cell: cell_frames is not responding; no frame can be moved')
    told = {it.message: {value.key: value.value for value in it.values}
            for it in watch.node.sent('/diagnostics')[-1].status}
    assert told['cell_frames is not responding: no frame can be moved'][CONCERNED_KEY] == ''
    assert told['robot_proc is not responding: no arrows or numbers'][CONCERNED_KEY] == 'r'
    watch.processes.hanging.clear()
    watch.wait(2.0)
    assert {it.message for it in watch.node.sent('/diagnostics')[-1].status} == {'all is well'}


def test_after_it_was_held_up_itself_nobody_is_said_to_be_silent(watch: Watch) -> None:
    watch.processes.hanging.add(PROCESSOR)
    for _ in range(5):
        watch.node.advance(20.0)  # the process was suspended, or the master blocked it
        watch.wait(STEP_S)
        assert watch.words() == ''
    watch.wait(NOTICED_S)
    assert watch.words() == 'r: robot_proc is not responding; no arrows or numbers'


def test_what_a_silent_master_was_not_asked_is_unknown(watch: Watch) -> None:
    watch.processes.is_master_there = False
    watch.processes.running.remove(PROCESSOR)
    watch.wait(NOTICED_S)
    assert watch.words() == 'r: robot_proc stopped; no arrows or numbers'  # nobody listens
    watch.processes.running.add(PROCESSOR)  # at another, unknown address
    watch.wait(10.0)
    assert watch.words() == 'r: robot_proc stopped; no arrows or numbers'
    watch.processes.is_master_there = True
    watch.wait(4.0)
    assert watch.words() == ''


@pytest.mark.parametrize('seen', [5, 'r', {'r': 1}, [['a'], 5]])
def test_what_others_wrote_into_its_memory_does_not_end_it(seen: object) -> None:
    """It is restarted after it ends, and would end again."""
    watch = Watch()
    watch.processes.parameters['/scene_watch/seen'] = seen
    watch.start()
    assert not watch.words()
