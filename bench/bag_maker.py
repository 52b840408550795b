# SPDX-License-Identifier: BSD-3-Clause
"""Writes bags for benchmarks: every message has its index and a known due time.

The times are an ideal schedule: message k of a topic is at k / rate, and 0.1 ms after that of the
topic before it. Chunks have 768 KB without compression, as `rosbag record` writes them.
"""
from __future__ import annotations

import heapq
import os
import sys
import tempfile
from pathlib import Path
from typing import Any, Callable, Iterator, NamedTuple, Sequence, Tuple

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer
from rosbags.typesys.msg import normalize_msgtype

BEGIN_NS = 1_600_000_000_000_000_000
"""Bag time of every bag's first message."""
DEFAULT_FOLDER = os.path.join(tempfile.gettempdir(), 'process_visualizer_bench')

_CHUNK_BYTES = 768 * 1024
_PHASE_NS = 100_000


class BagTopic(NamedTuple):
    """A topic of a generated bag: its rate, its message class, and its messages.

    ``content(k, time_ns)`` returns the bytes of message k; ``time_ns`` is the same for all topics
    of that rate, like the stamps of an image and its camera info.
    """

    name: str
    rate_hz: int
    message_class: Any
    content: Callable[[int, int], bytes]


class MadeBag(NamedTuple):
    """A bag's file, its topics and its length [s]."""

    path: Path
    topics: Tuple[BagTopic, ...]
    length_s: float

    def times_ns(self, number: int) -> np.ndarray:
        """Return the recording times of all messages of topic ``number``, (n,) int64."""
        count = message_count(self.topics[number], self.length_s)
        return np.arange(count) * 1_000_000_000 // self.topics[number].rate_hz \
            + BEGIN_NS + number * _PHASE_NS


def message_count(topic: BagTopic, length_s: float) -> int:
    """Return the number of messages of a topic in a bag of this length."""
    return int(length_s * topic.rate_hz)


def made_bag(path: Path, topics: Sequence[BagTopic], length_s: float) -> MadeBag:
    """Return the bag; write it unless it exists from an earlier run."""
    if not path.exists():
        print(f'writing {path}', file=sys.stderr)
        path.parent.mkdir(parents=True, exist_ok=True)
        # Written under another name first, so that an interrupted run leaves no half bag.
        unfinished = path.with_suffix('.unfinished')
        if unfinished.exists():
            unfinished.unlink()
        _write(unfinished, topics, length_s)
        unfinished.rename(path)
    return MadeBag(path, tuple(topics), length_s)


def _write(path: Path, topics: Sequence[BagTopic], length_s: float) -> None:
    writer = Writer(path)
    writer.chunk_threshold = _CHUNK_BYTES
    with writer:
        connections = [_connection(writer, topic) for topic in topics]
        for phased_ns, number, index in heapq.merge(*(
                _schedule(number, topic, length_s) for number, topic in enumerate(topics))):
            time_ns = BEGIN_NS + phased_ns
            writer.write(connections[number], time_ns,
                         topics[number].content(index, time_ns - number * _PHASE_NS))


def _schedule(number: int, topic: BagTopic, length_s: float) -> Iterator[Tuple[int, int, int]]:
    return ((index * 1_000_000_000 // topic.rate_hz + number * _PHASE_NS, number, index)
            for index in range(message_count(topic, length_s)))


def _connection(writer: Writer, topic: BagTopic) -> Connection:
    message_class = topic.message_class
    return writer.add_connection(
        topic.name, normalize_msgtype(message_class._type), msgdef=message_class._full_text,
        md5sum=message_class._md5sum, callerid='/driver')
