"""What was the newest on every topic at a time: the scene that a seek restores."""
from __future__ import annotations

from typing import Dict, Iterable, List, Optional, Tuple

import numpy as np

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.bag_records import Connection

STATIC_TOPIC = '/tf_static'
_TRANSFORMS = ('tf2_msgs/TFMessage', 'tf/tfMessage')

Group = Tuple[str, int]


class Scene:
    """The scene after any number of messages of a recording.

    It has the last message of each topic. Where each publisher of a topic has a state of its own,
    it has the last message of each connection: latched topics, and transforms, which several
    nodes publish on /tf. Of /tf_static it has every message, since they add to each other.
    """

    def __init__(self, index: BagIndex, topics: Optional[Iterable[str]] = None) -> None:
        """Take an index and the topics that count, all of them without ``topics``."""
        wanted = None if topics is None else frozenset(topics)
        self._index = index
        self._groups: Dict[Group, List[int]] = {}
        for number, connection in enumerate(index.connections):
            if wanted is None or connection.topic in wanted:
                self._groups.setdefault(_group(number, connection), []).append(number)

    def positions(self, count: int) -> List[int]:
        """Return the positions (rising) of the messages that are the scene after ``count`` ones.

        /tf_static is not among them: see ``static_positions``.
        """
        found = [self._last(numbers, count) for (topic, _), numbers in self._groups.items()
                 if topic != STATIC_TOPIC]
        return sorted(position for position in found if position is not None)

    def replaced(self, position: int) -> Optional[int]:
        """Return the position of the message that the one at a position takes the place of."""
        number = int(self._index.connection[position])
        return self._last(self._groups[_group(number, self._index.connections[number])], position)

    def static_positions(self, count: int) -> List[int]:
        """Return the positions (rising) of the messages on /tf_static among the first ``count``."""
        numbers = [number for (topic, _), group in self._groups.items() if topic == STATIC_TOPIC
                   for number in group]
        positions = self._index.positions_of(numbers)
        return [int(position) for position in positions[:np.searchsorted(positions, count)]]

    def absent_topics(self, count: int) -> List[str]:
        """Return the topics that had no message among the first ``count``, in sorted order."""
        present = {topic for (topic, _), numbers in self._groups.items()
                   if self._last(numbers, count) is not None}
        return sorted({topic for topic, _ in self._groups} - present)

    def _last(self, numbers: Iterable[int], count: int) -> Optional[int]:
        lasts = [self._index.last_before(count, number) for number in numbers]
        return max((last for last in lasts if last is not None), default=None)


def _group(number: int, connection: Connection) -> Group:
    """Connections of one group replace each other's messages."""
    of_its_own = connection.latching or connection.type in _TRANSFORMS
    return connection.topic, number if of_its_own else -1
