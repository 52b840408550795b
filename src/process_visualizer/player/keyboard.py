# SPDX-License-Identifier: BSD-3-Clause
"""Keys pressed in the terminal, one by one, while a program runs in its foreground.

Needs no ROS. Only a process in the foreground uses the terminal. A process in the background
(started with "&" or by roslaunch, or sent there by Ctrl-Z and "bg") keeps running and reads nothing
until "fg".
"""
from __future__ import annotations

import codecs
import errno
import os
import re
import select
import signal
import termios
import threading
import tty
import weakref
from collections import deque
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Callable, Deque, Dict, Iterator, List, Optional, Sequence, Type

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
        """Return the unfinished key when no more input comes: escape, or an unknown key."""
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
        """Take the file descriptor of the terminal, by default standard input."""
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
        """Take the terminal, if there is one and this process is in its foreground."""
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
