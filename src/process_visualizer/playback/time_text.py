# SPDX-License-Identifier: BSD-3-Clause
"""Times of a recording as text."""
from __future__ import annotations


def format_time(seconds: float) -> str:
    """Return a time as m:ss.mmm, or h:mm:ss.mmm from an hour on, rounded to milliseconds."""
    total_ms = round(abs(seconds) * 1000)
    minutes, milliseconds = divmod(total_ms, 60_000)
    hours, minutes = divmod(minutes, 60)
    sign = '-' if seconds < 0 and total_ms else ''
    start = f'{hours}:{minutes:02}' if hours else f'{minutes}'
    return f'{sign}{start}:{milliseconds // 1000:02}.{milliseconds % 1000:03}'
