# SPDX-License-Identifier: BSD-3-Clause
"""The publishers of a played recording: its chosen topics, and its time on /clock."""
from __future__ import annotations

import sys
import threading
import warnings
from typing import (
    Any,
    Callable,
    Collection,
    Dict,
    List,
    NamedTuple,
    Optional,
    Protocol,
    Sequence,
    Tuple,
    Type,
)

import rospy
from genpy import Time
from rosgraph_msgs.msg import Clock

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import Data
from process_visualizer.health.other_publishers import Others, other_publishers
from process_visualizer.launching.ros_api import (
    CONNECTION_ERRORS,
    MasterClient,
    connected_by_handshake,
    publisher_address,
)
from process_visualizer.nodes.common.node_handle import NodeHandle, at_shutdown
from process_visualizer.playback.scene import is_static
from process_visualizer.playback.scheduled_output import RestoredStamps
from process_visualizer.playback.timeline import NS_PER_S, Timeline, TimelineState
from process_visualizer.player.timed_sender import TimedSender

# Publishing of one topic's recorded messages: unchanged bytes, never waiting for a subscriber.

QUEUE_BYTES = 64 << 20
UNLIMITED = sys.maxsize


class TopicPublisher(rospy.SubscribeListener):
    """A topic with the type and definition of its connection in the bag.

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
        self._lock = threading.Lock()  # subscribers connect and disconnect in several threads
        self._links: Dict[int, int] = {}  # by the identity of rospy's connection
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)  # no queue_size: this class has a queue
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
        """Stop latching messages of a source, from a monotonic time [ns] on."""
        self._sender.withdraw(self._topic, source, due_ns)

    def close(self) -> None:
        """Stop advertising the topic, and disconnect its subscribers."""
        self._publisher.unregister()
        with self._lock:
            for link in self._links.values():
                self._sender.remove_link(link)
            self._links.clear()

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
            return  # a subscriber connected before the constructor was done, or after the end
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
    """Return a message class with which rospy announces the connection in the bag to subscribers.

    The definition is only passed on, not parsed.
    """
    return type('RecordedMessage', (rospy.AnyMsg,), {
        '__slots__': (), '_type': connection.type, '_md5sum': connection.md5sum,
        '_full_text': connection.message_definition, '_has_header': False})


class PublishedTopic(NamedTuple):
    """A published topic: its name, its first connection, the numbers of all its connections.

    Static transforms are latched, since later subscribers need them, even if the bag does not say
    so because no recorder wrote it.
    """

    name: str
    connection: Connection
    latch: bool
    numbers: Sequence[int]


class PlaybackListener(Protocol):
    """Listener for events, called in the threads in which they happen."""

    def on_jump(self, bag_ns: int) -> None:
        """Note a jump to a bag time [ns], before its scene is published."""

    def on_restored(self, stamps: RestoredStamps) -> None:
        """Note the messages just published that are stamped with the present time."""

    def on_finish(self) -> bool:
        """Note that play has reached its end; return whether nothing follows."""

    def on_subscribe(self) -> None:
        """Note a new subscriber."""


class BagPublishers:
    """Publishers of a playback's messages; see process_visualizer.playback.scheduled_output."""

    def __init__(self, topics: Sequence[PublishedTopic], sources: Sequence[int], queue_size: int,
                 listener: PlaybackListener) -> None:
        """Advertise the topics; notify a listener of events.

        ``sources`` has the source of each connection: see playback.scene.sources.
        """
        self._sender = TimedSender()
        # Runs before rospy closes its connections, so that none is mistaken for a broken one.
        at_shutdown(self._sender.close)
        self._listener = listener
        self._topics = [TopicPublisher(topic.name, topic.connection, topic.latch, self._sender,
                                       queue_size, listener.on_subscribe) for topic in topics]
        self._by_number = {number: publisher for topic, publisher in zip(topics, self._topics)
                           for number in topic.numbers}
        self._sources = sources

    @property
    def dropped(self) -> int:
        """Return how many messages slow subscribers did not receive."""
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
        """Send a message of a connection, given in pieces, at a monotonic time [ns]."""
        self._by_number[connection].publish(self._sources[connection], pieces, due_ns)

    def withdraw(self, connection: int, due_ns: int) -> None:
        """Stop latching messages of a connection's source, from a monotonic time [ns] on."""
        self._by_number[connection].withdraw(self._sources[connection], due_ns)

    def revoke(self, after_ns: int) -> int:
        """Withdraw unsent messages due after a monotonic time [ns]; return how many."""
        return self._sender.revoke(after_ns)

    def jump(self, bag_ns: int) -> None:
        """Announce a jump to a bag time [ns]; its scene follows."""
        self._listener.on_jump(bag_ns)

    def restored(self, stamps: RestoredStamps) -> None:
        """Announce the messages just published that are stamped with the present time."""
        self._listener.on_restored(stamps)

    def finish(self) -> bool:
        """Announce that play has reached its end; return whether nothing follows."""
        return self._listener.on_finish()

    def wait_until_sent(self, timeout_s: float) -> bool:
        """Wait until everything published has been sent; return False if it took too long."""
        return self._sender.wait_until_sent(timeout_s)

    def close(self) -> None:
        """Send nothing more; the connections end with the node.

        The topics stay advertised: subscribers with an older rospy would reconnect at once, and
        rospy would warn about that in a node that continues without the topics.
        """
        self._sender.close()


