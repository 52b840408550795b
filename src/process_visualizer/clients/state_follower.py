# SPDX-License-Identifier: BSD-3-Clause
"""Follows the state that a node publishes, and waits for a certain one."""
from __future__ import annotations

import threading
from typing import Any, Callable, Generic, Optional, Type, TypeVar

import rospy

State = TypeVar('State')


class StateFollower(Generic[State]):
    """Follows a topic in an initialised rospy node; ``on_state`` is called in rospy's thread."""

    def __init__(self, topic: str, message_class: Type[Any],
                 on_state: Optional[Callable[[State], None]] = None,
                 follow_now: bool = True) -> None:
        """Subscribe, or wait for ``begin``: it asks the master, and waits for the answer."""
        self._topic, self._message_class = topic, message_class
        self._on_state = on_state
        self._state: Optional[State] = None
        self._changed = threading.Condition()
        self._subscriber: Optional[rospy.Subscriber] = None
        if follow_now:
            self.begin()

    def begin(self) -> None:
        """Subscribe."""
        self._subscriber = rospy.Subscriber(self._topic, self._message_class, self._take)

    @property
    def state(self) -> Optional[State]:
        """The last state; None before the first one."""
        return self._state

    def close(self) -> None:
        """Unsubscribe."""
        if self._subscriber is not None:
            self._subscriber.unregister()

    def wait_for(self, condition: Callable[[State], bool],
                 timeout_s: Optional[float] = None) -> Optional[State]:
        """Wait for a state that fulfils a condition; return it, or None after the timeout."""
        with self._changed:
            fulfilled = self._changed.wait_for(
                lambda: self._state is not None and condition(self._state), timeout_s)
            return self._state if fulfilled else None

    def _take(self, state: State) -> None:
        with self._changed:
            self._state = state
            self._changed.notify_all()
        if self._on_state is not None:
            self._on_state(state)
