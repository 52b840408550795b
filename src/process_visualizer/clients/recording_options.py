# SPDX-License-Identifier: BSD-3-Clause
"""Options of a recording, and the errors of the recorder."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple


class RecorderError(Exception):
    """The recorder refused or could not do something; the text says why, and what to do."""


class RecorderUnreachable(RecorderError):
    """The recorder, or the master that knows its address, cannot be reached."""


@dataclass(frozen=True)
class RecordingOptions:
    """Options of a recording; by default the recorder's parameters.

    The bag is named ``NAME.bag``, without a name ``PREFIX_DATE.bag`` or ``DATE.bag`` (local date
    and time). Topics that match one of the ``patterns`` (regular expressions for whole names), and
    none of ``excluded``, are recorded as soon as they are published. With ``recent_s`` the bag
    begins with the last seconds that the recorder has in memory.
    """

    topics: Tuple[str, ...] = ()
    folder: str = ''
    prefix: str = ''
    name: str = ''
    compression: str = 'none'
    split_bytes: int = 0
    split_duration_s: float = 0.0
    configuration: str = ''
    recent_s: float = 0.0
    patterns: Tuple[str, ...] = ()
    excluded: Tuple[str, ...] = ()
