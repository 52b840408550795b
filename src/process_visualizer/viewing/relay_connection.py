# SPDX-License-Identifier: BSD-3-Clause
"""The connection to the relay of a cell, renewed whenever it is dead."""
from __future__ import annotations

import os
import select
import socket
import threading
import time
from collections import deque
from typing import (
    Any,
    Callable,
    Collection,
    Deque,
    Dict,
    List,
    NamedTuple,
    Optional,
    Protocol,
    Tuple,
)

from process_visualizer.launching.ros_api import addresses_of
from process_visualizer.remote.link_words import another_cell, is_loopback, only_small_packets
from process_visualizer.remote.offer import (
    MAX_MESH_BYTES,
    Offer,
    OfferedTopic,
    are_different,
    offer_of,
    topics_of,
)
from process_visualizer.remote.packets import (
    GREETING,
    Kind,
    Message,
    MessageParts,
    Packet,
    PacketReader,
    PacketsBroken,
    json_packet,
    number_packet,
)
from process_visualizer.viewing.find_relay import CellNotFound

_LATEST = 30
_NS_PER_S = 1e9


class ClockOffset:
    """Offset of another clock, from the quickest recent answer, which is the most precise one."""

    def __init__(self) -> None:
        """Begin without answers."""
        self._answers: Deque[Tuple[float, float]] = deque(maxlen=_LATEST)

    def take(self, asked_ns: int, there_ns: int, answered_ns: int) -> None:
        """Process an answer: local times of question and answer, and the remote time [ns]."""
        if answered_ns < asked_ns:  # the clock was set back in between
            return
        between_ns = (asked_ns + answered_ns) // 2
        self._answers.append(((answered_ns - asked_ns) / _NS_PER_S,
                              (there_ns - between_ns) / _NS_PER_S))

    @property
    def is_known(self) -> bool:
        """Return whether there is an answer."""
        return bool(self._answers)

    @property
    def answer_s(self) -> float:
        """Return the duration of the quickest answer [s]; 0 if there is none."""
        return min(self._answers)[0] if self._answers else 0.0

    @property
    def ahead_s(self) -> float:
        """Return how far the other clock is ahead of this one [s]; 0 if nothing is known."""
        return min(self._answers)[1] if self._answers else 0.0


_FIRST_FILE = 1 << 31
_PING_S = 0.4
_DEAD_S = 1.6
"""Silence after which a connection is dead [s]: the relay answers every ping."""
_STOOD_S = 5.0
"""Time without a turn of the loop [s] after which the cell considers this viewer dead."""
ENDED = 'the cell has ended the connection'
TUNNEL_ENDED = 'the cell, or the tunnel to it, has ended the connection'
STOOD = 'this viewer stood still for {:.0f} s, and the cell has ended the connection'
_CONNECT_S, _ATTEMPT_S, _AGAIN_S = 0.5, 0.2, 0.2
"""Duration of an unanswered attempt, interval of attempts, pause after a connection [s]. Attempts
overlap, so that one succeeds soon after the link is back."""
_LONG_LOST_S, _LATER_AGAIN_S = 15.0, 1.0
"""Time without data after which the pause after a refused connection is longer, and that pause [s].
A tunnel, and the cell's ssh server, log each attempt."""
_NO_ANSWER_S = 2.0
_LOOK_S, _MAX_LOOK_S = 2.0, 16.0
"""Pause before the first search for another address, and the longest pause: they grow [s]."""
_OFFER_S = 6.0
"""Time from the greeting, or the connection, to the offer, which a busy cell makes slowly [s]."""
_RECEIVED_BYTES = 128 << 10
_MAX_SOURCES, _MAX_NAME = 10_000, 1000
"""Maximum number of publishers in a connection, and of characters in each of their names."""


class RelaySource(NamedTuple):
    """One publisher of a topic at the cell."""

    topic: str
    type: str
    md5sum: str
    caller: str
    is_latched: bool


class Listener(Protocol):
    """Receiver of everything from the relay; methods are called in the connection's thread."""

    def on_offer(self, offer: Offer) -> None:
        """Handle the cell's offer, the first message of a connection."""

    def on_topics(self, topics: Dict[str, OfferedTopic]) -> None:
        """Handle further topics."""

    def on_message(self, source: RelaySource, message: Message) -> None:
        """Handle a message."""

    def on_left_out(self, counts: Dict[str, int]) -> None:
        """Handle the numbers of messages, by topic, that the link dropped in the last seconds."""

    def on_lost(self, reason: str, heard_s: float) -> None:
        """Handle the loss of the connection; ``heard_s`` is the last data's time [s, monotonic]."""


