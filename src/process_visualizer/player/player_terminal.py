# SPDX-License-Identifier: BSD-3-Clause
"""The player in a terminal: progress line and keys."""
from __future__ import annotations

import os
import sys
import threading
import unicodedata
from types import TracebackType
from typing import Callable, Dict, List, NamedTuple, Optional, TextIO, Type

from process_visualizer.playback.player_control import PlayerControl, PlayerStatus
from process_visualizer.playback.timeline import CommandRefused, faster, format_time, slower
from process_visualizer.player.keyboard import Keyboard, in_foreground
from process_visualizer.player.player_options import KEY_HELP, Command, KeyAction, key_action

_BAR_CELLS = 40
_MIN_BAR_CELLS = 8
_MAX_LABEL = 24
_VISIBLE_SHARE = 0.95  # share of the rate; the achieved rate is shown only below it


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


def progress_line(progress: PlayerStatus, width: int, symbols: Symbols = UNICODE) -> str:
    """Return one line of at most `width` columns; a narrow line has less information.

    The loop's ends are marked A and B in the bar.
    """
    line = f' {_state(progress, symbols)} {_times(progress)}'
    for part in [_rates(progress, symbols), _dropped(progress), _mark(progress, symbols)]:
        if part and len(line) + 2 + len(part) <= width:
            line += '  ' + part
    cells = min(width - len(line) - 4, _BAR_CELLS)
    if cells >= _MIN_BAR_CELLS:
        line += f'  [{_bar(progress, cells)}]'
    return line[:max(width, 0)]


def _state(progress: PlayerStatus, symbols: Symbols) -> str:
    if progress.paused:
        return symbols.paused
    return symbols.forward if progress.rate > 0 else symbols.backward


def _times(progress: PlayerStatus) -> str:
    """Return position and end in a constant number of columns, so that nothing moves."""
    end = format_time(progress.duration_s)
    return f'{format_time(progress.position_s).rjust(len(end))} / {end}'


def _rates(progress: PlayerStatus, symbols: Symbols) -> str:
    rate = f'{progress.rate:.3g}{symbols.times}'
    if progress.paused or abs(progress.achieved_rate) >= _VISIBLE_SHARE * abs(progress.rate):
        return rate
    reached = round(progress.achieved_rate, 3) + 0.0  # no -0
    return f'{rate} ({reached:.3g}{symbols.times} reached)'


def _dropped(progress: PlayerStatus) -> str:
    return f'{progress.dropped} dropped' if progress.dropped > 0 else ''


def _mark(progress: PlayerStatus, symbols: Symbols) -> str:
    """Return the beginning of the label; characters not one column wide become "?"."""
    shown = ''.join(it if _is_shown(it, symbols) else '?'
                    for it in progress.mark[:_MAX_LABEL].replace('\n', ' '))
    return f'"{shown}"' if shown else ''


def _is_shown(character: str, symbols: Symbols) -> bool:
    if character.isascii():
        return character.isprintable()
    return symbols is UNICODE and unicodedata.category(character)[0] in 'LNPS' \
        and unicodedata.east_asian_width(character) not in 'WF'


def _bar(progress: PlayerStatus, cells: int) -> str:
    filled = round(_share(progress.position_s, progress) * cells)
    bar: List[str] = ['#'] * filled + ['-'] * (cells - filled)
    for mark, time_s in zip('AB', progress.loop or ()):
        bar[round(_share(time_s, progress) * (cells - 1))] = mark
    return ''.join(bar)


def _share(time_s: float, progress: PlayerStatus) -> float:
    if progress.duration_s <= 0:
        return 0.0
    return min(max(time_s / progress.duration_s, 0.0), 1.0)


PERIOD_S = 0.1
_CLEAR_LINE = '\r\x1b[K'


