# SPDX-License-Identifier: BSD-3-Clause
"""Data on a thin link are live: little is in transit, and old messages are left out."""
from __future__ import annotations

from functools import partial
from typing import List

import numpy as np
import pytest
from simulated_link import SimulatedLink

from process_visualizer.remote.outbox import MAX_WAIT_S, Outbox
from process_visualizer.remote.packets import (
    GREETING,
    Kind,
    Message,
    MessageParts,
    PacketReader,
    packet_bytes,
)

JOINTS, MARKERS, CLOUD, IMAGE = 1, 2, 3, 4
MBIT_S = 125_000.0


def p95(values: List[float]) -> float:
    return float(np.percentile(values, 95))


def as_it_is(_channel: int, data: bytes) -> bytes:
    return data


def run_cell(link: SimulatedLink, end_s: float, cloud_bytes: int, image_bytes: int) -> None:
    """Joints of two robots at 125 Hz, markers at 30 Hz, clouds and images at 30 Hz."""
    for step in range(round(link.now_s * 1000), int(end_s * 1000)):
        link.run_until(step / 1000)
        if step % 8 == 0:
            link.put(JOINTS, 400)
        if step % 33 == 0:
            link.put(MARKERS, 4000)
            link.put(CLOUD, cloud_bytes)
            link.put(IMAGE, image_bytes)
    link.run_until(end_s)


