# SPDX-License-Identifier: BSD-3-Clause
"""A node handle without ROS: the test moves its clock, sends messages, and reads its messages."""
from __future__ import annotations

import heapq
import itertools
from collections import defaultdict
from io import BytesIO
from typing import Any, Callable, DefaultDict, Dict, List, Optional, Tuple

import rospy

from process_visualizer.clients.service_connection import ServiceMissing
from process_visualizer.nodes.common.node_handle import checking_names, required_name


class SimulatedPublisher:
    """Keeps what a node publishes, as it arrives at a subscriber."""

    def __init__(self, message_class: Any, messages: List[Any]) -> None:
        self._message_class, self.messages, self.connections = message_class, messages, 1

    def publish(self, *content: Any) -> None:
        """Keep a message; the content is a message, or its fields."""
        message = rospy.msg.args_kwds_to_message(self._message_class, content, {})
        self.messages.append(self._message_class().deserialize(message_bytes(message)))

    def get_num_connections(self) -> int:
        """Return the number of subscribers that the test pretends."""
        return self.connections

    def unregister(self) -> None:
        """End it."""


class SimulatedSubscriber:
    """A subscription of the node; the test calls it with `SimulatedNode.send`."""

    def __init__(self, message_class: Any, callback: Callable[[Any], None]) -> None:
        self.message_class, self.callback, self.is_open = message_class, callback, True
        self.connections = 1

    def get_num_connections(self) -> int:
        """Return the number of publishers that the test pretends."""
        return self.connections

    def take(self, message: Any) -> None:
        """Receive a message, as bytes if the subscription accepts any type."""
        if not self.is_open:
            return
        is_raw, wants_raw = (it is rospy.AnyMsg for it in (type(message), self.message_class))
        if is_raw and not wants_raw:
            message = self.message_class().deserialize(message._buff)
        elif wants_raw and not is_raw:
            message = any_message(message)
        self.callback(message)

    def unregister(self) -> None:
        """End it."""
        self.is_open = False


class SimulatedWorker:
    """A worker of the node; called in the test's thread, after the callback that has woken it."""

    def __init__(self, step: Callable[[], Optional[float]],
                 call_in: Callable[[float, Callable[[], None]], None]) -> None:
        self._step, self._call_in, self._count = step, call_in, 0

    def wake(self) -> None:
        """Call the function soon."""
        self._call_after(0.0)

    def _call_after(self, wait_s: float) -> None:
        self._count += 1
        self._call_in(wait_s, lambda number=self._count: self._call(number))

    def _call(self, number: int) -> None:
        if number == self._count:  # not woken again since then
            wait_s = self._step()
            if wait_s is not None and number == self._count:
                self._call_after(wait_s)


class SimulatedService:
    """A connection of the node to a service of another node, which the test provides."""

    def __init__(self, service_class: Any, name: str, answers: Dict[str, Callable[[Any], Any]]
                 ) -> None:
        self._class, self._name, self._answers = service_class, name, answers

    def call(self, *request: Any) -> Any:
        """Return the answer."""
        if self._name not in self._answers:
            raise ServiceMissing(f'{self._name} does not answer: nobody offers it')
        return self._answers[self._name](self._class._request_class(*request))

    def close(self) -> None:
        """Close it."""


class SimulatedServer:
    """A service of the node."""

    def __init__(self, name: str, services: Dict[str, Callable[[Any], Any]]) -> None:
        self._name, self._services = name, services

    def shutdown(self) -> None:
        """End it."""
        self._services.pop(self._name, None)


class SimulatedTimer:
    """A timer of the node, called while the test lets time pass."""

    def __init__(self, period_s: float, callback: Callable[[], None],
                 call_in: Callable[[float, Callable[[], None]], None]) -> None:
        self._period_s, self._callback, self._call_in = period_s, callback, call_in
        self._is_on = True
        call_in(period_s, self._fire)

    def shutdown(self) -> None:
        """End it."""
        self._is_on = False

    def _fire(self) -> None:
        if self._is_on:
            self._call_in(self._period_s, self._fire)
            self._callback()


