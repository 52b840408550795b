# SPDX-License-Identifier: BSD-3-Clause
"""The unit of a playback step: a message, a message of one topic, or a time."""
from __future__ import annotations

from typing import NamedTuple


class StepUnit(NamedTuple):
    """A message of a topic ('' for any), or, where it is not 0, a time [s]."""

    topic: str = ''
    duration_s: float = 0.0

    @property
    def label(self) -> str:
        """Return what the operator reads."""
        if self.duration_s:
            return f'{1000 * self.duration_s:g} ms'
        return self.topic or 'message'


MESSAGE = StepUnit()
TIMES = (StepUnit(duration_s=0.01), StepUnit(duration_s=0.1), StepUnit(duration_s=1.0))