@pytest.mark.parametrize('delay_s', [0.001, 0.05, 0.2])
@pytest.mark.parametrize('mbit_s', [4.0, 10.0, 50.0])
def test_joints_and_clouds_stay_live(mbit_s: float, delay_s: float) -> None:
    link = SimulatedLink(mbit_s * MBIT_S, delay_s)
    run_cell(link, 20.0, cloud_bytes=1_500_000, image_bytes=900_000)
    settled = {channel: ages[len(ages) // 4:] for channel, ages in link.ages.items()}
    assert p95(settled[JOINTS]) < delay_s + 0.2
    assert p95(settled[MARKERS]) < delay_s + 0.25
    assert p95(settled[CLOUD]) < 2.0 * delay_s + 1.5
    assert len(link.ages[JOINTS]) > 0.9 * 20 * 125
    assert len(link.ages[IMAGE]) > 15


@pytest.mark.parametrize('cloud_bytes', [300_000, 900_000, 3_000_000])
def test_a_wide_link_that_becomes_thin_is_live_again_soon(cloud_bytes: int) -> None:
    """Messages in transit come first, but they are few, and nothing is added in the meantime."""
    link = SimulatedLink(1000 * MBIT_S, 0.0002)
    run_cell(link, 5.0, cloud_bytes, image_bytes=900_000)
    link.change(10 * MBIT_S, 0.025)
    before = {channel: len(ages) for channel, ages in link.ages.items()}
    run_cell(link, 35.0, cloud_bytes, image_bytes=900_000)
    for channel in (JOINTS, MARKERS, CLOUD):
        assert p95(link.ages[channel][before[channel]:]) < 0.5


def test_a_wide_link_carries_everything() -> None:
    link = SimulatedLink(1000 * MBIT_S, 0.0005)
    run_cell(link, 5.0, cloud_bytes=300_000, image_bytes=100_000)
    assert link.sizes[CLOUD][-50:] == [300_000] * 50
    assert link.outbox.take_left_out() == {}


@pytest.mark.parametrize('begin_mbit_s', [10.0, 1000.0])
def test_the_first_cloud_is_no_test_of_a_thin_link(begin_mbit_s: float) -> None:
    """Joint states alone do not show that a link has become thin."""
    link = SimulatedLink(begin_mbit_s * MBIT_S, 0.0005)
    run_cell(link, 5.0, cloud_bytes=900_000, image_bytes=100_000)
    for step in range(5 * 30, 60 * 30):
        link.run_until(step / 30)
        link.put(JOINTS, 400)
        if step == 30 * 30:  # in the meantime nobody watches the clouds
            link.change(MBIT_S, 0.0005)
        if step >= 40 * 30 and step % 6 == 0:
            link.put(CLOUD, 1_200_000)
    link.run_until(60.0)
    assert max(link.ages[CLOUD][-50:]) < 1.5
    assert p95(link.ages[JOINTS][-600:]) < 0.4


def test_on_a_wide_link_large_clouds_are_whole_soon() -> None:
    link = SimulatedLink(1000 * MBIT_S, 0.0005)
    for step in range(100):
        link.run_until(step / 10)
        link.put(CLOUD, 3_000_000)
    assert link.sizes[CLOUD][20:] == [3_000_000] * (len(link.sizes[CLOUD]) - 20)


def test_of_a_large_message_only_the_last_is_sent() -> None:
    box = Outbox()
    for size in (20_000, 30_000, 40_000):
        box.put(CLOUD, 0, bytes(size), 0.0)
    sent = b''.join(iter(lambda: box.next_packets(0.0, as_it_is) or b'', b''))
    assert 40_000 < len(sent) < 41_000
    assert box.take_left_out() == {CLOUD: 2}


def test_what_has_to_arrive_goes_first_and_is_never_too_old() -> None:
    box = Outbox()
    box.put(JOINTS, 0, b'joints', 0.0)
    box.put_packet(packet_bytes(Kind.PONG))
    box.put_kept(MARKERS, 0, b'latched')
    sent = [box.next_packets(2.0 * MAX_WAIT_S, as_it_is) for _ in range(4)]
    assert sent[0] == packet_bytes(Kind.PONG)
    assert b'latched' in b''.join(filter(None, sent))
    assert b'joints' not in b''.join(filter(None, sent))
    assert box.take_left_out() == {JOINTS: 1}


def test_a_file_comes_last_but_comes() -> None:
    box = Outbox()
    box.put_file(9, 0, lambda: b'mesh' * 10_000)
    box.put(CLOUD, 0, bytes(10_000), 0.0)
    sent = list(iter(lambda: box.next_packets(0.0, as_it_is) or b'', b''))
    assert b'mesh' in sent[-1]
    assert sum(map(len, sent)) > 50_000


def test_a_file_is_read_in_its_turn() -> None:
    """Otherwise a viewer that requests all files would have them all in the relay's memory."""
    box, read = Outbox(), []

    def content(number: int) -> bytes:
        read.append(number)
        return bytes(100_000)

    for number in range(100):
        box.put_file(number, 0, partial(content, number))
    assert read == []
    assert box.answers == 100
    box.next_packets(0.0, as_it_is)
    assert read == [0]
    assert len(all_packets(box)) > 99 * 100_000
    assert read == list(range(100))


def test_a_viewer_that_does_not_read_costs_little_memory() -> None:
    box = Outbox()
    for number in range(20_000):
        box.put(JOINTS, 0, bytes(1000), 0.001 * number)
    kept = 0
    while box.next_packets(0.0, as_it_is) is not None:
        kept += 1
    assert kept * 1000 < 5_000_000


def messages_of(packets: bytes) -> List[Message]:
    reader, parts = PacketReader(), MessageParts()
    return [message for packet in reader.take(GREETING + packets)
            for message in (parts.begin(packet) if packet.kind == Kind.BEGIN else
                            parts.part(packet))]


def all_packets(box: Outbox, most_bytes: int = 1 << 30) -> bytes:
    return b''.join(iter(lambda: box.next_packets(0.0, lambda _channel, data: (
        data if len(data) <= most_bytes else data[:most_bytes])) or b'', b''))


def test_clouds_and_images_that_share_a_link_are_shown_soon() -> None:
    link = SimulatedLink(10 * MBIT_S, 0.025)
    run_cell(link, 20.0, cloud_bytes=900_000, image_bytes=900_000)
    for channel in (CLOUD, IMAGE):
        assert p95(link.ages[channel][10:]) < 0.5


@pytest.mark.parametrize('size', [500, 900_000])
def test_of_latched_messages_only_the_last_is_kept(size: int) -> None:
    box = Outbox()
    for number in range(300):
        box.put_kept(MARKERS, number, bytes(size))
    assert size < len(all_packets(box)) < 1.1 * size + 100
    assert box.take_left_out() == {MARKERS: 299}


def test_a_latched_message_becomes_complete_when_the_link_has_time() -> None:
    box = Outbox()
    box.put_kept(CLOUD, 0, bytes(100_000))
    sizes = [message.data for message in messages_of(all_packets(box, 20_000))]
    assert [len(it) for it in sizes] == [20_000, 100_000]


def test_a_flood_of_latched_clouds_holds_nothing_up() -> None:
    link = SimulatedLink(10 * MBIT_S, 0.025)
    for step in range(300):
        link.run_until(step / 30.0)
        link.put(JOINTS, 400)
        if step % 3 == 0:
            link.put(CLOUD, 960_000, is_kept=True)
    assert len(link.ages[JOINTS]) > 280
    assert p95(link.ages[JOINTS]) < 0.3
    assert p95(link.ages[CLOUD]) < 1.0
