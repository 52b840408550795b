# SPDX-License-Identifier: BSD-3-Clause
"""Computes the delay from a command to its effect at a subscriber."""
from __future__ import annotations

import struct
from typing import NamedTuple, Sequence

import numpy as np

_STATE_RATE_OFFSET = 32
"""Bytes before ``rate`` in a PlayerState: two times of 8 bytes and two float64."""


class Seen(NamedTuple):
    """Arrivals: time [ns], topic, and index of the message; all (n,)."""

    times_ns: np.ndarray
    topics: np.ndarray
    indexes: np.ndarray

    def between(self, begin_ns: int, end_ns: int) -> 'Seen':
        """Return the arrivals of a period, in order."""
        first, last = np.searchsorted(self.times_ns, [begin_ns, end_ns])
        return Seen(self.times_ns[first:last], self.topics[first:last], self.indexes[first:last])

    def first_arrivals(self) -> 'Seen':
        """Return arrivals later in the recording than all before on their topic: no repetition."""
        new = np.zeros(len(self.times_ns), bool)
        for topic in np.unique(self.topics):
            its = self.topics == topic
            newest = np.maximum.accumulate(self.indexes[its])
            new[its] = np.diff(newest, prepend=-1) > 0
        return Seen(self.times_ns[new], self.topics[new], self.indexes[new])


def scene_latency_ms(seen: Seen, request_ns: int, expected: Sequence[int]) -> float:
    """Return the delay [ms] from a seek to the last topic's message; NaN if one did not arrive.

    Args:
        seen: arrivals from the request to the next one; other messages do not count.
        expected: index of each topic's last message at or before the position; -1: there is none.
    """
    last_ns = request_ns
    for topic, index in enumerate(expected):
        if index < 0:
            continue
        its = seen.times_ns[(seen.topics == topic) & (seen.indexes == index)]
        if not len(its):
            return float('nan')
        last_ns = max(last_ns, int(its[0]))
    return (last_ns - request_ns) / 1e6


def pause_latency_ms(seen: Seen, request_ns: int) -> float:
    """Return the delay [ms] from the request to the last message that arrives; 0 if none does."""
    return (int(seen.times_ns[-1]) - request_ns) / 1e6 if len(seen.times_ns) else 0.0


def rate_latency_ms(before: Seen, after: Seen, due_ns: Sequence[np.ndarray], old_rate: float,
                    new_rate: float, request_ns: int) -> float:
    """Return the delay [ms] from a request to the change of the rate.

    Arrivals over the bag's time are a line of slope 1 / rate; the change is the intersection of the
    line before the request and the one after the change.

    Args:
        before, after: arrivals during the old and during the new rate.
        due_ns: for each topic the bag times of its messages.
    """
    old_ns = _line_offset_ns(before, due_ns, old_rate, request_ns)
    new_ns = _line_offset_ns(after, due_ns, new_rate, request_ns)
    bag_ns = (new_ns - old_ns) / (1 / old_rate - 1 / new_rate)
    return (old_ns + bag_ns / old_rate) / 1e6


def _line_offset_ns(seen: Seen, due_ns: Sequence[np.ndarray], rate: float,
                    zero_ns: int) -> float:
    """Return the arrival since ``zero_ns`` of a message at bag time 0 (the bag's first message)."""
    begin_ns = min(int(times[0]) for times in due_ns)
    bag_ns = np.array([due_ns[topic][index] - begin_ns
                       for topic, index in zip(seen.topics, seen.indexes)], float)
    return float(np.median(seen.times_ns - zero_ns - bag_ns / rate))


def state_rate(front: np.ndarray) -> float:
    """Return the commanded rate from the first bytes (64,) uint8 of a PlayerState."""
    return float(struct.unpack_from('<d', front.tobytes(), _STATE_RATE_OFFSET)[0])
