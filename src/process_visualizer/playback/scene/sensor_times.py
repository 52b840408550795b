# SPDX-License-Identifier: BSD-3-Clause
"""Messages of sensors by the times at which they were measured, which are their stamps."""
from __future__ import annotations

from functools import lru_cache
from typing import Dict, Iterator, List, Optional, Tuple

import numpy as np

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.playback.scene.message_loader import MessageLoader, first_stamp_ns
from process_visualizer.ros_names import SENSOR_TYPES

FARTHEST_NS = 200_000_000
"""How much later [bag ns] a message is passed at most; stamps that are older count for nothing."""
_NEAR_NS = 25_000_000  # so soon after a moment a message will do for it, else the one before
_BLOCK = 128  # messages for which it is found together
_STAMPS_KEPT = 4096


class SensorTimes:
    """Times at which messages of sensors are passed backwards.

    When a message is passed backwards, the picture before it becomes visible again. That was taken
    a while before, and the robot is where the picture has it only when the position comes to its
    stamp; until then that moment is in the future, and nothing may be stamped so. So the message
    is passed only then. May be used by several threads.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader) -> None:
        """Take the index and the loader of a recording."""
        self._index = index
        self._loader = loader
        self._sensors: List[np.ndarray] = []
        self._of_connection: Dict[int, np.ndarray] = {}
        for numbers in _sensors(index).values():
            self._sensors.append(index.positions_of(numbers))
            self._of_connection.update(dict.fromkeys(numbers, self._sensors[-1]))
        self._stamp_ns = lru_cache(maxsize=_STAMPS_KEPT)(self._read_stamp_ns)
        self._block = lru_cache(maxsize=4)(self._read_block)

    def passed_with(self, position: int) -> List[int]:
        """Return the positions (falling) of what is passed with the message at a position.

        One of a sensor is passed with itself or with an earlier one, any other with itself.
        """
        found = self._block(position // _BLOCK).get(position, [])
        is_sensors = int(self._index.connection[position]) in self._of_connection
        return found if is_sensors else [*found, position]

    def _read_block(self, number: int) -> Dict[int, List[int]]:
        begin, end = number * _BLOCK, min((number + 1) * _BLOCK, len(self._index))
        found: Dict[int, List[int]] = {}
        for position, place in self._places(begin, int(self._index.time_ns[end - 1])):
            if begin <= place < end:
                found.setdefault(place, []).append(position)
        return found

    def _places(self, begin: int, until_ns: int) -> Iterator[Tuple[int, int]]:
        """With which message each of sensors is passed, from the position ``begin`` on, falling.

        Nothing is missing that is passed with a message up to a bag time [ns].
        """
        end = self._index.count_until(until_ns + FARTHEST_NS + _NEAR_NS)
        for positions in self._sensors:
            place, found = end, _between(positions, begin, end)
            visible = [_before(positions, begin), *found]
            for position, before in zip(found[::-1], visible[-2::-1]):
                place = min(place, self._place(position, before))
                yield position, place

    def _place(self, position: int, visible: int) -> int:
        """With which message one is passed, so that another one becomes visible again."""
        stamp_ns, time_ns = self._stamp_ns(visible), self._index.time_ns
        latest_ns = int(time_ns[position]) - 1
        if stamp_ns is None or stamp_ns >= latest_ns:
            return position
        moment_ns = max(stamp_ns, latest_ns - FARTHEST_NS)
        after = self._index.count_until(moment_ns)  # passed just before the moment
        is_near = after > 0 and moment_ns - int(time_ns[after - 1]) <= _NEAR_NS
        return after - 1 if is_near else after

    def _read_stamp_ns(self, position: int) -> Optional[int]:
        """The stamp of a message; None if it says nothing about when it was measured."""
        message = self._loader.load(position)
        stamp_ns = None if message is None else first_stamp_ns(message)
        too_old_ns = int(self._index.time_ns[position]) - FARTHEST_NS
        return None if stamp_ns is None or stamp_ns < too_old_ns else stamp_ns


def _between(positions: np.ndarray, begin: int, end: int) -> List[int]:
    """Those of some rising positions from one on that are before another one."""
    # numbers of another type would make numpy convert all positions first
    first, behind = positions.searchsorted(np.array([begin, end], positions.dtype))
    return [int(position) for position in positions[first:behind]]


def _before(positions: np.ndarray, position: int) -> int:
    """The last of some rising positions before one; the first of them where there is none."""
    return int(positions[max(int(positions.searchsorted(positions.dtype.type(position))) - 1, 0)])


def _sensors(index: BagIndex) -> Dict[str, List[int]]:
    """The connections of each topic on which sensors send."""
    found: Dict[str, List[int]] = {}
    for number, connection in enumerate(index.connections):
        is_sensors = connection.type in SENSOR_TYPES and not connection.latching
        if is_sensors and len(index.positions(number)):
            found.setdefault(connection.topic, []).append(number)
    return found
