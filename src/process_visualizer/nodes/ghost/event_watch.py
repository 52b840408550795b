# SPDX-License-Identifier: BSD-3-Clause
"""Tells when an event of the process comes."""
from __future__ import annotations

from typing import Any, Callable

import roslib.message
import rospy

from process_visualizer.motion.field_path import FieldPath
from process_visualizer.msg import GhostEvent
from process_visualizer.nodes.common.markers import Pace
from process_visualizer.nodes.common.newest_message import RawMessage, decode
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.runs.event import Passages

_LOG_PERIOD_S = 10.0


class EventWatch:
    """Looks at each message of the event's topic."""

    def __init__(self, node: NodeHandle, event: GhostEvent, on_event: Callable[[str], None]
                 ) -> None:
        """Begin to listen; ``on_event`` is called with the name, in a thread of the topic.

        Raises:
            ValueError: the field is no path.
        """
        self._node, self._event, self._on_event = node, event, on_event
        self._path = FieldPath(event.field)
        self._passages = Passages(event.threshold, event.is_above, event.hysteresis)
        self._log = Pace(_LOG_PERIOD_S)
        self._subscriber = node.subscribe(event.topic, rospy.AnyMsg, self._take, queue_size=100)

    def _take(self, message: Any) -> None:
        header = message._connection_header
        raw = RawMessage(header['type'], header['md5sum'], message._buff, 0.0)
        try:
            message_class = roslib.message.get_message_class(header['type'])
            number = self._path.number(decode(raw, message_class))
        except ValueError as error:
            if self._log.is_due(self._node.monotonic_s()):
                self._node.warn(f'the event "{self._event.name}" is not seen: '
                                f'{self._event.topic}: {error}')
            return
        if self._passages.take(number):
            self._on_event(self._event.name)

    def close(self) -> None:
        """Listen no longer."""
        self._subscriber.unregister()
