"""The player tells when messages without a stamp were recorded, and who needs it follows."""
from __future__ import annotations

import threading
import zlib
from itertools import groupby
from typing import Callable, Iterable, List, NamedTuple

import rospy

from process_visualizer.bags.message_layout import Data
from process_visualizer.bags.timeline import NS_PER_S, Basis
from process_visualizer.motion.playback_clock import BagTime
from process_visualizer.motion.recorded_times import Told
from process_visualizer.msg import RecordedTimes

PLAYER = '/bag_player'
BATCH_S = 0.04  # less than the time by which messages are prepared before they are sent
LARGEST_BYTES = 4096


class _Announced(NamedTuple):
    segment: int
    rate: float
    topic: str
    checksum: int
    position_s: float


class RecordedTimesPublisher:
    """Publishes ~recorded_times, many messages at once: each costs every subscriber some time."""

    def __init__(self) -> None:
        """Advertise the topic and start the thread."""
        self._publisher = rospy.Publisher('~recorded_times', RecordedTimes, queue_size=100,
                                          tcp_nodelay=True)
        self._changed = threading.Condition()
        self._announced: List[_Announced] = []
        self._closed = False
        self._thread = threading.Thread(target=self._run, name='recorded times', daemon=True)
        self._thread.start()

    def announce(self, topic: str, data: Data, bag_ns: int, basis: Basis) -> None:
        """Tell when a message was recorded [bag ns], if somebody wants to know."""
        if len(data) > LARGEST_BYTES or not self._publisher.get_num_connections():
            return
        rate = 0.0 if basis.paused else basis.rate
        one = _Announced(basis.segment, rate, topic, zlib.crc32(data),
                         (bag_ns - basis.begin_ns) / NS_PER_S)
        with self._changed:
            self._announced.append(one)
            if len(self._announced) == 1:
                self._changed.notify()

    def close(self) -> None:
        """End; what was not told yet is not told any more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while not self._closed:
            for message in _messages(self._next_batch()):
                try:
                    self._publisher.publish(message)
                except rospy.ROSException as error:  # the node is shutting down
                    rospy.logdebug('recorded times are not published: %s', error)

    def _next_batch(self) -> List[_Announced]:
        with self._changed:
            self._changed.wait_for(lambda: self._announced or self._closed)
            self._changed.wait_for(lambda: self._closed, BATCH_S)
            batch, self._announced = self._announced, []
        return batch


class RecordedTimesFollower:
    """Hears when the messages of a topic were recorded; in real time nothing comes."""

    def __init__(self, topic: str, callback: Callable[[List[Told]], None]) -> None:
        """Subscribe; the callback is called in a thread of its own, in the order of sending."""
        self._topic = rospy.resolve_name(topic)
        self._callback = callback
        rospy.Subscriber(f'{PLAYER}/recorded_times', RecordedTimes, self._receive,
                         tcp_nodelay=True)

    def _receive(self, times: RecordedTimes) -> None:
        if self._topic in times.topics:
            number = times.topics.index(self._topic)
            self._callback([Told(checksum, BagTime(times.segment, position_s, times.rate))
                            for topic, checksum, position_s
                            in zip(times.topic, times.checksum, times.position)
                            if topic == number])


def _messages(batch: Iterable[_Announced]) -> List[RecordedTimes]:
    """Return one message for each segment and rate, in the order of sending."""
    messages = []
    for (segment, rate), group in groupby(batch, key=lambda one: one[:2]):
        ones = list(group)
        topics = sorted({one.topic for one in ones})
        messages.append(RecordedTimes(
            segment=segment, rate=rate, topics=topics,
            topic=[topics.index(one.topic) for one in ones],
            checksum=[one.checksum for one in ones],
            position=[one.position_s for one in ones]))
    return messages
