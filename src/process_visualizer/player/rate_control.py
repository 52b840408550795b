# SPDX-License-Identifier: BSD-3-Clause
"""Follows the topic of a node, so that playback can wait for that node."""
from __future__ import annotations

import re
import struct
from typing import Callable, Optional

import rospy

from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.timeline import NS_PER_S

_WARNING_PERIOD_S = 10.0
_STAMP = struct.Struct('<4xII')  # behind the sequence number
_BEGINS_WITH_HEADER = re.compile(r'(?:\s*(?:#[^\n]*)?\n)*\s*(?:std_msgs/|roslib/)?Header\s')


class RateControl:
    """The option --rate-control-topic of `rosbag play`: any type that begins with a header."""

    def __init__(self, topic: str, bag_ns_of: Callable[[int], Optional[int]],
                 heard: Callable[[int], None], node: NodeHandle) -> None:
        """Subscribe to the topic.

        Args:
            topic: its global name.
            bag_ns_of: maps a stamp [ns] to the bag time [ns], None where it cannot.
            heard: is called with that in rospy's thread.
            node: subscribes.
        """
        self._topic = topic
        self._bag_ns_of = bag_ns_of
        self._heard = heard
        self._node, self._warns_from_s = node, 0.0
        node.subscribe(topic, rospy.AnyMsg, self._receive, queue_size=10)

    def _receive(self, message: rospy.AnyMsg) -> None:
        if not begins_with_header(message._connection_header.get('message_definition', '')):
            self._warn()
            return
        seconds, nanoseconds = _STAMP.unpack_from(message._buff)
        bag_ns = self._bag_ns_of(seconds * NS_PER_S + nanoseconds)
        if bag_ns is not None:
            self._heard(bag_ns)

    def _warn(self) -> None:
        now_s = self._node.monotonic_s()
        if now_s >= self._warns_from_s:
            self._warns_from_s = now_s + _WARNING_PERIOD_S
            self._node.warn(f'{self._topic} cannot control the rate: its messages do not begin '
                            'with a header')


def begins_with_header(definition: str) -> bool:
    """Return whether the first field of a message definition is a header."""
    return _BEGINS_WITH_HEADER.match(definition) is not None