class RelayConnection:
    """Keeps a connection, in a thread of its own, until it is closed."""

    def __init__(self, address: Tuple[str, int], listener: Listener,
                 find: Optional[Callable[[], Tuple[str, int]]] = None) -> None:
        """Set the relay's host and port, and the receiver of its messages.

        ``find`` returns the present host and port of the relay, as a restarted cell may have
        another port; it raises CellNotFound.
        """
        self._address, self._listener, self._find = address, listener, find
        self._first = address
        self._cell = ''
        self._closed = threading.Event()
        self._lock = threading.Lock()
        self._socket: Optional[socket.socket] = None
        self._wanted: Collection[str] = ()
        self._files: Dict[int, Callable[[bytes], None]] = {}
        self._uris: Dict[int, str] = {}
        self._heard_s = time.monotonic()
        self._looking = threading.Thread()
        self.clock = ClockOffset()
        self._thread = threading.Thread(target=self._run, name='relay', daemon=True)

    def start(self) -> None:
        """Start connecting."""
        self._thread.start()

    def close(self) -> None:
        """End the connection, and wait for the end of the thread."""
        self._closed.set()
        self._thread.join()

    def want(self, topics: Collection[str]) -> None:
        """Ask for the messages of these topics, and no others."""
        with self._lock:
            self._wanted = sorted(topics)
        self._send(json_packet(Kind.WANT, topics=list(self._wanted)))

    def fetch(self, uri: str, take: Callable[[bytes], None]) -> None:
        """Request a file; ``take`` receives its content, empty if there is no such file."""
        with self._lock:
            channel = _FIRST_FILE + len(self._uris)
            self._files[channel], self._uris[channel] = take, uri
        self._send(json_packet(Kind.FETCH, uri=uri, channel=channel))

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                with self._connected() as connection:
                    reason = self._converse(connection)
            except (OSError, PacketsBroken, ValueError) as error:
                reason = str(getattr(error, 'strerror', None) or error) or 'no answer'
            with self._lock:
                self._socket = None
            if not self._closed.is_set():
                self._listener.on_lost(reason, self._heard_s)
                self._look_elsewhere()
            is_long_lost = time.monotonic() - self._heard_s > _LONG_LOST_S
            self._closed.wait(_LATER_AGAIN_S if is_long_lost else _AGAIN_S)

    def _look_elsewhere(self) -> None:
        """Look for the relay's address in a thread, while attempts to connect continue."""
        if self._find is not None and not self._looking.is_alive():
            self._looking = threading.Thread(target=self._look, name='find relay', daemon=True)
            self._looking.start()

    def _look(self) -> None:
        assert self._find is not None
        pause_s = _LOOK_S
        while not self._closed.wait(pause_s) and time.monotonic() - self._heard_s > _LOOK_S:
            pause_s = min(2.0 * pause_s, _MAX_LOOK_S)
            try:
                self._address = self._find()
            except CellNotFound:
                continue  # the connection reports the problem itself

    def _connected(self) -> socket.socket:
        """Return a connection: attempts begin one after another, and the first answered one counts.

        Raises:
            OSError: no attempt is answered, or the connection is refused.
        """
        addresses = addresses_of(*self._address)
        lasting_s = max(_CONNECT_S, 4.0 * self.clock.answer_s)
        begin_s = next_s = time.monotonic()
        attempts: Deque[Tuple[float, socket.socket]] = deque()
        count, problem = 0, None
        try:
            while not self._closed.is_set():
                now_s = time.monotonic()
                if now_s - begin_s > max(_NO_ANSWER_S, lasting_s):
                    break
                try:
                    if now_s >= next_s:
                        count, next_s = count + 1, now_s + _ATTEMPT_S
                        attempts.append((now_s, _attempt(addresses[(count - 1) % len(addresses)])))
                    ready = select.select([], [it for _, it in attempts], [], next_s - now_s)[1]
                    if ready:
                        return _answered(ready[0].dup(), lasting_s)
                except OSError as error:
                    problem = problem or error
                    if count >= len(addresses):
                        raise problem from None
                    next_s = now_s  # another address may take the connection
                    while attempts:
                        attempts.pop()[1].close()
                while attempts and now_s - attempts[0][0] > lasting_s:  # still unanswered
                    attempts.popleft()[1].close()
        finally:
            for _, attempt in attempts:
                attempt.close()
        raise socket.timeout('no answer')

    def _converse(self, connection: socket.socket) -> str:
        """Process what the cell sends; return why the connection has ended."""
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.sendall(GREETING)
        if self._wanted:  # the offered topics are known already: messages arrive sooner
            connection.sendall(self.wanted_packet())
        with self._lock:
            self._socket = connection
            asked = [json_packet(Kind.FETCH, uri=self._uris[it], channel=it) for it in self._files]
        for packet in asked:
            self._send(packet)
        talk = _Talk(self, self._listener)
        received, heard_s, ping_s = -len(GREETING), time.monotonic(), 0.0
        stood_s, moves_since_s = 0.0, float('-inf')
        while not self._closed.is_set():
            now_s = time.monotonic()
            if now_s - heard_s > max(_DEAD_S if received > 0 else _OFFER_S,
                                     8.0 * self.clock.answer_s):
                raise OSError(only_small_packets(self._address[0]) if received == 0
                              else 'no answer')
            if now_s >= ping_s:
                ping_s = now_s + _PING_S
                self._send(number_packet(Kind.PING, time.time_ns()))
            has_data = select.select([connection], [], [], max(0.0, ping_s - now_s))[0]
            if time.monotonic() - now_s > _STOOD_S:
                stood_s, moves_since_s = time.monotonic() - now_s, time.monotonic()
            if not has_data:
                continue
            data = connection.recv(_RECEIVED_BYTES)
            if not data:
                has_stood = time.monotonic() - moves_since_s < _STOOD_S
                if has_stood:
                    return STOOD.format(stood_s)
                return TUNNEL_ENDED if is_loopback(self._address[0]) else ENDED
            heard_s = time.monotonic()
            received += len(data)
            if received > 0:
                self._send(number_packet(Kind.ACKNOWLEDGE, received))
            talk.take(data)
            self._heard_s = heard_s  # only now: these data are from a relay
        return ENDED

    def _send(self, packet: bytes) -> None:
        with self._lock:
            if self._socket is None:
                return
            try:
                self._socket.sendall(packet)
            except OSError:
                self._socket = None  # the reading thread notices, and connects again

    def wanted_packet(self) -> bytes:
        """Return the packet with the topics wanted now."""
        with self._lock:
            return json_packet(Kind.WANT, topics=list(self._wanted))

    def check(self, offer: Offer) -> None:
        """Set the cell of an offer; an address that was looked up must belong to the same cell.

        Raises:
            OSError: another cell of that computer was found.
        """
        if are_different(offer.cell, self._cell) and self._address != self._first:
            found, self._address = self._address, self._first
            raise OSError(another_cell(*found))
        self._cell = offer.cell

    def send_wanted(self) -> None:
        """Send the wanted topics again: newly offered ones are available only now."""
        self._send(self.wanted_packet())

    def take_file(self, message: Message) -> None:
        """Pass a file to the function given with the request."""
        with self._lock:
            take = self._files.pop(message.channel, None)
        if take is not None and len(message.data) <= MAX_MESH_BYTES:
            take(message.data)


