# SPDX-License-Identifier: BSD-3-Clause
"""The topics of a cell that viewers want: subscribed once, for as long as one of them does."""
from __future__ import annotations

import threading
import time
from typing import Any, Collection, Dict, List, NamedTuple, Protocol, Set

import rospy

_BUFFER_BYTES = 16 << 20


class Channel(NamedTuple):
    """One publisher of a topic, by its number."""

    number: int
    topic: str
    type: str
    md5sum: str
    caller: str


class Taker(Protocol):
    """Takes messages of topics; called in threads of rospy, must not wait."""

    def take(self, channel: Channel, arrived_ns: int, data: bytes, is_kept: bool) -> None:
        """Take a message; one that ``is_kept`` is latched, and has to arrive."""


class _Latched(NamedTuple):
    channel: Channel
    arrived_ns: int
    data: bytes


class TopicFeed:
    """Subscribes to topics of any type, and passes their messages on as bytes."""

    def __init__(self) -> None:
        """Nothing is subscribed."""
        self._lock = threading.Lock()
        self._wanted: Dict[str, List[Taker]] = {}
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._channels: Dict[Any, Channel] = {}
        self._latched: Dict[int, _Latched] = {}

    def want(self, taker: Taker, topics: Collection[str]) -> None:
        """Pass on the messages of these topics to a taker, and no others."""
        with self._lock:
            new = [topic for topic in topics if taker not in self._wanted.get(topic, [])]
            for topic in list(self._wanted):
                if topic not in topics:
                    self._wanted[topic] = [it for it in self._wanted[topic] if it is not taker]
            for topic in new:
                self._wanted.setdefault(topic, []).append(taker)
            kept = [it for it in self._latched.values() if it.channel.topic in new]
            left = self._update()
        for it in kept:
            taker.take(it.channel, it.arrived_ns, it.data, True)
        for subscriber in left:
            subscriber.unregister()

    def _update(self) -> List[rospy.Subscriber]:
        """Subscribe to what is new; return what nobody wants any more."""
        needed: Set[str] = {topic for topic, takers in self._wanted.items() if takers}
        left = [self._subscribers.pop(it) for it in set(self._subscribers) - needed]
        for topic in set(self._wanted) - needed:
            del self._wanted[topic]
            for number in [key for key, it in self._latched.items() if it.channel.topic == topic]:
                del self._latched[number]
        for topic in needed - set(self._subscribers):
            self._subscribers[topic] = rospy.Subscriber(
                topic, rospy.AnyMsg, self._take, topic, buff_size=_BUFFER_BYTES, tcp_nodelay=True)
        return left

    def _take(self, message: Any, topic: str) -> None:
        arrived_ns = time.time_ns()
        header: Dict[str, str] = message._connection_header
        with self._lock:
            channel = self._channel(topic, header)
            is_kept = header.get('latching') == '1'
            data = bytes(message._buff)
            if is_kept and topic in self._wanted:
                self._latched[channel.number] = _Latched(channel, arrived_ns, data)
            takers = list(self._wanted.get(topic, []))
        for taker in takers:
            taker.take(channel, arrived_ns, data, is_kept)

    def _channel(self, topic: str, header: Dict[str, str]) -> Channel:
        kind, md5sum = header.get('type', ''), header.get('md5sum', '')
        key = topic, kind, md5sum, header.get('callerid', '')
        if key not in self._channels:
            self._channels[key] = Channel(len(self._channels) + 1, *key)
        return self._channels[key]
