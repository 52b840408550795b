# SPDX-License-Identifier: BSD-3-Clause
"""The line that a terminal shows while a recording is played."""
from __future__ import annotations

import unicodedata
from typing import List, NamedTuple, Optional

from process_visualizer.playback.progress import Progress
from process_visualizer.playback.time_text import format_time

_BAR_CELLS = 40
_FEWEST_BAR_CELLS = 8
_LONGEST_LABEL = 24
_VISIBLE_SHARE = 0.95  # of the rate: a higher achieved share is not shown


class Symbols(NamedTuple):
    """Symbols of the state, each in the same number of columns."""

    forward: str
    backward: str
    paused: str
    times: str


UNICODE = Symbols('▶', '◀', '⏸', '×')
ASCII = Symbols('> ', '< ', '||', 'x')


def symbols_for(encoding: Optional[str]) -> Symbols:
    """Return the symbols that a stream of an encoding (None: unknown) can show."""
    try:
        ''.join(UNICODE).encode(encoding or 'ascii')
    except (UnicodeEncodeError, LookupError):
        return ASCII
    return UNICODE


def progress_line(progress: Progress, width: int, symbols: Symbols = UNICODE) -> str:
    """Return one line of at most `width` columns; a narrow one has less information.

    The loop's ends are marked A and B in the bar.
    """
    line = f' {_state(progress, symbols)} {_times(progress)}'
    for part in [_rates(progress, symbols), _dropped(progress), _mark(progress, symbols)]:
        if part and len(line) + 2 + len(part) <= width:
            line += '  ' + part
    cells = min(width - len(line) - 4, _BAR_CELLS)
    if cells >= _FEWEST_BAR_CELLS:
        line += f'  [{_bar(progress, cells)}]'
    return line[:max(width, 0)]


def _state(progress: Progress, symbols: Symbols) -> str:
    if progress.paused:
        return symbols.paused
    return symbols.forward if progress.rate > 0 else symbols.backward


def _times(progress: Progress) -> str:
    """Position and end, in equally many columns so that nothing moves."""
    end = format_time(progress.duration_s)
    return f'{format_time(progress.position_s).rjust(len(end))} / {end}'


def _rates(progress: Progress, symbols: Symbols) -> str:
    rate = f'{progress.rate:.3g}{symbols.times}'
    if progress.paused or abs(progress.achieved_rate) >= _VISIBLE_SHARE * abs(progress.rate):
        return rate
    reached = round(progress.achieved_rate, 3) + 0.0  # so that there is no -0
    return f'{rate} ({reached:.3g}{symbols.times} reached)'


def _dropped(progress: Progress) -> str:
    return f'{progress.dropped} dropped' if progress.dropped > 0 else ''


def _mark(progress: Progress, symbols: Symbols) -> str:
    """The beginning of the label; characters that are not one column wide become "?"."""
    shown = ''.join(it if _is_shown(it, symbols) else '?'
                    for it in progress.mark[:_LONGEST_LABEL].replace('\n', ' '))
    return f'"{shown}"' if shown else ''


def _is_shown(character: str, symbols: Symbols) -> bool:
    if character.isascii():
        return character.isprintable()
    return symbols is UNICODE and unicodedata.category(character)[0] in 'LNPS' \
        and unicodedata.east_asian_width(character) not in 'WF'


def _bar(progress: Progress, cells: int) -> str:
    filled = round(_share(progress.position_s, progress) * cells)
    bar: List[str] = ['#'] * filled + ['-'] * (cells - filled)
    for mark, time_s in zip('AB', progress.loop or ()):
        bar[round(_share(time_s, progress) * (cells - 1))] = mark
    return ''.join(bar)


def _share(time_s: float, progress: Progress) -> float:
    if progress.duration_s <= 0:
        return 0.0
    return min(max(time_s / progress.duration_s, 0.0), 1.0)
