# SPDX-License-Identifier: BSD-3-Clause
"""The player in a terminal: progress line and keys.

Keys are read one by one while the program runs in the foreground of the terminal. In the background
(started with "&" or by roslaunch, or sent there by Ctrl-Z and "bg") it reads nothing until "fg".
"""
from __future__ import annotations

import codecs
import errno
import os
import re
import select
import signal
import sys
import termios
import threading
import tty
import unicodedata
import weakref
from collections import deque
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import (
    Any,
    Callable,
    Deque,
    Dict,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    TextIO,
    Type,
)

from process_visualizer.figures import clock_text
from process_visualizer.playback.player_control import PlayerControl, PlayerStatus
from process_visualizer.playback.timeline import (
    CommandRefused,
    faster,
    is_too_slow,
    slower,
)
from process_visualizer.player.player_options import KEY_HELP, Command, KeyAction, key_action

_BAR_CELLS = 40
_MIN_BAR_CELLS = 8
_MAX_LABEL = 24


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
    end = clock_text(progress.duration_s, 3)
    return f'{clock_text(progress.position_s, 3).rjust(len(end))} / {end}'


def _rates(progress: PlayerStatus, symbols: Symbols) -> str:
    rate = f'{progress.rate:.3g}{symbols.times}'
    if progress.paused or not is_too_slow(progress.rate, progress.achieved_rate):
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
        """Initialize with the player's commands."""
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
        """Initialize with the stream to write to."""
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


ESCAPE = 'escape'
UNKNOWN = 'unknown'

_NAMES: Dict[str, str] = {
    '[A': 'up', '[B': 'down', '[C': 'right', '[D': 'left', '[H': 'home', '[F': 'end',
    'OA': 'up', 'OB': 'down', 'OC': 'right', 'OD': 'left', 'OH': 'home', 'OF': 'end',
    '[1~': 'home', '[4~': 'end', '[7~': 'home', '[8~': 'end',
}
# After the escape: a control sequence, a shifted letter, or a key pressed with Alt.
_SEQUENCE = re.compile(r'\x1b(\[[0-?]{0,16}[ -/]{0,4}[@-~]|O[@-~]|[^\[O\x1b])', re.DOTALL)
_BEGINNING = re.compile(r'\x1b(\[[0-?]{0,16}[ -/]{0,4}|O)?\Z')


class KeyDecoder:
    """Names keys: a character by itself, left, right, up, down, home, end, escape, unknown.

    Sequences may come in any number of pieces.
    """

    def __init__(self) -> None:
        """Begin with nothing received."""
        self._text = ''
        self._decoder = codecs.getincrementaldecoder('utf-8')('replace')

    @property
    def is_waiting(self) -> bool:
        """Return whether the last input is an escape: a key, or the beginning of a sequence."""
        return bool(self._text)

    def feed(self, data: bytes) -> List[str]:
        """Return the keys that these bytes complete."""
        self._text += self._decoder.decode(data)
        keys: List[str] = []
        while self._text and not _BEGINNING.match(self._text):
            keys.append(self._next_key())
        return keys

    def flush(self) -> List[str]:
        """Return the unfinished key when no more input arrives: escape, or an unknown key."""
        keys = [ESCAPE if self._text == '\x1b' else UNKNOWN] if self._text else []
        self._text = ''
        return keys

    def _next_key(self) -> str:
        sequence = _SEQUENCE.match(self._text)
        if sequence:
            key = _NAMES.get(sequence.group(1), UNKNOWN)
        else:
            key = ESCAPE if self._text[0] == '\x1b' else self._text[0]
        self._text = self._text[sequence.end() if sequence else 1:]
        return key


_ESCAPE_MS = 50  # time for the rest of a sequence to arrive; after it, escape was the key
_BACKGROUND_MS = 1000  # polling period: no signal notifies a running process of "fg"

Wait = Callable[[Sequence[int], Optional[int]], List[int]]
"""Waits until files can be read, at most for a time [ms] (None: forever), and returns those."""


def wait_for_input(files: Sequence[int], patience_ms: Optional[int]) -> List[int]:
    """Wait for input, as defined by `Wait`."""
    poll = select.poll()
    for file in files:
        poll.register(file, select.POLLIN)
    return [file for file, _ in poll.poll(patience_ms)]


