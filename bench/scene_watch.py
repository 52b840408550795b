# SPDX-License-Identifier: BSD-3-Clause
"""Compares the messages of a subscriber of all topics of a generated bag with a scan of the bag."""
from __future__ import annotations

import struct
import threading
import time
from typing import List, Optional

import numpy as np
import rospy
from bag_maker import BEGIN_NS, MadeBag
from message_index import indexes
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.msg import PlayerState

_STATE = '/bag_player/state'
_FRONT_BYTES = 64
_NOTHING = -1


class SceneWatch:
    """Follows the topics of a bag and the player's state."""

    def __init__(self, bag: MadeBag) -> None:
        """Subscribe."""
        self._bag = bag
        self._changed = threading.Condition()
        self._seen = [_NOTHING] * len(bag.topics)
        self._since_s = [0.0] * len(bag.topics)  # monotonic
        self._came_s = 0.0  # arrival of the last message, monotonic
        self._state: Optional[PlayerState] = None
        for number, topic in enumerate(bag.topics):
            rospy.Subscriber(topic.name, rospy.AnyMsg, self._receive, number, tcp_nodelay=True)
        rospy.Subscriber(_STATE, PlayerState, self._follow, tcp_nodelay=True)

    def state_since(self, stamp: rospy.Time, timeout_s: float) -> PlayerState:
        """Wait for a state of a wall time or later.

        Raises:
            RuntimeError: there was none.
        """
        def is_later() -> bool:
            return self._state is not None and self._state.stamp >= stamp

        with self._changed:
            if not self._changed.wait_for(is_later, timeout_s):
                raise RuntimeError('the player tells no state any more')
            assert self._state is not None
            return self._state

    def scene_since(self, position_s: float, timeout_s: float) -> Optional[float]:
        """Wait for the scene at a position; return the time when it was complete [s, monotonic]."""
        expected = self.scanned(position_s)
        with self._changed:
            if not self._changed.wait_for(lambda: self._seen == expected, timeout_s):
                return None
            return max(self._since_s)

    def differences(self, position_s: float, quiet_s: float, timeout_s: float) -> List[str]:
        """Return the differences from the scene at a position, once no more messages arrive.

        A scene that differs may still be on its way to a slow subscriber: it gets some time.
        """
        expected, until_s = self.scanned(position_s), time.monotonic() + timeout_s
        with self._changed:
            while True:
                rest_s = self._came_s + quiet_s - time.monotonic()
                if rest_s > 0.0:
                    self._changed.wait(rest_s)
                elif self._seen == expected or not self._changed.wait_for(
                        lambda: self._seen == expected, until_s - time.monotonic()):
                    break
            seen = list(self._seen)
        return [f'{topic.name}: {index} instead of {wanted}' for topic, index, wanted
                in zip(self._bag.topics, seen, self.scanned(position_s)) if index != wanted]

    def scanned(self, position_s: float) -> List[int]:
        """Return each topic's last message up to a position; before all of them, the first one."""
        position_ns = BEGIN_NS + round(position_s * 1e9)
        return [max(int(np.searchsorted(self._bag.times_ns(number), position_ns, 'right')) - 1, 0)
                for number in range(len(self._bag.topics))]

    def _receive(self, message: rospy.AnyMsg, number: int) -> None:
        topic, data = self._bag.topics[number], message._buff
        front = np.frombuffer(data[:_FRONT_BYTES].ljust(_FRONT_BYTES, b'\0'), np.uint8)
        removed = topic.message_class is MarkerArray and _removes(data)
        index = _NOTHING if removed else int(indexes(topic.message_class._type, front[None])[0])
        with self._changed:
            self._came_s = time.monotonic()
            if index != self._seen[number]:
                self._seen[number], self._since_s[number] = index, self._came_s
            self._changed.notify_all()

    def _follow(self, state: PlayerState) -> None:
        with self._changed:
            self._state = state
            self._changed.notify_all()


def _removes(data: bytes) -> bool:
    """Return whether the first marker of an array removes all."""
    frame = _text_end(data, 16)
    action, = struct.unpack_from('<i', data, _text_end(data, frame) + 8)
    return bool(action == Marker.DELETEALL)


def _text_end(data: bytes, begin: int) -> int:
    length, = struct.unpack_from('<I', data, begin)
    return begin + 4 + int(length)
