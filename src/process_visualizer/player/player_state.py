# SPDX-License-Identifier: BSD-3-Clause
"""Publishes the state of the player: at least ten times a second, and after each command."""
from __future__ import annotations

import threading
from typing import Callable, Optional

import rospy

from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.ros_names import PLAYBACK_RATE

PERIOD_S = 0.09


class StatePublisher:
    """A thread that publishes ~state, latched, and keeps the parameter of the rate up to date."""

    def __init__(self, state: Callable[[], PlayerState], node: NodeHandle) -> None:
        """``state`` returns the message; nothing is published before ``begin``."""
        self._state, self._node = state, node
        self._publisher = node.publisher('~state', PlayerState, latch=True, queue_size=10,
                                         tcp_nodelay=True)
        self._publishing = threading.Lock()
        self._begun = self._closed = False
        self._rate = 0.0  # as the parameter has it
        self._worker = node.worker(self._work, 'player state')

    def begin(self) -> None:
        """Begin to publish: who receives a state may send commands."""
        self._begun = True
        self._worker.wake()

    def update(self) -> None:
        """Publish soon, as something has changed."""
        self._worker.wake()

    def close(self) -> None:
        """Publish for the last time and end."""
        with self._publishing:
            self._closed = True
            if self._begun:
                self._publish()
                self._follow_rate(1.0)  # what comes then is live, or another recording

    def _work(self) -> Optional[float]:
        with self._publishing:
            if not self._begun or self._closed:
                return None
            self._publish()
        return PERIOD_S

    def _publish(self) -> None:
        state = self._state()
        self._follow_rate(state.rate)
        try:
            self._publisher.publish(state)
        except rospy.ROSException as error:  # the node is shutting down
            rospy.logdebug('the state is not published: %s', error)

    def _follow_rate(self, rate: float) -> None:
        """Keep the parameter up to date for nodes that read it; the position is only in ~state."""
        if rate == self._rate:
            return
        try:
            self._node.set_param(PLAYBACK_RATE, rate)
            self._rate = rate
        except (OSError, rospy.ROSException) as error:
            rospy.logwarn_throttle(10.0, f'{PLAYBACK_RATE} cannot be set: {error}')