class Keyboard:
    """Keys from a terminal, without echo and without waiting for the end of a line.

    Use a keyboard in a `with` in the main thread, which handles the signals of Ctrl-Z and "fg". The
    terminal is restored on leaving, and while the process is stopped. Keys may be read in any one
    thread. The main thread must not wait forever in one call: a signal that arrives just before a
    wait is handled after it.
    """

    def __init__(self, terminal: int = 0, wait: Wait = wait_for_input) -> None:
        """Initialize with the file descriptor of the terminal, by default standard input."""
        self._terminal, self._wait = terminal, wait
        self._saved: Optional[List[Any]] = None  # attributes of the terminal while it is changed
        self._using = threading.RLock()  # for reading and its mode
        self._handlers: Dict[int, Any] = {}
        self._decoder = KeyDecoder()
        self._keys: Deque[str] = deque()
        self._tasks: Deque[Callable[[], None]] = deque()
        self._performing = False
        self._suspending = False
        self._stopped = False
        self._woken, self._wake = os.pipe()
        for end in (self._woken, self._wake):
            os.set_blocking(end, False)
            weakref.finalize(self, os.close, end)  # not while a thread still uses this object

    def __enter__(self) -> Keyboard:
        """Start to use the terminal, if there is one and this process is in its foreground."""
        self._main_thread = threading.get_ident()
        if os.isatty(self._terminal):
            self._handle(signal.SIGTSTP, self._suspend)
            self._handle(signal.SIGCONT, self._resume)
            self._perform(self._resume)
        else:
            self._stopped = True
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Stop the keys and restore the terminal and the signals."""
        self.stop()
        self._perform(self._release_terminal)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def stop(self) -> None:
        """Stop reading keys; may be called by any thread."""
        self._stopped = True
        self._interrupt()

    def read_key(self) -> Optional[str]:
        """Wait for a key, named as by KeyDecoder; None once stopped, or without a terminal."""
        while not self._stopped:
            if self._keys:
                return self._keys.popleft()
            self._keys.extend(self._receive())
        return None

    def _receive(self) -> List[str]:
        """Wait for input from the terminal, or for the wake-up."""
        files = [self._woken]
        foreground = in_foreground(self._terminal)
        if foreground and self._saved is None and not self._suspending:
            signal.pthread_kill(self._main_thread, signal.SIGCONT)  # takes the terminal
        elif foreground and self._saved is not None:
            files.append(self._terminal)
        ready = self._wait(files, self._patience_ms(foreground))
        if self._woken in ready:
            os.read(self._woken, 1024)
        if self._terminal in ready:
            return self._decoder.feed(self._read())
        return [] if ready else self._decoder.flush()

    def _patience_ms(self, foreground: bool) -> Optional[int]:
        if self._decoder.is_waiting:
            return _ESCAPE_MS
        return None if foreground else _BACKGROUND_MS

    def _read(self) -> bytes:
        """Return the typed bytes without waiting, even if the terminal has just been given away."""
        with self._using, _blocked(signal.SIGTTIN):
            if self._saved is None or not select.select([self._terminal], [], [], 0.0)[0]:
                return b''
            try:
                data = os.read(self._terminal, 1024)
            except OSError as error:
                if error.errno != errno.EIO:
                    raise
                return b''  # in the background, as the next check will show
        if not data:
            self._stopped = True  # the terminal was closed
        return data

    def _handle(self, number: signal.Signals, task: Callable[[], None]) -> None:
        """Handle a signal, unless it was ignored when this process was started."""
        def handler(_number: int, _frame: Optional[FrameType]) -> None:
            self._perform(task)
        if signal.getsignal(number) is not signal.SIG_IGN:
            self._handlers[number] = signal.signal(number, handler)

    def _perform(self, task: Callable[[], None]) -> None:
        """Change the terminal; a change interrupted by a signal is finished first."""
        self._tasks.append(task)
        while self._tasks and not self._performing:
            self._performing = True
            try:
                while self._tasks:
                    self._tasks.popleft()()
            finally:
                self._performing = False

    def _suspend(self) -> None:
        """Restore the terminal, then stop as if there were no handler."""
        self._suspending = True  # prevents a SIGCONT, which would undo this
        self._release_terminal()
        handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        signal.pthread_kill(self._main_thread, signal.SIGTSTP)
        signal.signal(signal.SIGTSTP, handler)
        self._suspending = False
        self._resume()  # the process does not stop if no shell could continue it

    def _resume(self) -> None:
        self._take_terminal()
        self._interrupt()

    def _take_terminal(self) -> None:
        if self._stopped or not in_foreground(self._terminal):
            return
        with self._using, _blocked(signal.SIGTTOU):
            if self._saved is None:
                self._saved = termios.tcgetattr(self._terminal)
            tty.setcbreak(self._terminal, termios.TCSANOW)

    def _release_terminal(self) -> None:
        """Restore the terminal, unless in the background: the process using it has restored it."""
        with self._using, _blocked(signal.SIGTTOU):
            if self._saved is not None and in_foreground(self._terminal):
                termios.tcsetattr(self._terminal, termios.TCSANOW, self._saved)
            self._saved = None

    def _interrupt(self) -> None:
        """Wake the reader; a full pipe wakes it as well."""
        try:
            os.write(self._wake, b'.')
        except BlockingIOError:
            return


def in_foreground(terminal: int) -> bool:
    """Return whether a file is this process's terminal, with the process in the foreground."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not a terminal, a terminal of another session, or a closed one
        return False


@contextmanager
def _blocked(number: signal.Signals) -> Iterator[None]:
    """Block a signal in this thread: terminal use then fails without stopping the process."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {number})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
