# SPDX-License-Identifier: BSD-3-Clause
"""Publishes the time of the recording on /clock, for nodes with use_sim_time."""
from __future__ import annotations

import threading
import time
from typing import Callable

import rospy
from genpy import Time
from rosgraph_msgs.msg import Clock

from process_visualizer.playback.simulated_time import SimulatedTime, next_tick_s
from process_visualizer.playback.timeline import NS_PER_S, Basis, Timeline

SETTLING_S = 0.3


class SimulatedClock:
    """A separate thread, so that the clock runs under load, and stands still when paused.

    When time jumps back, RViz and tf2 discard their data, some time after they receive the jump;
    messages sent before that are lost. ``on_settled`` is called when that is over.
    """

    def __init__(self, timeline: Timeline, frequency_hz: float,
                 on_settled: Callable[[], None]) -> None:
        """Begin to publish."""
        self._timeline = timeline
        self._period_s = 1.0 / frequency_hz
        self._on_settled = on_settled
        self._publisher = rospy.Publisher('/clock', Clock, queue_size=10, tcp_nodelay=True)
        self._lock = threading.Lock()  # later times must not be published earlier
        self._time = SimulatedTime()
        self._settled_s = float('inf')
        self._changed = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name='clock', daemon=True)
        self._thread.start()

    def jump(self, bag_ns: int) -> None:
        """Publish a bag time [ns] now, before its scene is published."""
        with self._lock:
            self._publish(self._timeline.basis, bag_ns)

    def close(self) -> None:
        """End the thread."""
        self._closed = True
        self._changed.set()
        self._thread.join()

    def _run(self) -> None:
        due_s = time.monotonic()
        while not self._changed.wait(max(due_s - time.monotonic(), 0.0)) and not self._closed:
            with self._lock:
                basis, now_ns = self._timeline.now()
                self._publish(basis, basis.position_at(now_ns))
            now_s = time.monotonic()
            if now_s >= self._settled_s:
                self._settled_s = float('inf')
                self._on_settled()
            due_s = next_tick_s(due_s, now_s, self._period_s)

    def _publish(self, basis: Basis, bag_ns: int) -> None:
        told_ns, goes_back = self._time.at(basis, bag_ns)
        if goes_back:
            self._settled_s = time.monotonic() + SETTLING_S
        try:
            self._publisher.publish(Clock(Time(*divmod(told_ns, NS_PER_S))))
        except rospy.ROSException as error:  # the node is shutting down
            rospy.logdebug('the clock is not published: %s', error)
