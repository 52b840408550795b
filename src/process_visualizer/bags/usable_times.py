# SPDX-License-Identifier: BSD-3-Clause
"""Tells times at which nothing can have been recorded from the others, and leaves them out.

A message has time 0 if its writer knew none, and one of 1970 or 2106 if its clock was wrong. Among
the others it would make a recording of decades of which nearly all is empty.
"""
from __future__ import annotations

from typing import Callable, Iterator, List, Tuple

import numpy as np

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.bag_index import MAX_UNSET_NS, BagIndex, Columns, Strays
from process_visualizer.messages.connection import Connection
from process_visualizer.ros_names import STATIC_TF_TOPIC

_MAX_PAUSE_NS = 7 * 24 * 3600 * 1_000_000_000
"""No recording pauses for longer."""
_MAX_FROM_ZERO_NS = 10 * 1_000_000_000
"""Simulated time may begin at 0; if nothing follows for so long, that stands for no time."""
_MAX_LOOKS = 100_000


def with_usable_times(index: BagIndex, own_time_ns: Callable[[int], int]) -> BagIndex:
    """Return the index of a file without messages whose times are far from most others.

    The index may say another time of a message than its record does, which counts then:
    ``own_time_ns`` reads it, of the message at a position (BagDamaged if it cannot be). What is
    latched, and /tf_static, holds whenever it came: it is there from the beginning on. Gaps with
    such times are at an unknown time (0).
    """
    first_ns, last_ns = _span(index.time_ns)
    doubtful = np.flatnonzero((index.time_ns <= MAX_UNSET_NS)
                              | ~_inside(index.time_ns, first_ns, last_ns))
    if len(doubtful):
        index = _corrected(index, doubtful[:_MAX_LOOKS], own_time_ns)
        first_ns, last_ns = _span(index.time_ns)
    rows = _inside(index.time_ns, first_ns, last_ns)
    gaps = [it if not len(index) or _inside(np.array([it.begin_ns, it.end_ns]),
                                            first_ns - _MAX_PAUSE_NS, last_ns + _MAX_PAUSE_NS).all()
            else it._replace(begin_ns=0, end_ns=0) for it in index.gaps]
    if rows.all() and gaps == list(index.gaps):
        return index
    holds = np.array([_holds(it) for it in index.connections], bool)[index.connection] & ~rows
    columns = Columns(*(np.concatenate((column[holds], column[rows])) for column in index.columns))
    columns.time_ns[:np.count_nonzero(holds)] = first_ns
    return BagIndex(index.connections, columns, index.chunks, gaps, _strays(index, ~rows))


def _span(time_ns: np.ndarray) -> Tuple[int, int]:
    """The first and the last of rising times that belong together: most of them, or else all."""
    if not len(time_ns):
        return 0, 0
    zeros = int(np.searchsorted(time_ns, MAX_UNSET_NS, side='right'))
    if zeros == len(time_ns) or time_ns[zeros] <= _MAX_FROM_ZERO_NS:
        zeros = 0
    known = time_ns[zeros:]
    bounds = [0, *(np.flatnonzero(np.diff(known) > _MAX_PAUSE_NS) + 1).tolist(), len(known)]
    count, begin = max((end - begin, begin) for begin, end in zip(bounds, bounds[1:]))
    if 2 * count <= len(known):
        return int(time_ns[0]), int(time_ns[-1])
    return int(known[begin]), int(known[begin + count - 1])


def _inside(time_ns: np.ndarray, first_ns: int, last_ns: int) -> np.ndarray:
    inside: np.ndarray = (time_ns >= first_ns) & (time_ns <= last_ns)
    return inside


def _corrected(index: BagIndex, positions: np.ndarray,
               own_time_ns: Callable[[int], int]) -> BagIndex:
    """The index with the times that some messages have themselves."""
    time_ns = index.time_ns.copy()
    for position in positions.tolist():
        try:
            time_ns[position] = own_time_ns(position)
        except BagDamaged:
            continue  # whoever reads the message is told
    if np.array_equal(time_ns, index.time_ns):
        return index
    return BagIndex(index.connections, index.columns._replace(time_ns=time_ns), index.chunks,
                    index.gaps)


def _holds(connection: Connection) -> bool:
    return connection.latching or connection.topic.endswith(STATIC_TF_TOPIC)


def _strays(index: BagIndex, rows: np.ndarray) -> Iterator[Strays]:
    for topic in sorted({it.topic for it in index.connections}):
        numbers: List[int] = list(index.connections_of(topic))
        times_ns = index.time_ns[rows & np.isin(index.connection, numbers)]
        unset = int(np.searchsorted(times_ns, MAX_UNSET_NS, side='right'))
        for part in filter(len, (times_ns[:unset], times_ns[unset:])):
            yield Strays(topic, len(part), int(part[0]), int(part[-1]),
                         any(_holds(index.connections[number]) for number in numbers))
