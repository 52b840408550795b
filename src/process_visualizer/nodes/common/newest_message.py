# SPDX-License-Identifier: BSD-3-Clause
"""The newest message of a topic of any type, decoded on demand, and how long it stays valid."""
from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional

import genpy
import roslib.message
import rospy

from process_visualizer.health.staleness import SendingHabit
from process_visualizer.nodes.common.node_handle import NodeHandle, PlaybackFollower


class RawMessage(NamedTuple):
    """A message as it arrived."""

    message_type: str  # package/Type
    md5sum: str  # of the publisher's definition
    content: bytes
    time_s: float


class NewestMessage:
    """Subscribes to a topic of any type and keeps its newest message.

    The message stays serialized until it is needed, so that even a fast topic costs little.
    """

    def __init__(self, node: NodeHandle, topic: str, playback: PlaybackFollower) -> None:
        """Subscribe; messages get their times from the clock of ``playback``.

        The sending habit of a played topic is that of its recording, whatever the playback rate.
        """
        self._node, self._playback, self._topic = node, playback, node.resolve(topic)
        self._raw: Optional[RawMessage] = None
        self._decoded_raw: Optional[RawMessage] = None
        self._message: Any = None
        self._classes: Dict[str, Optional[type]] = {}
        self._habit = SendingHabit()
        self._subscriber = node.subscribe(topic, rospy.AnyMsg, self._receive, queue_size=1)

    def _receive(self, message: Any) -> None:
        header, time_s = message._connection_header, self._playback.data_time_s()
        bag_time = self._playback.clock.present(self._node.ros_s())
        if bag_time is None:
            self._habit.add(time_s)
        else:
            self._habit.add(bag_time.time_s, bag_time.segment)
        self._raw = RawMessage(header['type'], header['md5sum'], message._buff, time_s)

    def holds_for_s(self, quick_s: float) -> float:
        """Return how long the last value stays valid [s]; see `SendingHabit`.

        If the topic has lost its publisher, this is ``quick_s``.
        """
        is_published = self._subscriber.get_num_connections() > 0
        return self._habit.holds_for_s(quick_s) if is_published else quick_s

    def newest(self) -> Optional[RawMessage]:
        """Return the newest message, still serialized.

        Return None before the first one, also after a jump to a position before it.
        """
        return self._raw if self._playback.has_begun(self._topic) else None

    def decode(self, raw: RawMessage) -> Any:
        """Return a decoded message of this topic; the last decoded message is cached.

        Raises:
            ValueError: the type is unknown, or the bytes are not of this type.
        """
        if raw is not self._decoded_raw:
            self._message = decode(raw, self._class(raw.message_type))
            self._decoded_raw = raw
        return self._message

    def _class(self, message_type: str) -> Optional[type]:
        if message_type not in self._classes:  # searching for a missing type is slow
            self._classes[message_type] = roslib.message.get_message_class(message_type)
        return self._classes[message_type]


def decode(raw: RawMessage, message_class: Optional[Any]) -> Any:
    """Return a message from its bytes.

    Raises:
        ValueError: there is no class for it, it is another version, or the bytes are wrong.
    """
    if message_class is None:
        raise ValueError(f'the message type {raw.message_type} is not known here; build its '
                         'package in this workspace')
    if raw.md5sum not in ('*', message_class._md5sum):
        raise ValueError(f'the publisher uses another version of {raw.message_type}; build both '
                         'with the same one')
    try:
        return message_class().deserialize(raw.content)
    except genpy.DeserializationError as error:
        raise ValueError(f'its bytes are not those of {raw.message_type}: {error}') from error