def published_topics(connections: Sequence[Connection], name_of: Callable[[str], Optional[str]]
                     ) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics to publish, and problems as texts: a topic can have only one type.

    ``name_of`` returns the name under which a topic is published, None if it is not chosen.
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


# Other nodes' publishers, and conflicts with topics of another type or definition.

_TIMEOUT_S = 2.0
_ANY = '*'


class OtherNodes:
    """The other nodes, as reported by the master and by the nodes themselves."""

    def publishing(self) -> Dict[str, List[str]]:
        """Return the nodes that publish each topic.

        Raises:
            rosgraph.MasterException, MasterUnreachable: the master does not answer.
        """
        publishers, _, _ = _master().getSystemState()
        return dict(publishers)

    def header(self, topic: str, node: str) -> Dict[str, str]:
        """Return the header that a publisher sends to a subscriber, empty if it does not answer."""
        try:
            address = publisher_address(_master(), node, topic, _TIMEOUT_S)
            connection, header = connected_by_handshake(address, {
                'topic': topic, 'type': _ANY, 'md5sum': _ANY, 'callerid': rospy.get_name(),
                'message_definition': ''}, _TIMEOUT_S)
            connection.close()
            return header
        except CONNECTION_ERRORS as error:
            rospy.logdebug('%s does not say what it publishes on %s: %s', node, topic, error)
            return {}  # the node has gone or uses another protocol: no reason not to play

    def beside(self, topics: Collection[str]) -> Others:
        """Return the other publishers of topics.

        Raises:
            rosgraph.MasterException, OSError: the master does not answer.
        """
        return other_publishers(topics, {rospy.get_name()})


