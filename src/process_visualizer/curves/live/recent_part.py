# SPDX-License-Identifier: BSD-3-Clause
"""Messages out of a recorder's memory."""
from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from process_visualizer.messages.connection import Connection

HEADER_BYTES = 16
"""Of a record: what stands before the message."""


class RecentPart(NamedTuple):
    """Messages as the recorder hands them out, in the order in which they came.

    One row per message: the number of its connection, when it arrived [ns since the epoch], and
    where its record begins and ends in the buffer (uint8).
    """

    is_anew: bool  # the recorder has begun anew: what came before does not count
    connections: Tuple[Connection, ...]  # all that there are, by number
    now_ns: int  # the recorder's time [ns since the epoch]
    numbers: np.ndarray
    times_ns: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    buffer: np.ndarray

    def message(self, row: int) -> bytes:
        """Return the bytes of a message."""
        data: bytes = self.buffer[int(self.begin[row]) + HEADER_BYTES:int(self.end[row])].tobytes()
        return data
