# SPDX-License-Identifier: BSD-3-Clause
"""Publishes recorded messages of one topic: unchanged bytes, never waiting for a subscriber."""
from __future__ import annotations

import sys
import threading
import warnings
from typing import Any, Callable, Dict, List, Type

import rospy

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_layout import Data
from process_visualizer.player.timed_sender import TimedSender

QUEUE_BYTES = 64 << 20
UNLIMITED = sys.maxsize


class TopicPublisher(rospy.SubscribeListener):
    """A topic with the type and definition that its connection in the bag has.

    rospy does everything except sending: it would wait for the slowest subscriber, or drop
    messages silently, with a thread for each subscriber.
    """

    def __init__(self, name: str, connection: Connection, latch: bool, sender: TimedSender,
                 queue_size: int, on_subscribe: Callable[[], None]) -> None:
        """Advertise a topic; a queue of 0 messages has no limit.

        Raises:
            rospy.ROSException: the master cannot be reached, or the name is not allowed.
        """
        self.name = name
        self._sender = sender
        self._topic = sender.add_topic(latch, queue_size or UNLIMITED,
                                       QUEUE_BYTES if queue_size else UNLIMITED)
        self._on_subscribe = on_subscribe
        self._lock = threading.Lock()  # subscribers come and go in several threads
        self._links: Dict[int, int] = {}  # by the identity of rospy's connection
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)  # no queue_size: there is a queue here
            self._publisher = rospy.Publisher(name, message_class(connection), self, latch=latch)
        self._update_links()

    @property
    def subscriber_count(self) -> int:
        """Return how many subscribers are connected."""
        return len(self._links)

    @property
    def published(self) -> int:
        """Return how many messages have been sent, with or without subscribers."""
        return self._sender.sent(self._topic)

    def publish(self, source: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of one of the topic's sources in the bag, given in pieces."""
        self._sender.send(self._topic, source, pieces, due_ns)

    def withdraw(self, source: int, due_ns: int) -> None:
        """Stop latching messages of a source, from a time on [ns]."""
        self._sender.withdraw(self._topic, source, due_ns)

    def peer_subscribe(self, topic_name: str, topic_publish: Callable[..., Any],
                       peer_publish: Callable[..., Any]) -> None:
        """See rospy.SubscribeListener."""
        self._update_links()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """See rospy.SubscribeListener."""
        self._update_links()

    def _update_links(self) -> None:
        publisher = getattr(self, '_publisher', None)
        if publisher is None or publisher.impl is None:
            return  # a subscriber was there before the constructor was done, or after the end
        with self._lock:
            connections = {id(connection): connection for connection in publisher.impl.connections}
            for key in self._links.keys() - connections.keys():
                self._sender.remove_link(self._links.pop(key))
            new = connections.keys() - self._links.keys()
            for key in new:
                self._links[key] = self._sender.add_link(
                    self._topic, _descriptor(connections[key]), connections[key].close)
        if new:
            self._on_subscribe()


def _descriptor(connection: Any) -> int:
    socket = connection.socket
    return -1 if socket is None else int(socket.fileno())


def message_class(connection: Connection) -> Type[rospy.AnyMsg]:
    """Return a class with which rospy announces to subscribers the connection in the bag.

    The definition is only passed on, not parsed.
    """
    return type('RecordedMessage', (rospy.AnyMsg,), {
        '__slots__': (), '_type': connection.type, '_md5sum': connection.md5sum,
        '_full_text': connection.message_definition, '_has_header': False})
