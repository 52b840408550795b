# SPDX-License-Identifier: BSD-3-Clause
"""The connection to one viewer: one thread reads the viewer's requests, another one sends."""
from __future__ import annotations

import json
import socket
import threading
import time
from typing import (
    Any,
    Callable,
    Collection,
    Dict,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Protocol,
    Set,
)

import rospy

from process_visualizer.remote.link_window import LinkWindow
from process_visualizer.remote.offer import Offer, OfferedTopic, topics_message
from process_visualizer.remote.outbox import Outbox
from process_visualizer.remote.packets import (
    MAX_BYTES,
    Kind,
    Packet,
    PacketReader,
    PacketsBroken,
    json_packet,
    packet_bytes,
    times_packet,
)
from process_visualizer.remote.thinning import thinned

_BUFFER_BYTES = 16 << 20
_TOLD_EVERY_S = 10.0


class FeedChannel(NamedTuple):
    """One publisher of a topic, by its number; latched messages have to arrive."""

    number: int
    topic: str
    type: str
    md5sum: str
    caller: str
    is_latched: bool


class FeedListener(Protocol):
    """Receiver of messages of topics; called from rospy's threads, must not block."""

    def take(self, channel: FeedChannel, arrived_ns: int, data: bytes) -> None:
        """Handle a message."""


class _Latched(NamedTuple):
    channel: FeedChannel
    arrived_ns: int
    data: bytes


class TopicFeed:
    """Subscribes to topics of any type, and passes their messages on as bytes."""

    def __init__(self) -> None:
        """Begin without subscriptions."""
        self._lock = threading.Lock()
        self._wanted: Dict[str, List[FeedListener]] = {}
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._channels: Dict[Any, FeedChannel] = {}
        self._latched: Dict[int, _Latched] = {}

    def want(self, taker: FeedListener, topics: Collection[str]) -> None:
        """Pass on the messages of these topics, and no others, to a listener."""
        with self._lock:
            new = [topic for topic in topics if taker not in self._wanted.get(topic, [])]
            for topic in list(self._wanted):
                if topic not in topics:
                    self._wanted[topic] = [it for it in self._wanted[topic] if it is not taker]
            for topic in new:
                self._wanted.setdefault(topic, []).append(taker)
            kept = [it for it in self._latched.values() if it.channel.topic in new]
            left = self._update()
        for it in kept:
            taker.take(it.channel, it.arrived_ns, it.data)
        for subscriber in left:
            subscriber.unregister()

    def _update(self) -> List[rospy.Subscriber]:
        """Subscribe to new topics; return those that no viewer needs now."""
        needed: Set[str] = {topic for topic, takers in self._wanted.items() if takers}
        left = [self._subscribers.pop(it) for it in set(self._subscribers) - needed]
        for topic in set(self._wanted) - needed:
            del self._wanted[topic]
            for number in [key for key, it in self._latched.items() if it.channel.topic == topic]:
                del self._latched[number]
        for topic in needed - set(self._subscribers):
            self._subscribers[topic] = rospy.Subscriber(
                topic, rospy.AnyMsg, self._take, topic, buff_size=_BUFFER_BYTES, tcp_nodelay=True)
        return left

    def _take(self, message: Any, topic: str) -> None:
        arrived_ns = time.time_ns()
        header: Dict[str, str] = message._connection_header
        with self._lock:
            channel = self._channel(topic, header)
            data = bytes(message._buff)
            if len(data) > MAX_BYTES:
                rospy.logwarn_throttle_identical(
                    _TOLD_EVERY_S, f'{topic}: messages of more than {MAX_BYTES >> 20} MB are too '
                    'large for "cell view", and left out there')
            if channel.is_latched and topic in self._wanted:
                self._latched[channel.number] = _Latched(channel, arrived_ns, data)
            takers = list(self._wanted.get(topic, []))
        for taker in takers:
            taker.take(channel, arrived_ns, data)

    def _channel(self, topic: str, header: Dict[str, str]) -> FeedChannel:
        kind, md5sum = header.get('type', ''), header.get('md5sum', '')
        key = topic, kind, md5sum, header.get('callerid', ''), header.get('latching') == '1'
        if key not in self._channels:
            self._channels[key] = FeedChannel(len(self._channels) + 1, *key)
        return self._channels[key]


