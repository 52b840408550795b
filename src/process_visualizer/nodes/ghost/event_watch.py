# SPDX-License-Identifier: BSD-3-Clause
"""Tells when an event of the process comes."""
from __future__ import annotations

from typing import Any, Callable

import roslib.message
import rospy

from process_visualizer.motion.field_path import FieldPath
from process_visualizer.msg import GhostEvent
from process_visualizer.nodes.common.newest_message import RawMessage, decode
from process_visualizer.runs.event import Passages

_LOG_PERIOD_S = 10.0


class EventWatch:
    """Looks at each message of the event's topic."""

    def __init__(self, event: GhostEvent, on_event: Callable[[str], None]) -> None:
        """Begin to listen; ``on_event`` is called with the name, in a thread of the topic.

        Raises:
            ValueError: the field is no path.
        """
        self._event, self._on_event = event, on_event
        self._path = FieldPath(event.field)
        self._passages = Passages(event.threshold, event.is_above, event.hysteresis)
        self._subscriber = rospy.Subscriber(event.topic, rospy.AnyMsg, self._take, queue_size=100,
                                            tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        header = message._connection_header
        raw = RawMessage(header['type'], header['md5sum'], message._buff, 0.0)
        try:
            message_class = roslib.message.get_message_class(header['type'])
            number = self._path.number(decode(raw, message_class))
        except ValueError as error:
            rospy.logwarn_throttle_identical(_LOG_PERIOD_S, f'the event "{self._event.name}" is '
                                             f'not seen: {self._event.topic}: {error}')
            return
        if self._passages.take(number):
            self._on_event(self._event.name)

    def close(self) -> None:
        """Listen no longer."""
        self._subscriber.unregister()
