# SPDX-License-Identifier: BSD-3-Clause
"""Events as text, in a window or beside a bag."""
from __future__ import annotations

import time
from typing import Sequence

from process_visualizer.health.alarm_board import Event


def events_text(events: Sequence[Event]) -> str:
    """Return a line for each event: local date and time, and what happened."""
    return '\n'.join(f'{_moment(event.time_s)}  {event.text}' for event in events)


def _moment(time_s: float) -> str:
    return time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(time_s))
