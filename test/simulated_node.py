# SPDX-License-Identifier: BSD-3-Clause
"""A node handle without ROS: the test moves its clock, sends messages, and sees what is sent."""
from __future__ import annotations

import heapq
import itertools
from collections import defaultdict
from io import BytesIO
from typing import Any, Callable, DefaultDict, Dict, List, Optional, Tuple

import rospy


class SimulatedPublisher:
    """Keeps what a node publishes."""

    def __init__(self, messages: List[Any]) -> None:
        self.messages, self.connections = messages, 1

    def publish(self, *content: Any) -> None:
        """Keep a message."""
        self.messages.append(content[0])

    def get_num_connections(self) -> int:
        """Return how many subscribers the test pretends."""
        return self.connections

    def unregister(self) -> None:
        """End it."""


class SimulatedSubscriber:
    """A subscription of the node; the test calls it by `SimulatedNode.send`."""

    def __init__(self, message_class: type, callback: Callable[[Any], None]) -> None:
        self.message_class, self.callback, self.is_open = message_class, callback, True

    def unregister(self) -> None:
        """End it."""
        self.is_open = False


class SimulatedTimer:
    """A timer of the node, called while the test lets time pass."""

    def __init__(self, period_s: float, callback: Callable[[], None]) -> None:
        self.period_s, self.callback, self.is_on = period_s, callback, True

    def shutdown(self) -> None:
        """End it."""
        self.is_on = False


class SimulatedNode:
    """Takes the place of `NodeHandle`: one thread, one clock, no master.

    Names are resolved in the namespace of the node, as rospy does.
    """

    def __init__(self, name: str = '/r/node', params: Optional[Dict[str, Any]] = None,
                 now_s: float = 1000.0) -> None:
        """``params`` have full names; ``now_s`` is the time of all three clocks at first."""
        self.name, self.params, self.now_s = name, dict(params or {}), now_s
        self.ros_offset_s = self.wall_offset_s = 0.0
        self.log: List[Tuple[str, str]] = []
        self.services: Dict[str, Callable[[Any], Any]] = {}
        self.publishers: Dict[str, SimulatedPublisher] = {}
        self._messages: DefaultDict[str, List[Any]] = defaultdict(list)
        self._subscribers: DefaultDict[str, List[SimulatedSubscriber]] = defaultdict(list)
        self._order = itertools.count()
        self._due: List[Tuple[float, int, SimulatedTimer]] = []

    # What the node calls.

    def resolve(self, name: str) -> str:
        """Return a full name."""
        if name.startswith('/'):
            return name
        if name.startswith('~'):
            return f'{self.name}/{name[1:]}'
        return f'{self.name.rpartition("/")[0]}/{name}'

    def ros_s(self) -> float:
        """Return ROS time [s]."""
        return self.now_s + self.ros_offset_s

    def wall_s(self) -> float:
        """Return the time of day [s]."""
        return self.now_s + self.wall_offset_s

    def monotonic_s(self) -> float:
        """Return the time [s] that only grows."""
        return self.now_s

    def is_shutdown(self) -> bool:
        """Whether the node is ending."""
        return False

    def param(self, name: str, default: Any = None) -> Any:
        """Return a parameter."""
        return self.params.get(self.resolve(name), default)

    def publisher(self, topic: str, _message_class: type, queue_size: int = 10,
                  latch: bool = False) -> SimulatedPublisher:
        """Advertise."""
        name = self.resolve(topic)
        return self.publishers.setdefault(name, SimulatedPublisher(self._messages[name]))

    def subscribe(self, topic: str, message_class: type, callback: Callable[[Any], None],
                  queue_size: Optional[int] = None) -> SimulatedSubscriber:
        """Subscribe."""
        subscriber = SimulatedSubscriber(message_class, callback)
        self._subscribers[self.resolve(topic)].append(subscriber)
        return subscriber

    def serve(self, name: str, _service_class: Any, handler: Callable[[Any], Any]) -> None:
        """Offer a service."""
        self.services[self.resolve(name)] = handler

    def every(self, period_s: float, callback: Callable[[], None]) -> SimulatedTimer:
        """Start a timer."""
        timer = SimulatedTimer(period_s, callback)
        heapq.heappush(self._due, (self.now_s + period_s, next(self._order), timer))
        return timer

    def every_real(self, period_s: float, callback: Callable[[], None]) -> None:
        """Start a timer of real time."""
        self.every(period_s, callback)

    def warn(self, text: str) -> None:
        """Keep a warning."""
        self.log.append(('warn', text))

    def error(self, text: str) -> None:
        """Keep an error."""
        self.log.append(('error', text))

    # What the test calls.

    def advance(self, duration_s: float) -> None:
        """Let time pass, and call the timers that are due, each at its time."""
        end_s = self.now_s + duration_s
        while self._due and self._due[0][0] <= end_s:
            due_s, _, timer = heapq.heappop(self._due)
            self.now_s = max(self.now_s, due_s)
            if timer.is_on:
                timer.callback()
                heapq.heappush(self._due, (due_s + timer.period_s, next(self._order), timer))
        self.now_s = end_s

    def send(self, topic: str, message: Any) -> None:
        """Send a message to the node; to subscribers of any type as bytes."""
        for subscriber in list(self._subscribers[self.resolve(topic)]):
            if subscriber.is_open:
                subscriber.callback(any_message(message)
                                    if subscriber.message_class is rospy.AnyMsg else message)

    def sent(self, topic: str) -> List[Any]:
        """Return all messages that the node has published on a topic; the list may be cleared."""
        return self._messages[self.resolve(topic)]


def any_message(message: Any) -> rospy.AnyMsg:
    """Return a message as rospy hands it to a subscriber of any type."""
    buffer = BytesIO()
    message.serialize(buffer)
    found = rospy.AnyMsg()
    found._buff = buffer.getvalue()
    found._connection_header = {'type': message._type, 'md5sum': message._md5sum,
                                'callerid': '/driver'}
    return found
