# SPDX-License-Identifier: BSD-3-Clause
"""Errors in bags, worded so that users know where the error is and what to do."""
from __future__ import annotations

from datetime import datetime
from typing import NamedTuple, Tuple


class Gap(NamedTuple):
    """A part of a recording that cannot be played.

    ``offset`` is the byte of the file where the gap begins; the times [ns since the epoch] are
    those of its first and last message (0 if unknown); ``topics`` are the topics it affects.
    """

    file: str
    offset: int
    begin_ns: int
    end_ns: int
    topics: Tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        times = 'an unknown time' if not self.end_ns else \
            f'{_clock(self.begin_ns)} to {_clock(self.end_ns)}'
        topics = ', '.join(self.topics) or 'unknown'
        return (f'{self.file}: at byte {self.offset}: {self.reason}; '
                f'missing are the topics {topics} from {times}')


def _clock(time_ns: int) -> str:
    """Return the local date and time of a bag time [ns]."""
    seconds, rest_ns = divmod(time_ns, 1_000_000_000)
    return f'{datetime.fromtimestamp(seconds):%Y-%m-%d %H:%M:%S}.{rest_ns // 1_000_000:03d}'


class BagError(Exception):
    """Raised for a file that cannot be played as a bag; the message begins with its path."""

    def __init__(self, file: str, reason: str) -> None:
        super().__init__(f'{file}: {reason}')
        self.file = file
        self.reason = reason


class BagUnindexed(BagError):
    """Raised for a bag without a complete index (of a killed recorder); reindexing helps."""


class BagDamaged(BagError):
    """Raised if a part of a bag (``gap``) cannot be read; the rest can be played."""

    def __init__(self, gap: Gap) -> None:
        super().__init__(gap.file, gap.reason)
        self.args = (str(gap),)
        self.gap = gap


class RecordError(ValueError):
    """Raised for bytes that are not the expected record; converted to a BagError or a gap."""
