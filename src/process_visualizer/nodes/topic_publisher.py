"""Publishes recorded messages of one topic: bytes as they are, never waiting for a subscriber."""
from __future__ import annotations

import threading
import warnings
from typing import Any, Callable, Dict, List, Type

import rospy

from process_visualizer.bags.bag_records import Connection
from process_visualizer.bags.message_layout import Data
from process_visualizer.nodes.link_sender import LinkSender
from process_visualizer.nodes.subscriber_link import Packet, SubscriberLink

QUEUE_BYTES = 64 << 20


class TopicPublisher(rospy.SubscribeListener):
    """A topic with the type and definition that its connection in the bag has.

    rospy does everything but the sending: it would wait for the slowest subscriber, or let a
    thread for each subscriber drop messages without saying so.
    """

    def __init__(self, name: str, connection: Connection, latch: bool, sender: LinkSender,
                 queue_size: int, on_subscribe: Callable[[], None]) -> None:
        """Advertise a topic.

        Raises:
            rospy.ROSException: the master cannot be reached, or the name is not allowed.
        """
        self._sender = sender
        self._queue_size = queue_size
        self._latch = latch
        self._on_subscribe = on_subscribe
        self._lock = threading.Lock()  # messages come from one thread, subscribers from others
        self._links: Dict[int, SubscriberLink] = {}
        self._latched: Dict[int, Packet] = {}
        self._dropped_before = 0
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)  # no queue_size: there is a queue here
            self._publisher = rospy.Publisher(name, message_class(connection), self, latch=latch)
        self._update_links()

    @property
    def dropped(self) -> int:
        """How many messages slow subscribers did not get."""
        with self._lock:
            return self._dropped_before + sum(link.dropped for link in self._links.values())

    @property
    def subscriber_count(self) -> int:
        """How many subscribers are connected."""
        return len(self._links)

    def publish(self, connection: int, pieces: List[Data]) -> None:
        """Send a message of one of the topic's connections in the bag, given in pieces."""
        with self._lock:
            if self._latch:
                self._latched[connection] = Packet(pieces)
            if self._links:
                packet = Packet(pieces)
                for link in self._links.values():
                    link.send(packet.copy())

    def close(self) -> None:
        """Stop publishing."""
        self._publisher.unregister()

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
                self._dropped_before += self._links.pop(key).dropped
            new = connections.keys() - self._links.keys()
            for key in new:
                self._links[key] = self._new_link(connections[key])
        if new:
            self._on_subscribe()

    def _new_link(self, connection: Any) -> SubscriberLink:
        link = SubscriberLink(connection, self._queue_size, QUEUE_BYTES, self._sender.wake)
        for packet in self._latched.values():
            link.send(packet.copy())
        return link


def message_class(connection: Connection) -> Type[rospy.AnyMsg]:
    """Return a class by which rospy says to subscribers what the connection in the bag says.

    The definition is only passed on; nothing is made of it.
    """
    return type('RecordedMessage', (rospy.AnyMsg,), {
        '__slots__': (), '_type': connection.type, '_md5sum': connection.md5sum,
        '_full_text': connection.message_definition, '_has_header': False})
