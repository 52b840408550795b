# SPDX-License-Identifier: BSD-3-Clause
"""Computes the errors of arrivals relative to the schedule of the bag."""
from __future__ import annotations

from typing import List, NamedTuple, Sequence

import numpy as np


class TopicArrivals(NamedTuple):
    """A topic in one run: the messages, their arrivals [ns], and their bag times [ns of the bag].

    ``indexes`` and ``arrivals_ns`` (n,) are in order of arrival, ``bag_times_ns`` has all messages.
    """

    indexes: np.ndarray
    arrivals_ns: np.ndarray
    bag_times_ns: np.ndarray

    def due_ns(self, rate: float) -> np.ndarray:
        """Return the due time of each arrival, (n,) float, up to an offset common to all topics."""
        return (self.bag_times_ns[self.indexes] - self.bag_times_ns[0]) / rate


class TopicError(NamedTuple):
    """Schedule errors (n,) [ms], positive if late; numbers of messages lost and out of order."""

    errors_ms: np.ndarray
    lost: int
    disordered: int

    def percentile(self, percent: float) -> float:
        """Return a percentile of the absolute errors [ms]; NaN if nothing arrived."""
        if not len(self.errors_ms):
            return float('nan')
        return float(np.percentile(np.abs(self.errors_ms), percent))


def schedule_errors(topics: Sequence[TopicArrivals], reference: Sequence[int],
                    rate: float) -> List[TopicError]:
    """Return the errors of every topic in a run.

    A player may begin at any time: one offset, common to all topics, is the median over the
    messages of the reference topics. It is common, so that a topic that is always late has an
    error; a median, so that a stall does not shift the others; and of small messages only, because
    no player can shorten the transfer of an image.
    """
    begin_ns = min(topic.bag_times_ns[0] for topic in topics)
    lateness = [topic.arrivals_ns - topic.due_ns(rate) - (topic.bag_times_ns[0] - begin_ns) / rate
                for topic in topics]
    offset = np.median(np.concatenate([lateness[number] for number in reference]))
    return [TopicError((late - offset) / 1e6, _lost(topic), _disordered(topic))
            for topic, late in zip(topics, lateness)]


def pooled(runs: Sequence[Sequence[TopicError]]) -> List[TopicError]:
    """Return the errors of every topic over several runs."""
    return [TopicError(np.concatenate([error.errors_ms for error in errors]),
                       sum(error.lost for error in errors),
                       sum(error.disordered for error in errors)) for errors in zip(*runs)]


def _lost(topic: TopicArrivals) -> int:
    return len(topic.bag_times_ns) - len(np.unique(topic.indexes))


def _disordered(topic: TopicArrivals) -> int:
    """Return the number of messages that came after a later one, or came again."""
    if not len(topic.indexes):
        return 0
    newest = np.maximum.accumulate(topic.indexes)
    return int(np.sum(topic.indexes[1:] <= newest[:-1]))