class TerminalCommands:
    """The commands of the keys: those of the player, and some that depend on its status."""

    def __init__(self, control: PlayerControl) -> None:
        """Take the player's commands."""
        self._control = control
        self._loop_begin_s = 0.0
        self._by_command: Dict[Command, Callable[[int], str]] = {
            Command.TOGGLE_PAUSED: lambda _: control.toggle_paused(),
            Command.STEP: control.step,
            Command.SEEK_BY: lambda amount: control.seek_by(float(amount)),
            Command.SEEK_TO_BEGIN: lambda _: control.seek(0.0),
            Command.SEEK_TO_END: lambda _: control.seek(control.status().duration_s),
            Command.FASTER: lambda _: control.set_rate(faster(control.status().rate)),
            Command.SLOWER: lambda _: control.set_rate(slower(control.status().rate)),
            Command.REVERSE: lambda _: control.set_rate(-control.status().rate),
            Command.TOGGLE_LOOP: lambda _: control.set_loop(control.status().loop is None),
            Command.TOGGLE_PAUSE_TOPICS: lambda _: control.toggle_pause_topics(),
            Command.LOOP_BEGIN: lambda _: self._begin_loop(),
            Command.LOOP_END: lambda _: self._end_loop(),
            Command.HELP: lambda _: KEY_HELP,
        }

    def perform(self, action: KeyAction) -> str:
        """Carry out the command of a key; return what was done, or why it was refused."""
        try:
            return self._by_command[action.command](action.amount)
        except CommandRefused as refusal:
            return str(refusal)

    def _begin_loop(self) -> str:
        self._loop_begin_s = self._control.status().position_s
        return f'the loop will begin at {self._loop_begin_s:.3f} s: b sets its end'

    def _end_loop(self) -> str:
        return self._control.set_loop(True, self._loop_begin_s, self._control.status().position_s)


class Screen:
    """The output of a program: a terminal, or a file."""

    def __init__(self, output: TextIO) -> None:
        """Take the stream to write to."""
        self._output = output
        self.is_terminal = output.isatty()
        self.encoding = output.encoding

    def width(self) -> Optional[int]:
        """Return the number of columns; None while another program is in the foreground."""
        if not in_foreground(self._output.fileno()):
            return None
        return os.get_terminal_size(self._output.fileno()).columns

    def write(self, text: str) -> None:
        """Write and flush."""
        self._output.write(text)
        self._output.flush()


class PlayerTerminal:
    """A terminal in a ``with``: shows the position of playback, carries out the keys' commands."""

    def __init__(self, status: Callable[[], PlayerStatus], control: PlayerControl,
                 quit_player: Callable[[], None], quiet: bool,
                 keyboard: Optional[Keyboard] = None, screen: Optional[Screen] = None) -> None:
        """``status`` returns the position of playback, ``quit_player`` ends the player."""
        self._status = status
        self._commands = TerminalCommands(control)
        self._quit = quit_player
        self._screen = screen or Screen(sys.stdout)
        self._shown = not quiet and self._screen.is_terminal
        self._symbols = symbols_for(self._screen.encoding)
        self._keyboard = keyboard or Keyboard()
        self._ended = threading.Event()
        self._threads: List[threading.Thread] = []

    def __enter__(self) -> PlayerTerminal:
        """Start using the terminal."""
        self._keyboard.__enter__()
        for work in (self.read_keys, self._show_repeatedly):
            self._threads.append(threading.Thread(target=work, name='terminal', daemon=True))
            self._threads[-1].start()
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Restore the terminal."""
        self._ended.set()
        self._keyboard.__exit__(kind, error, traceback)
        for thread in self._threads:
            thread.join()
        if self._shown:
            self._screen.write('\n')

    def read_keys(self) -> None:
        """Carry out the commands of the keys, until the keyboard stops or a key ends the player."""
        for key in iter(self._keyboard.read_key, None):
            action = key_action(key)
            if action is None:
                continue
            if action.command is Command.QUIT:
                self._quit()
                return
            answer = self._commands.perform(action)
            if self._shown and ('\n' in answer or not action.command.value.startswith('seek')):
                self._screen.write(f'{_CLEAR_LINE}{answer}\n')

    def show(self) -> None:
        """Show the position, if this program is in the foreground."""
        width = self._screen.width() if self._shown else None
        if width is not None:
            line = progress_line(self._status(), width - 1, self._symbols)
            self._screen.write(_CLEAR_LINE + line)

    def _show_repeatedly(self) -> None:
        while not self._ended.wait(PERIOD_S):
            self.show()
