# SPDX-License-Identifier: BSD-3-Clause
"""Bags, players and listeners for the tests of the player."""
from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from types import TracebackType
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Type

import rospy
from roslib.packages import find_node

from process_visualizer.msg import PlayerState

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from recorded_rows import (  # noqa: E402, F401, for those who import this module
    BEGIN_S,
    Row,
    cell_rows,
    serialized,
    stamp,
    transform,
    write_bag,
)

PLAYER = '/bag_player'
PROGRAM = find_node('process_visualizer', 'bag_player')[0]  # rosrun needs a second to find it


class Received(NamedTuple):
    """A received message: time [s], topic, bytes, connection header."""

    time_s: float
    topic: str
    data: bytes
    header: Dict[str, str]


class Listener:
    """All messages of some topics, in the order of arrival."""

    def __init__(self, *topics: str) -> None:
        self.received: List[Received] = []
        self._changed = threading.Condition()
        self._subscribers = [rospy.Subscriber(topic, rospy.AnyMsg, self._receive, topic,
                                              tcp_nodelay=True) for topic in topics]

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()

    def of(self, topic: str) -> List[bytes]:
        """Return the messages of a topic."""
        with self._changed:
            return [it.data for it in self.received if it.topic == topic]

    def clear(self) -> None:
        """Discard the received messages."""
        with self._changed:
            del self.received[:]

    def wait_for(self, condition: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
        """Wait until the received messages fulfill a condition."""
        with self._changed:
            assert self._changed.wait_for(condition, timeout_s), \
                f'{what}: did not come; received: {[it.topic for it in self.received][-20:]}'

    def _receive(self, message: rospy.AnyMsg, topic: str) -> None:
        with self._changed:
            self.received.append(Received(rospy.get_time(), topic, message._buff,
                                          message._connection_header))
            self._changed.notify_all()


class Player:
    """A running bag_player; use it in a ``with``, which ends it."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [PROGRAM, *arguments], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.states: List[PlayerState] = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(f'{PLAYER}/state', PlayerState, self._receive)

    def __enter__(self) -> Player:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        self._subscriber.unregister()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=60)

    def wait(self, timeout_s: float = 120.0) -> Tuple[int, str]:
        """Wait for the end; return exit code and output."""
        output, _ = self.process.communicate(timeout=timeout_s)
        return self.process.returncode, output

    def call(self, name: str, service: Type[Any], *arguments: Any) -> Any:
        """Call one of its services."""
        rospy.wait_for_service(f'{PLAYER}/{name}', 60.0)
        return rospy.ServiceProxy(f'{PLAYER}/{name}', service)(*arguments)

    def wait_for_state(self, condition: Callable[[PlayerState], bool], what: str) -> PlayerState:
        """Wait for a later state that fulfills a condition."""
        with self._changed:
            del self.states[:-1]
            assert self._changed.wait_for(
                lambda: any(map(condition, self.states)), 60.0), f'{what}: {self.states[-1:]}'
            return next(filter(condition, self.states))

    def _receive(self, state: PlayerState) -> None:
        with self._changed:
            self.states.append(state)
            self._changed.notify_all()


def temporary_folder() -> 'tempfile.TemporaryDirectory[str]':
    """A folder for bags."""
    return tempfile.TemporaryDirectory(prefix='bag_player_test_')
