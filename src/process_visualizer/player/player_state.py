# SPDX-License-Identifier: BSD-3-Clause
"""Publishes the state of the player: at least ten times a second, and after each command."""
from __future__ import annotations

import threading
from typing import Callable

import rospy

from process_visualizer.msg import PlayerState
from process_visualizer.ros_names import PLAYBACK_RATE

PERIOD_S = 0.09


class StatePublisher:
    """A thread that publishes ~state, latched, and keeps the parameter of the rate up to date."""

    def __init__(self, state: Callable[[], PlayerState]) -> None:
        """``state`` returns the message; nothing is published before ``begin``."""
        self._state = state
        self._publisher = rospy.Publisher('~state', PlayerState, latch=True, queue_size=10,
                                          tcp_nodelay=True)
        self._changed = threading.Event()
        self._closed = False
        self._rate = 0.0  # as the parameter has it
        self._thread = threading.Thread(target=self._run, name='player state', daemon=True)

    def begin(self) -> None:
        """Begin to publish: who receives a state may send commands."""
        self._thread.start()

    def update(self) -> None:
        """Publish soon, as something has changed."""
        self._changed.set()

    def close(self) -> None:
        """Publish for the last time and end."""
        self._closed = True
        self._changed.set()
        if self._thread.is_alive():
            self._thread.join()
            self._follow_rate(1.0)  # what comes then is live, or another recording

    def _run(self) -> None:
        while not self._closed:
            self._changed.wait(PERIOD_S)
            self._changed.clear()
            state = self._state()
            self._follow_rate(state.rate)
            self._publish(state)

    def _publish(self, state: PlayerState) -> None:
        try:
            self._publisher.publish(state)
        except rospy.ROSException as error:  # the node is shutting down
            rospy.logdebug('the state is not published: %s', error)

    def _follow_rate(self, rate: float) -> None:
        """For nodes that read it; the position is only in ~state."""
        if rate == self._rate:
            return
        try:
            rospy.set_param(PLAYBACK_RATE, rate)
            self._rate = rate
        except (OSError, rospy.ROSException) as error:
            rospy.logwarn_throttle(10.0, f'{PLAYBACK_RATE} cannot be set: {error}')
