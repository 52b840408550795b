# SPDX-License-Identifier: BSD-3-Clause
"""Packets between a cell and its viewers: complete on the other side, however they are split."""
from __future__ import annotations

import struct

import pytest

from process_visualizer.remote.packets import (
    GREETING,
    MAX_BYTES,
    Kind,
    MessageParts,
    Packet,
    PacketReader,
    PacketsBroken,
    json_packet,
    message_packets,
    number_packet,
    packet_bytes,
)


def test_a_message_arrives_whole_beside_another_one() -> None:
    one, other = bytes(range(256)) * 100, b'small'
    packets = [*message_packets(1, 7, one)]
    packets[1:1] = message_packets(2, 8, other)
    stream = GREETING + b''.join(packets)
    reader, parts, found = PacketReader(), MessageParts(), []
    for begin in range(0, len(stream), 999):
        for packet in reader.take(stream[begin:begin + 999]):
            found += parts.begin(packet) if packet.kind == Kind.BEGIN else parts.part(packet)
    assert found == [(2, 8, other), (1, 7, one)]


def test_an_empty_message_arrives_with_its_begin() -> None:
    reader = PacketReader()
    begin, = reader.take(GREETING + b''.join(message_packets(3, 1, b'')))
    assert MessageParts().begin(begin) == [(3, 1, b'')]


@pytest.mark.parametrize('stream', [
    b'HTTP/1.0 400 Bad request\r\n',
    GREETING.replace(b'1', b'2'),
    GREETING + struct.pack('<BII', Kind.PART, 0, 0xffffffff)])
def test_what_is_no_frame_is_refused_at_once(stream: bytes) -> None:
    with pytest.raises(PacketsBroken):
        PacketReader().take(stream)


def test_claimed_lengths_are_checked_before_anything_is_kept() -> None:
    reader, parts = PacketReader(), MessageParts()
    huge, small, part = reader.take(
        GREETING + packet_bytes(Kind.BEGIN, struct.pack('<QQ', 0, MAX_BYTES + 1), 1)
        + packet_bytes(Kind.BEGIN, struct.pack('<QQ', 0, 2), 1)
        + packet_bytes(Kind.PART, b'abc', 1))
    with pytest.raises(PacketsBroken):
        parts.begin(huge)
    with pytest.raises(PacketsBroken):
        parts.part(part)
    parts.begin(small)
    with pytest.raises(PacketsBroken):
        parts.part(part)


def begun(channel: int, size: int) -> Packet:
    return Packet(Kind.BEGIN, channel, struct.pack('<QQ', 0, size))


def test_messages_that_begin_and_never_end_do_not_become_many() -> None:
    parts = MessageParts()
    with pytest.raises(PacketsBroken):
        for channel in range(1 << 20):
            parts.begin(begun(channel, 1))
    parts = MessageParts()
    part = Packet(Kind.PART, 0, bytes(1 << 20))
    with pytest.raises(PacketsBroken):
        for channel in range(1 << 10):
            parts.begin(begun(channel, 1 << 25))
            parts.part(part._replace(channel=channel))


def test_messages_that_end_or_begin_anew_do_not_count() -> None:
    parts = MessageParts()
    part = Packet(Kind.PART, 1, bytes(1 << 20))
    for _ in range(600):
        parts.begin(begun(1, 1 << 25))
        assert parts.part(part) == []
        parts.begin(begun(2, 1 << 20))
        assert len(parts.part(part._replace(channel=2))) == 1


@pytest.mark.parametrize('packet', [
    packet_bytes(Kind.OFFER, b'[]'), packet_bytes(Kind.OFFER, b'{'),
    packet_bytes(Kind.OFFER, b'\xff'), packet_bytes(Kind.OFFER, b'[' * 100_000)])
def test_what_is_no_json_is_told(packet: bytes) -> None:
    found, = PacketReader().take(GREETING + packet)
    with pytest.raises(PacketsBroken):
        found.json()


def test_values_are_those_that_were_sent() -> None:
    first, second = PacketReader().take(GREETING + json_packet(Kind.WANT, topics=['/tf'])
                                           + number_packet(Kind.ACKNOWLEDGE, 1 << 40))
    assert first.json() == {'topics': ['/tf']}
    assert second.number() == 1 << 40
    with pytest.raises(PacketsBroken):
        first.number()
