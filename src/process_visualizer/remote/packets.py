# SPDX-License-Identifier: BSD-3-Clause
"""Packets of a connection between a cell's relay and a viewer, as bytes.

After a greeting of fixed bytes, which reveals a wrong port at once, each side sends packets: a
kind, a channel, a length, and as many bytes of content. Large messages are sent in parts, so that
small ones do not wait for them. Lengths from the other side are checked before memory is allocated.
"""
from __future__ import annotations

import json
from enum import IntEnum
from struct import Struct
from typing import Any, Dict, Iterator, List, NamedTuple, Tuple

from process_visualizer.bagio.json_text import parsed_json

GREETING = b'process_visualizer view 1\n'
"""Greeting of both sides. The number is that of the protocol; both must have the same one."""
PART_BYTES = 8 << 10
MAX_BYTES = 64 << 20
"""Maximum size of a message; larger ones are not passed on."""
PACKET_BYTES = 4 << 20
"""Maximum size of a packet's content."""
MAX_OPEN, MAX_OPEN_BYTES = 4096, 8 * MAX_BYTES
"""Maximum number of messages that have begun and are not complete, and of their bytes so far."""
_HEAD = Struct('<BII')
_BEGIN = Struct('<QQ')
_NUMBER = Struct('<Q')
_TIMES = Struct('<QQ')


class Kind(IntEnum):
    """Kind of a packet. The viewer sends the kinds from WANT on, the relay the others."""

    OFFER = 1
    TOPICS = 2
    CHANNEL = 3
    BEGIN = 4
    PART = 5
    PONG = 6
    REFUSED = 7
    LEFT_OUT = 8
    WANT = 17
    ACKNOWLEDGE = 18
    PING = 19
    FETCH = 20


class Packet(NamedTuple):
    """A packet; ``channel`` is the number of a topic's publisher, or 0."""

    kind: int
    channel: int
    content: bytes

    def json(self) -> Dict[str, Any]:
        """Return the content as a JSON object.

        Raises:
            PacketsBroken: the content is not a JSON object.
        """
        try:
            value = parsed_json(self.content.decode('utf-8', 'surrogatepass'))
        except (ValueError, RecursionError) as error:
            raise PacketsBroken(f'not JSON: {error}') from None
        if not isinstance(value, dict):
            raise PacketsBroken('not a JSON object')
        return value

    def number(self) -> int:
        """Return the content as a number."""
        return int(_unpacked(_NUMBER, self.content)[0])

    def times(self) -> Tuple[int, int]:
        """Return the content as two numbers."""
        first, second = _unpacked(_TIMES, self.content)
        return first, second


class PacketsBroken(Exception):
    """The other side violates the protocol; the text says how."""


def packet_bytes(kind: Kind, content: bytes = b'', channel: int = 0) -> bytes:
    """Return a packet as bytes."""
    return _HEAD.pack(kind, channel, len(content)) + content


def json_packet(kind: Kind, **values: Any) -> bytes:
    """Return a packet with a JSON object."""
    return packet_bytes(kind, json.dumps(values).encode())


def number_packet(kind: Kind, number: int) -> bytes:
    """Return a packet with a number."""
    return packet_bytes(kind, _NUMBER.pack(number))


def times_packet(kind: Kind, first: int, second: int) -> bytes:
    """Return a packet with two numbers."""
    return packet_bytes(kind, _TIMES.pack(first, second))


def message_packets(channel: int, arrived_ns: int, data: bytes) -> Iterator[bytes]:
    """Yield the packets of a message: its beginning, and its parts.

    ``arrived_ns`` is the time of arrival at the relay, by the cell's clock [ns since the epoch].
    """
    yield packet_bytes(Kind.BEGIN, _BEGIN.pack(arrived_ns, len(data)), channel)
    for begin in range(0, len(data), PART_BYTES):
        yield packet_bytes(Kind.PART, data[begin:begin + PART_BYTES], channel)


class PacketReader:
    """Assembles packets from bytes as they arrive, up to a maximum size."""

    def __init__(self, most_bytes: int = PACKET_BYTES) -> None:
        """``most_bytes`` is the maximum size of a content."""
        self._most_bytes = most_bytes
        self._buffer = bytearray()
        self._is_greeted = False

    def take(self, data: bytes) -> List[Packet]:
        """Process bytes; return the packets that are complete now.

        Raises:
            PacketsBroken: the bytes are not packets.
        """
        self._buffer += data
        if not self._is_greeted:
            greeting = bytes(self._buffer[:len(GREETING)])
            if not GREETING.startswith(greeting):
                raise PacketsBroken('what answers there is not this program, or another version')
            if len(greeting) < len(GREETING):
                return []
            del self._buffer[:len(GREETING)]
            self._is_greeted = True
        return list(self._packets())

    def _packets(self) -> Iterator[Packet]:
        position = 0
        while len(self._buffer) - position >= _HEAD.size:
            kind, channel, length = _HEAD.unpack_from(self._buffer, position)
            if length > self._most_bytes:
                raise PacketsBroken(f'a packet of {length} bytes')
            end = position + _HEAD.size + length
            if len(self._buffer) < end:
                break
            yield Packet(kind, channel, bytes(self._buffer[position + _HEAD.size:end]))
            position = end
        del self._buffer[:position]


class Message(NamedTuple):
    """A message of a channel, and its time of arrival at the relay [ns, the cell's clock]."""

    channel: int
    arrived_ns: int
    data: bytes


class MessageParts:
    """Assembles messages; messages of several channels may be incomplete at the same time."""

    def __init__(self) -> None:
        """Begin without messages."""
        self._open: Dict[int, Tuple[int, int, bytearray]] = {}
        self._open_bytes = 0

    def begin(self, packet: Packet) -> List[Message]:
        """Process the beginning of a message; return the message if it is empty.

        Raises:
            PacketsBroken: the packet is not a valid beginning.
        """
        arrived_ns, size = _unpacked(_BEGIN, packet.content)
        if size > MAX_BYTES:
            raise PacketsBroken(f'a message of {size} bytes')
        self._forget(packet.channel)
        if len(self._open) >= MAX_OPEN:
            raise PacketsBroken(f'{MAX_OPEN} messages that have begun')
        self._open[packet.channel] = arrived_ns, size, bytearray()
        return self._completed(packet.channel)

    def part(self, packet: Packet) -> List[Message]:
        """Add a part; return the message if it is now complete.

        Raises:
            PacketsBroken: the message has not begun, or is longer than announced.
        """
        if packet.channel not in self._open:
            raise PacketsBroken('a part of a message that has not begun')
        _, size, data = self._open[packet.channel]
        data += packet.content
        self._open_bytes += len(packet.content)
        if len(data) > size:
            raise PacketsBroken('a message that is longer than announced')
        if self._open_bytes > MAX_OPEN_BYTES:
            raise PacketsBroken(f'unfinished messages of {self._open_bytes} bytes')
        return self._completed(packet.channel)

    def _completed(self, channel: int) -> List[Message]:
        arrived_ns, size, data = self._open[channel]
        if len(data) < size:
            return []
        self._forget(channel)
        return [Message(channel, arrived_ns, bytes(data))]

    def _forget(self, channel: int) -> None:
        _, _, data = self._open.pop(channel, (0, 0, b''))
        self._open_bytes -= len(data)


def _unpacked(layout: Struct, content: bytes) -> Tuple[Any, ...]:
    if len(content) != layout.size:
        raise PacketsBroken(f'{len(content)} bytes instead of {layout.size}')
    return layout.unpack(content)
