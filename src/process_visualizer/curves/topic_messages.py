# SPDX-License-Identifier: BSD-3-Clause
"""The messages of a topic in a part of a recording, independent of what is being played.

This module is separate because the player loads it at its start and needs no other part of the
curves.
"""
from __future__ import annotations

from typing import List, NamedTuple, Sequence

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.bagio.recording import Recording
from process_visualizer.robot.measuring_time import sending_period_s


class TopicMessages(NamedTuple):
    """Messages with the bag times [ns] at which they were recorded; complete up to ``end_ns``."""

    times_ns: List[int]
    messages: List[memoryview]
    end_ns: int


def topic_messages(recording: Recording, connections: Sequence[int], begin_ns: int, end_ns: int,
                   largest_bytes: int, before: Sequence[int] = ()) -> TopicMessages:
    """Return the messages of some connections between two bag times [ns], both included.

    The messages at the positions ``before`` are returned first. Messages that cannot be read are
    skipped. If the messages have more than ``largest_bytes`` in total, only the first ones are
    returned, but at least all messages of the first time. The recording caches decompressed chunks,
    so that playback, which needs them soon, does not decompress them again.
    """
    times_ns: List[int] = []
    messages: List[memoryview] = []
    size = 0
    between = positions_between(recording.index, connections, begin_ns, end_ns)
    for position in [*before, *between]:
        try:
            message = recording.message(position)
        except BagDamaged:
            continue  # playback reports it
        time_ns = int(recording.index.time_ns[position])
        size += len(message)
        if messages and size > largest_bytes and time_ns > times_ns[-1]:
            return TopicMessages(times_ns, messages, times_ns[-1])
        times_ns.append(time_ns)
        messages.append(message)
    return TopicMessages(times_ns, messages, end_ns)


def topic_period_s(recording: Recording, connections: Sequence[int]) -> float:
    """Return the period [s] of a topic's messages over the whole recording; 0 with too few."""
    positions = recording.index.positions_of(list(connections))
    times_ns = recording.index.time_ns[positions]
    return sending_period_s((times_ns - recording.begin_ns) / 1e9)


def positions_between(index: BagIndex, connections: Sequence[int], begin_ns: int,
                      end_ns: int) -> List[int]:
    """Return the ascending positions of the messages of some connections between two bag times."""
    bounds = index.count_before(begin_ns), index.count_until(end_ns)
    parts = []
    for connection in connections:
        positions = index.positions(connection)
        first, behind = np.searchsorted(positions, bounds)
        parts.append(positions[first:behind])
    found: List[int] = np.sort(np.concatenate(parts)).tolist() if parts else []
    return found
