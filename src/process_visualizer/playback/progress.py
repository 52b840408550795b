# SPDX-License-Identifier: BSD-3-Clause
"""Progress of playback, for display."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple


class Progress(NamedTuple):
    """Progress of playback; times in seconds from the beginning of the recording."""

    position_s: float
    duration_s: float
    rate: float
    achieved_rate: float
    paused: bool
    loop: Optional[Tuple[float, float]] = None  # begin, end [s]
    dropped: int = 0  # messages
    mark: str = ''  # label of the last one
