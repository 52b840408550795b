# SPDX-License-Identifier: BSD-3-Clause
"""The newest message of every topic at a time: the scene that a seek restores."""
from __future__ import annotations

from typing import Dict, Iterable, List, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.messages.connection import Connection
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TYPES


class Scene:
    """The scene after any number of messages of a recording.

    It has the last message of each topic. Where each publisher of a topic has a state of its own,
    it has the last message of each (its source): latched topics, and transforms, which several
    nodes publish on /tf. Whoever keeps one message only has that of the newest source. Of
    /tf_static it has every message, since they add to each other.

    A count of messages stands for a time. With ``moment`` (also a count), a topic that has
    nothing yet has its first message if that is among the first ``moment`` ones.
    """

    def __init__(self, index: BagIndex) -> None:
        """Take an index."""
        self._index = index
        self._sources = sources(index.connections)
        self._numbers: Dict[int, List[int]] = {}  # connections by their source
        self._topics: Dict[str, List[int]] = {}  # sources by their topic
        self._static: Dict[str, List[int]] = {}
        for number, connection in enumerate(index.connections):
            if len(index.positions(number)):
                self._add(number, connection)

    @property
    def topics(self) -> Tuple[str, ...]:
        """The topics with messages, without static transforms."""
        return tuple(self._topics)

    @property
    def static_topics(self) -> Dict[str, np.ndarray]:
        """The topics of static transforms, with the positions (rising) of all their messages."""
        return {topic: self._index.positions_of(numbers)
                for topic, numbers in self._static.items()}

    def positions(self, count: int, moment: int = 0) -> List[int]:
        """Return the positions (rising) of the messages that are the scene after ``count`` ones.

        Static transforms are not among them.
        """
        return sorted(position for topic in self._topics
                      for position in self.positions_of(topic, count, moment))

    def positions_of(self, topic: str, count: int, moment: int = 0) -> List[int]:
        """Return those positions of one topic."""
        lasts = {source: self._last(source, count) for source in self._topics[topic]}
        found = [last for last in lasts.values() if last is not None]
        absent = [source for source, last in lasts.items() if last is None]
        firsts = [self.first(source) for source in absent]
        if not self._has_transforms(topic):
            firsts = [] if found else [min(firsts)]
        return sorted([*found, *(first for first in firsts if first < moment)])

    def shown_again(self, position: int) -> List[int]:
        """Return the positions (rising) of what is to be seen again before a message.

        It is what the source's message had taken the place of, and what was the newest.
        """
        topic = self._topic_of(position)
        replaced, newest = self.replaced(position), self.positions_of(topic, position)[-1:]
        if replaced is None:
            return [] if self._has_transforms(topic) else newest
        return [replaced] if self._has_transforms(topic) else sorted({replaced, *newest})

    def replaced(self, position: int) -> Optional[int]:
        """Return the position of the message that the one at a position takes the place of."""
        return self._last(self.source_of(position), position)

    def latched_sources(self, without: Iterable[int] = ()) -> List[int]:
        """Return the latched sources, but for those of the messages at some positions."""
        others = {self.source_of(position) for position in without}
        return [source for group in self._topics.values() for source in group
                if source not in others and self._index.connections[source].latching]

    def absent_topics(self, count: int, moment: int = 0) -> List[str]:
        """Return the topics that have nothing in the scene."""
        return [topic for topic in self._topics if not self.positions_of(topic, count, moment)]

    def first_of(self, topic: str) -> int:
        """Return the position of a topic's first message."""
        return min(map(self.first, self._topics[topic]))

    def first(self, source: int) -> int:
        """Return the position of a source's first message."""
        return min(int(self._index.positions(number)[0]) for number in self._numbers[source])

    def messages_of(self, source: int) -> np.ndarray:
        """Return the positions (rising) of a source's messages."""
        return self._index.positions_of(self._numbers[source])

    def source_of(self, position: int) -> int:
        """Return the source of the message at a position."""
        return self._sources[int(self._index.connection[position])]

    def _add(self, number: int, connection: Connection) -> None:
        if is_static(connection):
            self._static.setdefault(connection.topic, []).append(number)
            return
        source = self._sources[number]
        self._numbers.setdefault(source, []).append(number)
        topic = self._topics.setdefault(connection.topic, [])
        if source not in topic:
            topic.append(source)

    def _topic_of(self, position: int) -> str:
        return self._index.connections[int(self._index.connection[position])].topic

    def _has_transforms(self, topic: str) -> bool:
        return self._index.connections[self._topics[topic][0]].type in TF_TYPES

    def _last(self, source: int, count: int) -> Optional[int]:
        lasts = [self._index.last_before(count, number) for number in self._numbers[source]]
        return max((last for last in lasts if last is not None), default=None)


def is_static(connection: Connection) -> bool:
    """Return whether it has static transforms, which hold for ever, whoever publishes others."""
    is_named = f'/{connection.topic}'.endswith(STATIC_TF_TOPIC)  # whatever its namespace
    return is_named and connection.type in TF_TYPES


def sources(connections: Sequence[Connection]) -> List[int]:
    """Return for each connection the first of those that replace each other's messages.

    A node that was restarted under its name replaces what it had said before.
    """
    firsts: Dict[Tuple[str, ...], int] = {}
    return [firsts.setdefault(_group(connection), number)
            for number, connection in enumerate(connections)]


def _group(connection: Connection) -> Tuple[str, ...]:
    of_its_own = connection.latching or connection.type in TF_TYPES
    if of_its_own and not is_static(connection):
        return connection.topic, connection.caller_id
    return connection.topic,
