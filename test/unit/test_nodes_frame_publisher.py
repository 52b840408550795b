# SPDX-License-Identifier: BSD-3-Clause
"""The frame publisher: all frames in one message, and moving one of them at run time."""
from __future__ import annotations

import math
import socket
from contextlib import suppress
from typing import Any, List, Tuple

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from simulated_node import SimulatedNode

from process_visualizer.nodes.frame_publisher import FramePublisher
from process_visualizer.parameters.cell_parameters import read_frames
from process_visualizer.parameters.reading import ParameterError
from process_visualizer.robot.frames import FrameTree
from process_visualizer.ros_names import SILENT_NODE_KEY
from process_visualizer.srv import SetFrameRequest, SetFrameResponse

FRAMES = [{'parent': 'world', 'child': '/r/link0', 'xyz': [1, 2, 3], 'ypr': [math.pi / 2, 0, 0]},
          {'parent': 'r/tool', 'child': 'r/force', 'xyz': [0, 0, 0], 'ypr': [0, 0, 0]}]
ZERO = (0.0, 0.0, 0.0)


class Watch:
    """Master, and node scene_watch as far as it can be asked."""

    def __init__(self) -> None:
        self.is_there, self.answers = True, True
        self._questions: List[socket.socket] = []

    def getSystemState(self) -> List[Any]:
        raise AssertionError('nobody asks')

    def setParam(self, key: str, value: Any) -> None:
        raise AssertionError(f'nobody sets {key} to {value}')

    def lookupNode(self, node: str) -> str:
        if not self.is_there:
            raise ConnectionError('no master')
        assert node == '/scene_watch'
        return node

    def connect(self, _uri: str) -> socket.socket:
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        self._questions.append(theirs)
        return ours

    def answer(self) -> None:
        """Answer all requests, unless it hangs."""
        for question in self._questions if self.answers else ():
            with suppress(BrokenPipeError):
                question.recv(4096)
                question.sendall(b'HTTP/1.0 200 OK\r\n\r\n<methodResponse></methodResponse>')
            question.close()
        if self.answers:
            self._questions.clear()


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.fixture
def node(watch: Watch) -> SimulatedNode:
    found = SimulatedNode('/cell_frames')
    FramePublisher(found, FrameTree(read_frames(FRAMES)), watch, watch.connect)
    return found


def test_the_watch_is_watched(node: SimulatedNode, watch: Watch) -> None:
    def told(answers: bool) -> List[Any]:
        watch.answers = answers
        node.sent('/diagnostics').clear()
        for _ in range(20):
            node.advance(0.1)
            watch.answer()
        return [it for message in node.sent('/diagnostics') for it in message.status]

    assert told(True) + told(True) + told(True) == []  # it is no longer starting
    silent = told(False)[-1]
    assert (silent.level, silent.message) == (
        DiagnosticStatus.WARN,
        'scene_watch is not responding: nodes that hang are not reported')
    assert {it.key: it.value for it in silent.values}[SILENT_NODE_KEY] == '/scene_watch'
    assert told(True)[-1].level == DiagnosticStatus.OK
    watch.is_there = False
    assert told(True) == []


def numbers(transform: Any) -> List[float]:
    """Return x y z and the quaternion of a transform."""
    shift, turn = transform.transform.translation, transform.transform.rotation
    return [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w]


def set_frame(node: SimulatedNode, parent: str, child: str, xyz: Tuple[float, float, float],
              ypr: Tuple[float, float, float] = ZERO) -> SetFrameResponse:
    answer: SetFrameResponse = node.call('~set_frame', SetFrameRequest(parent, child, xyz, ypr))
    return answer


def test_all_frames_are_in_one_message(node: SimulatedNode) -> None:
    message, = node.sent('/tf_static')
    base, force = message.transforms
    assert (base.header.frame_id, base.child_frame_id) == ('world', 'r/link0')
    assert (force.header.frame_id, force.child_frame_id) == ('r/tool', 'r/force')
    assert base.header.stamp == node.now()
    assert numbers(base) == pytest.approx([1, 2, 3, 0, 0, 0.5 ** 0.5, 0.5 ** 0.5], abs=1e-12)


def test_a_frame_is_moved_and_all_are_published_again(node: SimulatedNode) -> None:
    answer = set_frame(node, '', '/r/force', (0.1, 0.2, 0.3), (0.0, math.pi, 0.0))
    assert (answer.success, answer.message) == (
        True, f'r/force is at [0.1, 0.2, 0.3] m, yaw pitch roll [0.0, {math.pi}, 0.0] rad in '
              'r/tool')
    _, message = node.sent('/tf_static')
    assert len(message.transforms) == 2
    assert numbers(message.transforms[1]) == pytest.approx([0.1, 0.2, 0.3, 0, 1, 0, 0], abs=1e-9)


def test_a_base_frame_does_not_come_below_its_own_robot(node: SimulatedNode) -> None:
    joint = '<joint><parent link="{}"/><child link="{}"/></joint>'.format
    model = f'<robot>{joint("r/link0", "r/link1")}{joint("r/link1", "r/tool")}</robot>'
    node.set_param('/', {'r': {'robot_description': model}, 's': {'robot_description': 'none'}})
    answer = set_frame(node, 'r/tool', 'r/link0', ZERO)
    assert not answer.success and 'own ancestor' in answer.message
    assert set_frame(node, 'r/link1', 'r/force', ZERO).success
    assert not set_frame(node, '', 'r/link0', (1e308, 0.0, 0.0)).success


def test_what_is_refused_says_why_and_moves_nothing(node: SimulatedNode) -> None:
    answer = set_frame(node, '', 'r/link1', ZERO)
    assert not answer.success and 'known are: r/force, r/link0' in answer.message
    assert len(node.sent('/tf_static')) == 1


@pytest.mark.parametrize('frames, problem', [
    (7, 'a list of frames is expected, not 7'),
    ([{'parent': 'a', 'child': 'b', 'xyz': [1, 2]}], r'\[0\]/xyz: a list of three'),
])
def test_wrong_frames_are_named(frames: Any, problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        read_frames(frames)
