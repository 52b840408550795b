# SPDX-License-Identifier: BSD-3-Clause
"""Reads a quantity from a topic with any supported message type."""
from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Generic, Mapping, Optional, Sequence, TypeVar

import genpy
import rospy

from process_visualizer.motion.source_conflict import SourceConflict
from process_visualizer.motion.time_watch import TimeWatch
from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.ros_names import CONFLICT_KEY

Quantity = TypeVar('Quantity')
Decoder = Callable[[bytes], Quantity]


class DoubtfulMessage(Exception):
    """A message was used, although it has a problem; the text says which."""

    def __init__(self, problem: str, values: Optional[Mapping[str, str]] = None) -> None:
        """``values`` are for programs."""
        super().__init__(problem)
        self.values: Mapping[str, str] = values or {}


class TopicReader(Generic[Quantity]):
    """Subscribes to a topic and passes its decoded content to a callback, one message at a time.

    The type is taken from the publisher's connection, so that one node reads the thesis' arrays
    and standard messages alike. A message that cannot be used is left out with a complaint that
    names the topic; the last good one stays. One that arrives while ROS time does not advance or
    has gone back is used, also with a complaint.
    """

    def __init__(self, node: NodeHandle, complaints: Complaints, topic: str, message_type: str,
                 decoders: Dict[str, Decoder[Quantity]],
                 callback: Callable[[Quantity], None],
                 numbers: Optional[Callable[[Quantity], Sequence[float]]] = None,
                 equal: float = 0.0) -> None:
        """Subscribe.

        Args:
            node: its connection to ROS.
            complaints: those of the node.
            topic: the topic's name.
            message_type: the only type that is accepted ('package/Type'), or '' for each of
            decoders.
            decoders: for each type, a function of the serialised message; it raises ValueError
            (with the problem) for content that cannot be used.
            callback: called in the thread of the subscription; may raise ValueError likewise, or
                DoubtfulMessage when it has used the content nevertheless.
            numbers: the values by which publishers that contradict each other are noticed.
            equal: see SourceConflict.
        """
        self._node, self._complaints = node, complaints
        self._topic = node.resolve(topic)
        self._decoders = decoders
        self._message_type = message_type
        self._callback = callback
        self._lock = threading.Lock()  # two publishers of a topic are two threads
        self._time_watch = TimeWatch()
        self._numbers, self._conflict = numbers, SourceConflict(equal)
        node.subscribe(topic, rospy.AnyMsg, self._receive)

    def _receive(self, message: rospy.AnyMsg) -> None:
        with self._lock:
            try:
                quantity = self._decode(message)
                self._callback(quantity)
                self._watch_time()
                self._watch_publishers(quantity, message._connection_header.get('callerid', ''))
                self._complaints.note_good(self._topic)
            except ValueError as error:
                self._warn(f'is left out: {error}')
            except DoubtfulMessage as doubt:
                self._warn(f'is shown, but {doubt}', doubt.values)

    def _watch_time(self) -> None:
        problem = self._time_watch.problem(self._node.ros_s(), self._node.monotonic_s())
        if problem:
            raise DoubtfulMessage(problem)

    def _watch_publishers(self, quantity: Quantity, publisher: str) -> None:
        if self._numbers is not None:
            problem = self._conflict.add(publisher, self._numbers(quantity),
                                         self._node.monotonic_s())
            if problem:
                raise DoubtfulMessage(problem, {CONFLICT_KEY: f'{self._topic}: {problem}'})

    def _decode(self, message: Any) -> Quantity:
        carried: str = message._connection_header['type']
        decoder: Optional[Decoder[Quantity]] = self._decoders.get(carried)
        if decoder is None or (self._message_type and carried != self._message_type):
            expected = self._message_type or ' or '.join(self._decoders)
            raise ValueError(f'it carries {carried}, and {expected} is expected')
        try:
            return decoder(message._buff)
        except genpy.DeserializationError as error:
            raise ValueError(f'its bytes are not those of {carried}: {error}') from error

    def _warn(self, problem: str, values: Optional[Mapping[str, str]] = None) -> None:
        self._complaints.add(self._topic, f'a message on {self._topic} {problem}', values=values)