def without_conflicts(topics: Sequence[PublishedTopic],
                      others: OtherNodes) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics that can be published beside other nodes, and problems with the others.

    This asks the publishers themselves, as the master keeps the types of nodes that have gone.

    Raises:
        rosgraph.MasterException, MasterUnreachable: the master does not answer.
    """
    nodes = others.publishing()
    kept, problems = [], []
    for topic in topics:
        problem = _conflict(topic, nodes.get(topic.name, []), others)
        if problem:
            problems.append(problem)
        else:
            kept.append(topic)
    return kept, problems


def _conflict(topic: PublishedTopic, nodes: Sequence[str], others: OtherNodes) -> str:
    ours = topic.connection
    advice = f'give it another name ({topic.name}:=/other) or a prefix (-p)'
    for node in nodes:
        header = others.header(topic.name, node)
        type_name, md5sum = header.get('type', ours.type), header.get('md5sum', ours.md5sum)
        if type_name != ours.type:
            return (f'{topic.name}: left out, as it is {ours.type} in the recording, but '
                    f'{type_name} where {node} publishes it; {advice}')
        if md5sum != ours.md5sum:
            return (f'{topic.name}: left out, as the definition of {ours.type} in the recording '
                    f'({ours.md5sum}) is not that of {node} ({md5sum}); {advice}')
    return ''


def _master() -> MasterClient:
    return MasterClient(rospy.get_name(), timeout_s=_TIMEOUT_S)


def next_tick_s(due_s: float, now_s: float, period_s: float) -> float:
    """Return when /clock is due next [s], after publishing now for a time that was due [s].

    The next time follows from the due time and not from now, so that a late wake-up adds no delay.
    Whole periods that have passed are skipped.
    """
    return due_s + period_s * max(1.0, (now_s - due_s) // period_s)


class SimulatedTime:
    """A clock that waits while the position slips back because the machine cannot keep up."""

    def __init__(self) -> None:
        self._scene = -1
        self._last_ns = 0

    def at(self, state: TimelineState, bag_ns: int) -> Tuple[int, bool]:
        """Return the bag time [ns] to publish at a position, and whether the time goes back."""
        last_ns = self._last_ns
        if state.scene == self._scene:
            bag_ns = max(bag_ns, last_ns) if state.forward else min(bag_ns, last_ns)
        self._scene, self._last_ns = state.scene, bag_ns
        return bag_ns, bag_ns < last_ns


SETTLING_S = 0.3


class SimulatedClock:
    """Publishes /clock in a separate thread, even under load; stops while paused.

    When time jumps back, RViz and tf2 discard their data, some time after they receive the jump;
    messages sent before that are lost. ``on_settled`` is called when that is over.
    """

    def __init__(self, timeline: Timeline, frequency_hz: float,
                 on_settled: Callable[[], None], node: NodeHandle) -> None:
        """Begin to publish the clock."""
        self._timeline = timeline
        self._period_s = 1.0 / frequency_hz
        self._on_settled = on_settled
        self._node = node
        self._publisher = node.publisher('/clock', Clock, queue_size=10, tcp_nodelay=True)
        self._lock = threading.Lock()  # later times must not be published earlier
        self._time = SimulatedTime()
        self._due_s = node.monotonic_s()
        self._settled_s = float('inf')
        self._closed = False
        node.worker(self._work, 'clock').wake()

    def jump(self, bag_ns: int) -> None:
        """Publish a bag time [ns] now, before its scene is published."""
        with self._lock:
            self._publish(self._timeline.state, bag_ns)

    def close(self) -> None:
        """Stop publishing."""
        with self._lock:
            self._closed = True

    def _work(self) -> Optional[float]:
        with self._lock:
            if self._closed:
                return None
            state, now_ns = self._timeline.now()
            self._publish(state, state.position_at(now_ns))
        now_s = self._node.monotonic_s()
        if now_s >= self._settled_s:
            self._settled_s = float('inf')
            self._on_settled()
        self._due_s = next_tick_s(self._due_s, now_s, self._period_s)
        return max(self._due_s - self._node.monotonic_s(), 0.0)

    def _publish(self, state: TimelineState, bag_ns: int) -> None:
        published_ns, goes_back = self._time.at(state, bag_ns)
        if goes_back:
            self._settled_s = self._node.monotonic_s() + SETTLING_S
        try:
            self._publisher.publish(Clock(Time(*divmod(published_ns, NS_PER_S))))
        except rospy.ROSException as error:  # the node is shutting down
            rospy.logdebug('the clock is not published: %s', error)
