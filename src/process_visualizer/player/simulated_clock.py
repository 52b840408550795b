# SPDX-License-Identifier: BSD-3-Clause
"""The time of the recording on /clock, for nodes with use_sim_time."""
from __future__ import annotations

import threading
from typing import Callable, Optional, Tuple

import rospy
from genpy import Time
from rosgraph_msgs.msg import Clock

from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.timeline import NS_PER_S, Timeline, TimelineState


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
    """Publisher of /clock in a separate thread, which runs under load, and stops while paused.

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
