# SPDX-License-Identifier: BSD-3-Clause
"""A node's connection to ROS and to the clocks, in one object that a test can replace."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, Optional

import rospy
from rospy.impl.paramserver import get_param_server_cache

from process_visualizer.clients.service_connection import ServiceConnection
from process_visualizer.nodes.common.process_end import at_shutdown
from process_visualizer.shown_text import shown


class Worker:
    """A thread that calls a function whenever it is woken, never twice at a time."""

    def __init__(self, step: Callable[[], Optional[float]], name: str) -> None:
        """Start it; ``step`` returns the time [s] after which it is called again unless woken.

        None: only when woken. ROS time does not matter.
        """
        self._step = step
        self._woken = threading.Event()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def wake(self) -> None:
        """Let the function be called soon, once however often it is woken until then."""
        self._woken.set()

    def _run(self) -> None:
        wait_s: Optional[float] = None
        while not rospy.is_shutdown():
            self._woken.wait(wait_s)
            self._woken.clear()
            wait_s = self._step()


class NodeHandle:
    """Everything that a node asks of rospy and of the clocks.

    Our nodes take a handle instead of calling rospy. A test hands in one whose clock it moves
    itself, so that a second of a node passes in no time and always in the same way.
    """

    @property
    def name(self) -> str:
        """The node's full name."""
        return str(rospy.get_name())

    def resolve(self, name: str) -> str:
        """Return the full name of a topic, service or parameter."""
        return str(rospy.resolve_name(name))

    def ros_s(self) -> float:
        """Return ROS time [s], which can stand still or jump under /use_sim_time."""
        return float(rospy.get_time())

    def now(self) -> rospy.Time:
        """Return ROS time as a stamp, to the nanosecond."""
        return rospy.Time.now()

    def is_wall_clock(self) -> bool:
        """Return whether ROS time is the time of day: nobody simulates it."""
        return bool(rospy.rostime.is_wallclock())

    def wall_s(self) -> float:
        """Return the time of day [s since 1970], which somebody may set."""
        return time.time()

    def monotonic_s(self) -> float:
        """Return a time [s] that only grows, evenly."""
        return time.monotonic()

    def is_shutdown(self) -> bool:
        """Return whether the node is ending."""
        return bool(rospy.is_shutdown())

    def at_shutdown(self, hook: Callable[[], None]) -> None:
        """Call a function once when the node ends."""
        at_shutdown(hook)

    def param(self, name: str, default: Any = None) -> Any:
        """Return a parameter of the parameter server, or the default."""
        return rospy.get_param(name, default)

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter of the parameter server.

        Raises:
            OSError, rospy.ROSException: the master does not answer.
        """
        rospy.set_param(name, value)

    def follow_param(self, name: str) -> Callable[[], Any]:
        """Return a function that returns a parameter's present value; None if it is not set.

        It costs no call of the master, which tells of each change. rospy.get_param_cached alone
        calls it again at every access to one that is not set. So it is called once, and its cache
        is read.
        """
        full_name = self.resolve(name)
        rospy.get_param_cached(full_name, None)

        def value() -> Any:
            try:
                return get_param_server_cache().get(full_name)
            except KeyError:
                return None

        return value

    def publisher(self, topic: str, message_class: type, queue_size: int = 10,
                  latch: bool = False, tcp_nodelay: bool = False) -> Any:
        """Advertise a topic; returns rospy's publisher."""
        return rospy.Publisher(topic, message_class, queue_size=queue_size, latch=latch,
                               tcp_nodelay=tcp_nodelay)

    def subscribe(self, topic: str, message_class: type, callback: Callable[[Any], None],
                  queue_size: Optional[int] = None, buff_size: int = 1 << 16) -> Any:
        """Subscribe without Nagle's delay; returns rospy's subscriber.

        ``callback`` is called in a thread of the connection. With rospy.AnyMsg as the class it
        gets the bytes, and the publisher's header in ``_connection_header``. They are read from
        the socket in pieces of at most ``buff_size`` bytes.
        """
        return rospy.Subscriber(topic, message_class, callback, queue_size=queue_size,
                                buff_size=buff_size, tcp_nodelay=True)

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any]) -> Any:
        """Offer a service; returns rospy's service."""
        return rospy.Service(name, service_class, handler)

    def connect(self, name: str, service_class: Any, timeout_s: float) -> ServiceConnection:
        """Return a connection to another node's service, which is opened by the first call."""
        return ServiceConnection(self.resolve(name), service_class, timeout_s)

    def every(self, period_s: float, callback: Callable[[], None]) -> Any:
        """Call a function each period of ROS time, in a thread; ``shutdown()`` ends it."""
        return rospy.Timer(rospy.Duration.from_sec(period_s), lambda _event: callback(),
                           reset=True)

    def every_real(self, period_s: float, callback: Callable[[], None]) -> None:
        """Call a function each period of real time, also while ROS time stands still."""
        pause = threading.Event()  # never set

        def run() -> None:
            while not rospy.is_shutdown():
                callback()
                pause.wait(period_s)

        threading.Thread(target=run, name=f'every {period_s:g} s', daemon=True).start()

    def worker(self, step: Callable[[], Optional[float]], name: str) -> Worker:
        """Start a thread for work that must not hold up the callbacks; see `Worker`."""
        return Worker(step, name)

    def thread(self, work: Callable[[], None], name: str) -> threading.Thread:
        """Start a thread that does some work and waits by `playback.clock`; returns it."""
        thread = threading.Thread(target=work, name=name, daemon=True)
        thread.start()
        return thread

    def warn(self, text: str) -> None:
        """Log a warning."""
        rospy.logwarn('%s', shown(text))

    def error(self, text: str) -> None:
        """Log an error."""
        rospy.logerr('%s', shown(text))