Files = Mapping[str, Callable[[], bytes]]
_SILENT_S = 6.0
"""Silence [s] after which a viewer counts as disconnected; viewers send twice a second."""
_ASKED_BYTES = 256 << 10
_RECEIVED_BYTES = 64 << 10
_MAX_ANSWERS = 10_000
"""Maximum number of waiting answers; a viewer that keeps asking without reading is dropped."""
_REPORT_PERIOD_S = 2.0
_WANT_PERIOD_S = 0.1
"""Minimum time between two changes of the topics of a viewer: each asks the cell's master."""


class ViewerLink:
    """Sends the offer and the wanted messages, never more than the viewer can receive."""

    def __init__(self, connection: socket.socket, name: str, feed: TopicFeed,
                 on_end: Callable[['ViewerLink'], None]) -> None:
        """``name`` is the viewer's address."""
        self._connection, self.name = connection, name
        self._feed, self._on_end = feed, on_end
        self._files: Files = {}
        self._changed = threading.Condition()
        self._outbox, self._window = Outbox(), LinkWindow()
        self._announced: Dict[int, FeedChannel] = {}
        self._offered: Set[str] = set()
        self._is_closed = False
        self._too_large: Set[int] = set()  # channels whose last message was too large
        self._next_report_s = self._next_want_s = 0.0
        self._ended = threading.Event()
        self._heard_s = time.monotonic()

    @property
    def silent_s(self) -> float:
        """Return the time [s] since anything was received from the viewer."""
        return time.monotonic() - self._heard_s

    def start(self, offer: Offer, files: Files, topics: Mapping[str, OfferedTopic]) -> None:
        """Send the offer, and start to listen; the viewer has been greeted."""
        connection = self._connection
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.settimeout(_SILENT_S)
        self.offer(offer, files)
        self.offer_topics(topics)
        for target, what in ((self._read, 'reads'), (self._write, 'writes')):
            threading.Thread(target=target, name=f'{what} {self.name}', daemon=True).start()

    def offer(self, offer: Offer, files: Files) -> None:
        """Offer the shown view; ``files`` reads the files that the viewer may fetch, by URI."""
        self._files = files
        self._put_packet(packet_bytes(Kind.OFFER, json.dumps(offer.values()).encode()))

    def offer_topics(self, topics: Mapping[str, OfferedTopic]) -> None:
        """Offer more topics."""
        new = {name: topic for name, topic in topics.items() if name not in self._offered}
        if new:
            self._offered |= new.keys()
            self._put_packet(json_packet(Kind.TOPICS, topics=topics_message(new)))

    def take(self, channel: FeedChannel, arrived_ns: int, data: bytes) -> None:
        """See FeedListener."""
        with self._changed:
            if channel.number not in self._announced:
                self._announced[channel.number] = channel
                self._outbox.put_packet(json_packet(
                    Kind.CHANNEL, channel=channel.number, topic=channel.topic, type=channel.type,
                    md5sum=channel.md5sum, caller=channel.caller, latched=channel.is_latched))
            self._too_large.discard(channel.number)
            if len(data) > MAX_BYTES:
                self._too_large.add(channel.number)
            elif channel.is_latched:
                self._outbox.put_kept(channel.number, arrived_ns, data)
            else:
                self._outbox.put(channel.number, arrived_ns, data, time.monotonic())
            self._changed.notify()

    def close(self) -> None:
        """End the connection; the threads end soon."""
        self._ended.set()
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        try:
            self._connection.shutdown(socket.SHUT_RDWR)
        except OSError:
            return  # the viewer has disconnected already

    def _read(self) -> None:
        reader = PacketReader(_ASKED_BYTES)
        try:
            while True:
                data = self._connection.recv(_RECEIVED_BYTES)
                if not data:
                    break
                self._heard_s = time.monotonic()
                wanted = None
                for packet in reader.take(data):
                    if packet.kind == Kind.WANT:
                        wanted = packet  # only the last one counts
                    else:
                        self._answer(packet)
                if wanted is not None:
                    self._want(wanted.json().get('topics'))
        except (OSError, PacketsBroken) as error:
            if not self._is_closed:
                rospy.loginfo('the viewer %s is gone: %s', self.name, error)
        self._feed.want(self, ())
        self.close()
        self._connection.close()  # otherwise a viewer that keeps sending would wait forever
        self._on_end(self)

    def _answer(self, packet: Packet) -> None:
        if packet.kind == Kind.PING:
            self._put_packet(times_packet(Kind.PONG, packet.number(), time.time_ns()))
            self._report_left_out()
        elif packet.kind == Kind.ACKNOWLEDGE:
            with self._changed:
                self._window.acknowledged(packet.number(), time.monotonic())
                self._changed.notify()
        elif packet.kind == Kind.FETCH:
            self._fetch(packet.json())
        if self._outbox.answers > _MAX_ANSWERS:
            raise PacketsBroken('it sends requests and does not read the answers')

    def _want(self, wanted: Any) -> None:
        """Subscribe to the topics that the viewer wants, before anything else is read from it."""
        self._ended.wait(max(0.0, self._next_want_s - time.monotonic()))
        self._next_want_s = time.monotonic() + _WANT_PERIOD_S
        topics = wanted if isinstance(wanted, list) else []
        self._feed.want(self, {it for it in topics if isinstance(it, str)} & self._offered)

    def _report_left_out(self) -> None:
        now_s = time.monotonic()
        if now_s < self._next_report_s:
            return
        self._next_report_s = now_s + _REPORT_PERIOD_S
        with self._changed:
            counts: Dict[str, int] = {}
            for number in self._too_large:
                self._outbox.count_dropped(number)
            for channel, count in self._outbox.take_left_out().items():
                topic = self._announced[channel].topic
                counts[topic] = counts.get(topic, 0) + count
            self._outbox.put_packet(packet_bytes(Kind.LEFT_OUT, json.dumps(counts).encode()))
            self._changed.notify()

    def _fetch(self, values: Mapping[str, Any]) -> None:
        """Send a file on the channel that the viewer has chosen; an empty one if there is none.

        Channels of files are above those of topics.
        """
        uri, channel = values.get('uri'), values.get('channel')
        if not isinstance(channel, int) or not (1 << 31) <= channel < (1 << 32):
            raise PacketsBroken('a file without a channel')
        read = self._files.get(uri) if isinstance(uri, str) else None
        with self._changed:
            self._outbox.put_file(channel, time.time_ns(), bytes if read is None else read)
            self._changed.notify()

    def _put_packet(self, packet: bytes) -> None:
        with self._changed:
            self._outbox.put_packet(packet)
            self._changed.notify()

    def _write(self) -> None:
        try:
            while True:
                data = self._next()
                if data is None:
                    return
                self._connection.sendall(data)
        except OSError:
            self.close()

    def _next(self) -> Optional[bytes]:
        """Wait for the next data that the link can carry; None at the end."""
        with self._changed:
            while not self._is_closed:
                now_s = time.monotonic()
                if self._window.may_send():
                    data = self._outbox.next_packets(now_s, self._thinned,
                                                    self._window.may_send_large(now_s))
                    if data is not None:
                        self._window.sent(len(data), now_s)
                        return data
                self._changed.wait()
            return None

    def _thinned(self, channel: int, data: bytes) -> bytes:
        most = self._window.large_bytes(self._outbox.transfers)
        announced = self._announced.get(channel)  # none for files
        return data if announced is None else thinned(announced.type, data, most)
