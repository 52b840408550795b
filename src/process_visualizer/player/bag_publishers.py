# SPDX-License-Identifier: BSD-3-Clause
"""The publishers of all chosen topics of a recording."""
from __future__ import annotations

from typing import Callable, Dict, List, NamedTuple, Optional, Protocol, Sequence, Tuple

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_layout import Data
from process_visualizer.nodes.common.process_end import at_shutdown
from process_visualizer.playback.scene.scene import is_static
from process_visualizer.player.timed_sender import TimedSender
from process_visualizer.player.topic_publisher import TopicPublisher


class PublishedTopic(NamedTuple):
    """A published topic: its name, header of its first connection, all its connections.

    Static transforms are latched, as all later subscribers need them, even if a bag that was not
    written by a recorder does not say so.
    """

    name: str
    connection: Connection
    latch: bool
    numbers: Sequence[int]


class PlaybackListener(Protocol):
    """Is notified of events, in the threads in which they happen."""

    def on_jump(self, bag_ns: int) -> None:
        """Note a jump to a bag time [ns], before its scene is published."""

    def on_finish(self) -> bool:
        """Note that play has reached its end; return whether nothing follows."""

    def on_subscribe(self) -> None:
        """Note a new subscriber."""


class BagPublishers:
    """Publishers of a playback's messages; see process_visualizer.playback.playback_output."""

    def __init__(self, topics: Sequence[PublishedTopic], sources: Sequence[int], queue_size: int,
                 listener: PlaybackListener) -> None:
        """Advertise the topics; notify a listener of events.

        ``sources`` has for each connection the one whose messages its own replace.
        """
        self._sender = TimedSender()
        # Before rospy closes its connections: none must be mistaken for a broken one then.
        at_shutdown(self._sender.close)
        self._listener = listener
        self._topics = [TopicPublisher(topic.name, topic.connection, topic.latch, self._sender,
                                       queue_size, listener.on_subscribe) for topic in topics]
        self._by_number = {number: publisher for topic, publisher in zip(topics, self._topics)
                           for number in topic.numbers}
        self._sources = sources

    @property
    def dropped(self) -> int:
        """Return how many messages slow subscribers did not get."""
        return self._sender.dropped

    @property
    def published(self) -> Dict[str, int]:
        """Return how many messages of each topic have been sent, with or without subscribers."""
        return {topic.name: topic.published for topic in self._topics}

    @property
    def all_subscribed(self) -> bool:
        """Return whether every topic has a subscriber."""
        return all(topic.subscriber_count for topic in self._topics)

    def publish(self, connection: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of a connection, given in pieces, when a monotonic time [ns] has come."""
        self._by_number[connection].publish(self._sources[connection], pieces, due_ns)

    def withdraw(self, connection: int, due_ns: int) -> None:
        """Keep nothing for later subscribers of a connection's source, from a time on [ns]."""
        self._by_number[connection].withdraw(self._sources[connection], due_ns)

    def revoke(self, after_ns: int) -> int:
        """Withdraw unsent messages due after a monotonic time [ns]; return how many."""
        return self._sender.revoke(after_ns)

    def jump(self, bag_ns: int) -> None:
        """Announce a jump to a bag time [ns]; its scene follows."""
        self._listener.on_jump(bag_ns)

    def finish(self) -> bool:
        """Announce that play has reached its end; return whether nothing follows."""
        return self._listener.on_finish()

    def wait_until_sent(self, timeout_s: float) -> bool:
        """Wait until everything published has been sent; return False if it took too long."""
        return self._sender.wait_until_sent(timeout_s)

    def close(self) -> None:
        """Send nothing more; the connections end with the node.

        Subscribers by an older rospy connect again at once, of which rospy would warn in a node
        that continues without the topic.
        """
        self._sender.close()


def published_topics(connections: Sequence[Connection], name_of: Callable[[str], Optional[str]]
                     ) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics to publish, and as texts what cannot be: a topic has only one type.

    ``name_of`` gives the name under which a topic is published, None if it is not chosen.
    """
    topics: Dict[str, PublishedTopic] = {}
    problems = []
    for number, connection in enumerate(connections):
        name = name_of(connection.topic)
        if name is None:
            continue
        first = topics.setdefault(name, PublishedTopic(name, connection, False, ()))
        if (first.connection.type, first.connection.md5sum) == (connection.type,
                                                                connection.md5sum):
            latch = first.latch or connection.latching or is_static(connection)
            topics[name] = first._replace(latch=latch,
                                          numbers=(*first.numbers, number))
        else:
            problems.append(
                f'{connection.topic}: left out where it is {connection.type} '
                f'({connection.md5sum}), as it is {first.connection.type} '
                f'({first.connection.md5sum}) elsewhere in the recording')
    return list(topics.values()), problems