def _attempt(found: Any) -> socket.socket:
    """Begin to connect to an address as `getaddrinfo` returns it."""
    attempt = socket.socket(*found[:3])
    attempt.setblocking(False)
    try:
        attempt.connect(found[4])
    except BlockingIOError:
        return attempt
    except OSError:
        attempt.close()
        raise
    return attempt


def _answered(connection: socket.socket, timeout_s: float) -> socket.socket:
    """Return an answered connection; raise OSError if it was refused."""
    problem = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
    if problem:
        connection.close()
        raise OSError(problem, os.strerror(problem))
    connection.settimeout(timeout_s)
    return connection


class _Talk:
    """The incoming messages of one connection."""

    def __init__(self, connection: RelayConnection, listener: Listener) -> None:
        self._connection, self._listener = connection, listener
        self._reader, self._parts = PacketReader(), MessageParts()
        self._sources: Dict[int, RelaySource] = {}

    def take(self, data: bytes) -> None:
        """Process bytes as they arrive.

        Raises:
            PacketsBroken, ValueError: the bytes are not from a relay.
        """
        for packet in self._reader.take(data):
            self._take_packet(packet)

    def _take_packet(self, packet: Packet) -> None:
        if packet.kind == Kind.BEGIN:
            self._deliver(self._parts.begin(packet))
        elif packet.kind == Kind.PART:
            self._deliver(self._parts.part(packet))
        elif packet.kind == Kind.PONG:
            self._connection.clock.take(*packet.times(), time.time_ns())
        elif packet.kind == Kind.CHANNEL:
            self._add_source(packet)
        elif packet.kind == Kind.OFFER:
            offer = offer_of(packet.json())
            self._connection.check(offer)
            self._listener.on_offer(offer)
        elif packet.kind == Kind.TOPICS:
            self._listener.on_topics(topics_of(packet.json()))
            self._connection.send_wanted()
        elif packet.kind == Kind.LEFT_OUT:
            self._listener.on_left_out(_counts(packet))
        elif packet.kind == Kind.REFUSED:
            raise OSError(str(packet.json().get('reason', 'refused'))[:300])

    def _add_source(self, packet: Packet) -> None:
        values = packet.json()
        texts = [values.get(it) for it in ('topic', 'type', 'md5sum', 'caller')]
        number = values.get('channel')
        if not isinstance(number, int) or not all(isinstance(it, str) for it in texts):
            raise PacketsBroken('a channel without a topic or number')
        if len(self._sources) >= _MAX_SOURCES or any(len(str(it)) > _MAX_NAME for it in texts):
            raise PacketsBroken('channels without end')
        topic, kind, md5sum, caller = map(str, texts)
        self._sources[number] = RelaySource(topic, kind, md5sum, caller,
                                            values.get('latched') is not False)

    def _deliver(self, messages: List[Message]) -> None:
        for message in messages:
            if message.channel >= _FIRST_FILE:
                self._connection.take_file(message)
            elif message.channel in self._sources:
                self._listener.on_message(self._sources[message.channel], message)


def _counts(packet: Packet) -> Dict[str, int]:
    return {name: count for name, count in packet.json().items() if isinstance(count, int)}
