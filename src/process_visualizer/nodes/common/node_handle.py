# SPDX-License-Identifier: BSD-3-Clause
"""A node's connection to ROS and to the clocks, in one object that a test can replace."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, Optional

import rospy


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

    def wall_s(self) -> float:
        """Return the time of day [s since 1970], which somebody may set."""
        return time.time()

    def monotonic_s(self) -> float:
        """Return a time [s] that only grows, evenly."""
        return time.monotonic()

    def is_shutdown(self) -> bool:
        """Whether the node is ending."""
        return bool(rospy.is_shutdown())

    def param(self, name: str, default: Any = None) -> Any:
        """Return a parameter of the parameter server, or the default."""
        return rospy.get_param(name, default)

    def publisher(self, topic: str, message_class: type, queue_size: int = 10,
                  latch: bool = False) -> Any:
        """Advertise a topic; returns rospy's publisher."""
        return rospy.Publisher(topic, message_class, queue_size=queue_size, latch=latch)

    def subscribe(self, topic: str, message_class: type, callback: Callable[[Any], None],
                  queue_size: Optional[int] = None) -> Any:
        """Subscribe without Nagle's delay; returns rospy's subscriber.

        ``callback`` is called in a thread of the connection. With rospy.AnyMsg as the class it
        gets the bytes, and the publisher's header in ``_connection_header``.
        """
        return rospy.Subscriber(topic, message_class, callback, queue_size=queue_size,
                                tcp_nodelay=True)

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any]) -> Any:
        """Offer a service; returns rospy's service."""
        return rospy.Service(name, service_class, handler)

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

    def warn(self, text: str) -> None:
        """Log a warning."""
        rospy.logwarn('%s', text)

    def error(self, text: str) -> None:
        """Log an error."""
        rospy.logerr('%s', text)
