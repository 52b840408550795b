# SPDX-License-Identifier: BSD-3-Clause
"""Messages as a recorder returns them from its memory."""
from __future__ import annotations

from typing import Iterator, List, Tuple

import numpy as np

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.live_curves import RecentPart

HEADER = bytes([8, 0, 0, 0, 4, 0, 0, 0]) + b'op=\x02'


def part_of(connections: Tuple[Connection, ...], messages: List[Tuple[int, int, bytes]],
            now_ns: int, is_anew: bool = False) -> RecentPart:
    """A part with messages: number of the connection, time, bytes."""
    records = [HEADER + len(data).to_bytes(4, 'little') + data for *_, data in messages]
    end = np.cumsum([len(it) for it in records], dtype=np.int64)
    begin = end - np.array([len(it) for it in records], np.int64)
    return RecentPart(is_anew, connections, now_ns,
                      np.array([it[0] for it in messages], np.int64),
                      np.array([it[1] for it in messages], np.int64), begin, end,
                      np.frombuffer(b''.join(records), np.uint8))


def parts_of(path: str, step_s: float) -> Iterator[RecentPart]:
    """Yield the messages of a bag as they would arrive with a poll in each period."""
    with Recording([path]) as recording:
        index = recording.index
        rows = [(int(index.connection[it]), int(index.time_ns[it]), bytes(recording.message(it)))
                for it in range(len(index))]
        at_ns, begin = recording.begin_ns, 0
        while begin < len(rows):
            at_ns += int(step_s * 1e9)
            end = int(np.searchsorted(index.time_ns, at_ns))
            yield part_of(index.connections, rows[begin:end], at_ns)
            begin = end