class SimulatedNode:
    """Replaces `NodeHandle`: one thread, one clock, no master.

    Names are resolved in the namespace of the node, as rospy does.
    """

    def __init__(self, name: str = '/r/node', params: Optional[Dict[str, Any]] = None,
                 now_s: float = 1000.0) -> None:
        """``params`` have full names; ``now_s`` is the initial time of all three clocks."""
        self.name, self.params, self.now_s = name, dict(params or {}), now_s
        self.ros_offset_s = self.wall_offset_s = 0.0
        self.log: List[Tuple[str, str]] = []
        self.hooks: List[Callable[[], None]] = []
        """Functions to be called when the node ends."""
        self.services: Dict[str, Callable[[Any], Any]] = {}
        self.publishers: Dict[str, SimulatedPublisher] = {}
        self.greetings: Dict[str, Callable[[], Any]] = {}
        self._messages: DefaultDict[str, List[Any]] = defaultdict(list)
        self._subscribers: DefaultDict[str, List[SimulatedSubscriber]] = defaultdict(list)
        self.offered: Dict[str, Callable[[Any], Any]] = {}
        """The services of other nodes, by full name: functions of the request."""
        self._latched: DefaultDict[str, List[Any]] = defaultdict(list)
        self._order = itertools.count()
        self._due: List[Tuple[float, int, Callable[[], None]]] = []

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

    def now(self) -> rospy.Time:
        """Return ROS time as a stamp."""
        return rospy.Time.from_sec(self.ros_s())

    def is_wall_clock(self) -> bool:
        """Return whether ROS time is the time of day."""
        return self.ros_offset_s == self.wall_offset_s

    def wall_s(self) -> float:
        """Return the time of day [s]."""
        return self.now_s + self.wall_offset_s

    def monotonic_s(self) -> float:
        """Return the monotonic time [s]."""
        return self.now_s

    def is_shutdown(self) -> bool:
        """Return whether the node is ending."""
        return False

    def param(self, name: str, default: Any = None) -> Any:
        """Return a parameter."""
        return self.params.get(self.resolve(required_name(name)), default)

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter."""
        self.params[self.resolve(name)] = value

    def at_shutdown(self, hook: Callable[[], None]) -> None:
        """Keep a function to be called at the end."""
        self.hooks.append(hook)

    def follow_param(self, name: str) -> Callable[[], Any]:
        """Follow a parameter."""
        return lambda: self.param(name)

    def publisher(self, topic: str, message_class: type, queue_size: int = 10,
                  latch: bool = False, tcp_nodelay: bool = False,
                  greeting: Optional[Callable[[], Any]] = None) -> SimulatedPublisher:
        """Advertise."""
        name = self.resolve(topic)
        if greeting is not None:
            self.greetings[name] = greeting
        return self.publishers.setdefault(
            name, SimulatedPublisher(message_class, self._messages[name]))

    def subscribe(self, topic: str, message_class: type, callback: Callable[[Any], None],
                  queue_size: Optional[int] = None, buff_size: int = 0) -> SimulatedSubscriber:
        """Subscribe; the last latched messages arrive at once."""
        subscriber = SimulatedSubscriber(message_class, callback)
        name = self.resolve(required_name(topic))
        self._subscribers[name].append(subscriber)
        for message in self._latched[name]:
            self.call_in(0.0, lambda it=message: subscriber.take(it))
        return subscriber

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any]
              ) -> SimulatedServer:
        """Offer a service."""
        self.services[self.resolve(name)] = checking_names(service_class, handler)
        return SimulatedServer(self.resolve(name), self.services)

    def connect(self, name: str, service_class: Any, timeout_s: float) -> SimulatedService:
        """Connect to a service that the test offers."""
        return SimulatedService(service_class, self.resolve(name), self.offered)

    def every(self, period_s: float, callback: Callable[[], None]) -> SimulatedTimer:
        """Start a timer."""
        return SimulatedTimer(period_s, callback, self.call_in)

    def every_real(self, period_s: float, callback: Callable[[], None]) -> None:
        """Start a timer of real time."""
        self.every(period_s, callback)

    def worker(self, step: Callable[[], Optional[float]], name: str) -> SimulatedWorker:
        """Call a function after the callbacks."""
        return SimulatedWorker(step, self.call_in)

    def info(self, text: str) -> None:
        """Keep an information message."""
        self.log.append(('info', text))

    def warn(self, text: str) -> None:
        """Keep a warning."""
        self.log.append(('warn', text))

    def error(self, text: str) -> None:
        """Keep an error."""
        self.log.append(('error', text))

    # What the test calls.

    def end_publishers(self, topic: str) -> None:
        """Let all publishers of a topic disappear."""
        for subscriber in self._subscribers[self.resolve(topic)]:
            subscriber.connections = 0

    def advance(self, duration_s: float) -> None:
        """Let time pass, and make all calls when they are due."""
        end_s = self.now_s + duration_s
        while self._due and self._due[0][0] <= end_s:
            due_s, _, callback = heapq.heappop(self._due)
            self.now_s = max(self.now_s, due_s)
            callback()
        self.now_s = end_s

    def call_in(self, wait_s: float, callback: Callable[[], None]) -> None:
        """Call a function after a time, as a timer of the node would."""
        heapq.heappush(self._due, (self.now_s + wait_s, next(self._order), callback))

    def send(self, topic: str, message: Any, latch: bool = False) -> None:
        """Send a message to the node, and let it handle its immediate effects.

        It may be a rospy.AnyMsg (see `any_message`). A latched one is also received by later
        subscribers.
        """
        name = self.resolve(topic)
        if latch:
            self._latched[name].append(message)
        for subscriber in list(self._subscribers[name]):
            subscriber.take(message)
        self.advance(0.0)

    def call(self, service: str, request: Any) -> Any:
        """Return the answer of a service of the node to a request, serialized as in a real call."""
        arrived = type(request)().deserialize(message_bytes(request))
        answer = self.services[self.resolve(service)](arrived)
        self.advance(0.0)
        return answer

    def listens(self, topic: str) -> bool:
        """Return whether the node has a subscription to a topic."""
        return any(it.is_open for it in self._subscribers[self.resolve(topic)])

    def sent(self, topic: str) -> List[Any]:
        """Return all messages that the node has published on a topic; the list may be cleared."""
        return self._messages[self.resolve(topic)]


def any_message(message: Any) -> rospy.AnyMsg:
    """Return a message as rospy hands it to a subscriber of any type."""
    found = rospy.AnyMsg()
    found._buff = message_bytes(message)
    found._connection_header = {'type': message._type, 'md5sum': message._md5sum,
                                'callerid': '/driver'}
    return found


def message_bytes(message: Any) -> bytes:
    """Return a message as it goes over the wire."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
