"""Where a step leads: how many messages are passed afterwards, and at what time."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.timeline import CommandRefused


@dataclass(frozen=True)
class StepTarget:
    """A number of messages that have been passed, and a position [bag ns] with just these."""

    count: int
    bag_ns: int


def step_by_messages(index: BagIndex, passed: int, count: int, topic: str = '') -> StepTarget:
    """Return the target of a step by messages, of one topic or ('') of all; below 0 backwards.

    Forward it ends at a message, backwards just before one: the scene is as it was then. Where
    fewer messages are left, it ends with the last of them.

    Raises:
        CommandRefused: the topic is not in the recording, or no message is left that way.
    """
    positions = _positions(index, topic)
    done = passed if positions is None else int(np.searchsorted(positions, passed))
    total = len(index) if positions is None else len(positions)
    reached = min(max(done + count, 0), total)
    if reached == done:
        of_topic = f' on {topic}' if topic else ''
        raise CommandRefused(f'there is no message {"after" if count > 0 else "before"} this '
                             f'position{of_topic}')
    if positions is None:
        return _target(index, reached)
    return _target(index, int(positions[reached - 1]) + 1 if count > 0 else int(positions[reached]))


def step_by_time(index: BagIndex, bag_ns: int) -> StepTarget:
    """Return the target of a step to a bag time [ns]."""
    return StepTarget(index.count_until(bag_ns), bag_ns)


def _positions(index: BagIndex, topic: str) -> Optional[np.ndarray]:
    if not topic:
        return None
    connections = index.connections_of(topic)
    if not connections:
        raise CommandRefused(f'the topic {topic} is not in the recording, or not chosen')
    return index.positions_of(connections)


def _target(index: BagIndex, count: int) -> StepTarget:
    return StepTarget(count, int(index.time_ns[count - 1]) if count else index.begin_ns)
