# SPDX-License-Identifier: BSD-3-Clause
"""How a recording is made, and how the recorder says no."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple


class RecorderError(Exception):
    """What the recorder refused or could not do; the text says why, and what to do."""


class RecorderUnreachable(RecorderError):
    """The recorder, or the master that knows its address, is not there."""


@dataclass(frozen=True)
class RecordingOptions:
    """How a recording is made; what is left out keeps the recorder's parameters.

    The bag is called ``NAME.bag``, without a name ``PREFIX_DATE.bag`` or ``DATE.bag`` (local date
    and time). What matches one of the ``patterns`` (regular expressions for whole names), and none
    that is ``excluded``, is recorded as soon as it is published. ``recent_s`` begins the bag with
    the last seconds that the recorder has in memory.
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
