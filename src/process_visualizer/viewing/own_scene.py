# SPDX-License-Identifier: BSD-3-Clause
"""The cell's messages, published on the viewer's own ROS master."""
from __future__ import annotations

import threading
import time
from typing import Callable, Dict, List, Optional, Set

import rospy
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.fetched_meshes import fetched_mesh
from process_visualizer.messages.message_definition import DefinitionError
from process_visualizer.messages.message_layout import MessageDamaged
from process_visualizer.messages.stamps import StampLocator
from process_visualizer.nodes.common.markers import text_marker
from process_visualizer.player.timed_sender import TimedSender
from process_visualizer.player.topic_publisher import TopicPublisher
from process_visualizer.remote.frames import Message
from process_visualizer.remote.offer import Topic
from process_visualizer.remote.shown_view import LINK_TOPIC
from process_visualizer.ros_names import TF_TOPIC
from process_visualizer.viewing.relay_connection import Source

_QUEUE = 20
_AMBER = (1.0, 0.7, 0.1, 1.0)
_HEIGHT_M = 0.08
_ABOVE_M = (0.0, 0.0, 1.5)


class OwnScene:
    """Publishes messages as bytes, after a look at them: RViz would take any length they claim."""

    def __init__(self, on_subscribe: Callable[[], None]) -> None:
        """``on_subscribe`` is called when somebody here begins to listen to a topic."""
        self._sender = TimedSender()
        self._on_subscribe = on_subscribe
        self._lock = threading.Lock()
        self._topics: Dict[str, _OwnTopic] = {}
        self._sources: Dict[Source, int] = {}
        self._problems: Dict[str, None] = {}
        self._link = rospy.Publisher(LINK_TOPIC, MarkerArray, queue_size=1, latch=True)

    def advertise(self, topics: Dict[str, Topic]) -> None:
        """Publish further topics."""
        for name, topic in topics.items():
            with self._lock:
                is_new = name not in self._topics and name != LINK_TOPIC
            if is_new:
                own = _own_topic(name, topic, self._sender, self._on_subscribe)
                with self._lock:
                    if own is None:
                        self._problems[f'{name} is not shown: its type cannot be understood'] = None
                    else:
                        self._topics[name] = own
        self._on_subscribe()

    def wanted(self) -> Set[str]:
        """Return the topics to which somebody here listens."""
        with self._lock:
            return {name for name, it in self._topics.items() if it.publisher.subscriber_count}

    def show(self, source: Source, message: Message) -> None:
        """Publish a message, if it is what its topic says."""
        with self._lock:
            own = self._topics.get(source.topic)
            number = self._sources.setdefault(source, len(self._sources))
        problem = 'it is not offered' if own is None else own.problem(source, message.data)
        if own is None or problem:
            with self._lock:
                self._problems[f'{source.topic}: a message is not shown: {problem}'] = None
            return
        own.publisher.publish(number, [message.data], time.monotonic_ns())

    def take_problems(self) -> List[str]:
        """Return in words what was not shown since the last call, each thing once."""
        with self._lock:
            found, self._problems = list(self._problems), {}
        return found

    def tell(self, text: str, frame: str) -> None:
        """Write a text into the scene; none takes it away."""
        marker = text_marker('link', frame, _ABOVE_M, text, _HEIGHT_M, _AMBER) if text else \
            Marker(action=Marker.DELETEALL)
        marker.header.frame_id = frame
        self._link.publish(MarkerArray([marker]))

    def close(self) -> None:
        """Publish nothing more."""
        self._sender.close()


class _OwnTopic:
    def __init__(self, connection: Connection, locator: StampLocator,
                 publisher: TopicPublisher) -> None:
        self._connection, self._locator = connection, locator
        self.publisher = publisher

    def problem(self, source: Source, data: bytes) -> str:
        """Return what is wrong with a message; empty if nothing is."""
        if source.md5sum != self._connection.md5sum:
            return f'{source.caller} sends another {source.type}'
        try:
            self._locator.check(data)
        except MessageDamaged as error:
            return str(error)
        mesh = fetched_mesh(self._connection, data)
        return '' if mesh is None else f'RViz would fetch {mesh}'


def _own_topic(name: str, topic: Topic, sender: TimedSender,
               on_subscribe: Callable[[], None]) -> Optional[_OwnTopic]:
    connection = Connection(name, topic.type, topic.md5sum, topic.definition, False, '')
    try:
        locator = StampLocator(topic.type, topic.definition)
        publisher = TopicPublisher(name, connection, name != TF_TOPIC, sender, _QUEUE, on_subscribe)
    except (DefinitionError, rospy.ROSException):
        return None
    return _OwnTopic(connection, locator, publisher)
