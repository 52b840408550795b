# SPDX-License-Identifier: BSD-3-Clause
"""Figures as text for people: sizes, counts, times, rates."""
from __future__ import annotations

import re

_THIN = '\u2009'
"""Thin space between thousands, and between a figure and its unit."""
_MAX_DAYS = 4
_OFTEN_HZ = 2.0  # a latched topic with a lower rate sends changes only
_UNITS = ('B', 'kB', 'MB', 'GB', 'TB')


def size_text(size_bytes: float) -> str:
    """Return a size in decimal units with three digits, such as 42.1 MB."""
    power = 0
    while size_bytes >= 999.5 and power < len(_UNITS) - 1:
        size_bytes /= 1000.0
        power += 1
    digits = 0 if power == 0 or size_bytes >= 99.95 else 1
    return f'{size_bytes:.{digits}f}{_THIN}{_UNITS[power]}'


def count_text(count: int, thing: str = '') -> str:
    """Return a count with its noun, in the plural if necessary, such as 18 230 messages."""
    number = f'{count:,}'.replace(',', _THIN)
    return f'{number} {thing}{"" if count == 1 else "s"}' if thing else number


def clock_text(seconds: float, decimals: int = 2) -> str:
    """Return a time as m:ss or, from one hour on, h:mm:ss, with decimals, such as 0:06.42."""
    per_s = 10 ** decimals
    minutes, rest = divmod(round(abs(seconds) * per_s), 60 * per_s)
    hours, minutes = divmod(minutes, 60)
    sign = '-' if seconds < 0.0 and (hours or minutes or rest) else ''
    begin = f'{hours}:{minutes:02d}' if hours else str(minutes)
    return f'{sign}{begin}:{rest // per_s:02d}' + (
        f'.{rest % per_s:0{decimals}d}' if decimals else '')


def clock_seconds(text: str) -> float:
    """Return the seconds of an elapsed time such as 7.4, 0:07.4 or 1:02:03; inverse of clock_text.

    Raises:
        ValueError: the text is not a time.
    """
    parts = text.split(':')
    if len(parts) > 3 or not all(re.fullmatch(r'\d+', it, re.ASCII) for it in parts[:-1]) \
            or not re.fullmatch(r'\d+(\.\d*)?', parts[-1], re.ASCII):
        raise ValueError(f'"{text}" is not a time; write seconds, or minutes and seconds such as '
                         '0:07.4')
    return sum(float(part) * 60.0 ** power for power, part in enumerate(reversed(parts)))


def long_time_text(seconds: float) -> str:
    """Return a time in its two largest units, such as 5 h 12 min."""
    minutes = int(seconds // 60)
    if minutes < 1:
        return f'{int(seconds)}{_THIN}s'
    if minutes < 60:
        return f'{minutes}{_THIN}min'
    if minutes < 48 * 60:
        return f'{minutes // 60}{_THIN}h {minutes % 60}{_THIN}min'
    days = minutes // (24 * 60)
    return f'{days}{_THIN}days' if days <= _MAX_DAYS else f'more than {_MAX_DAYS}{_THIN}days'


def rate_text(rate_hz: float) -> str:
    """Return a rate, such as 125 Hz, 7.5 Hz or 0.05 Hz."""
    if rate_hz >= 9.95 or rate_hz == 0.0:
        return f'{rate_hz:.0f}{_THIN}Hz'
    return f'{rate_hz:.1f}{_THIN}Hz' if rate_hz >= 0.995 else f'{rate_hz:.2g}{_THIN}Hz'


def live_rate_text(rate_hz: float, silence_s: float, is_latched: bool = False) -> str:
    """Return the rate of a topic, or the age of its last message if it sends nothing now.

    A latched topic sends only changes; its last message stays valid, however old it is.
    """
    if is_latched and rate_hz < _OFTEN_HZ:
        return 'latched'
    if rate_hz > 0.0:
        return rate_text(rate_hz)
    return f'last {long_time_text(silence_s)} ago' if silence_s >= 1.0 else 'just now'
