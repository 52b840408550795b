# SPDX-License-Identifier: BSD-3-Clause
"""Signals that end a program: Ctrl-C while it is loading, and requests to stop."""
from __future__ import annotations

import signal
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Dict, Iterator, Optional, Type


@contextmanager
def silent_interrupts() -> Iterator[None]:
    """Let Ctrl-C end the process silently, as the signal itself does (exit code 130 in a shell).

    Enter this context before a program's modules are loaded, which takes a second on a busy machine
    and in which Python would print a traceback. A program that has to clean up sets its own
    handlers, which then apply.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it stays ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    yield
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)


_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end the command; SIGHUP only if nohup has not asked to ignore it."""


class StopRequested(Exception):
    """Raised if a signal asked the program to end."""


class StopSignals:
    """A context in which signals do not end the program, but are noted; the handlers are restored.

    Do in the context what must not be interrupted, such as starting and ending processes, and
    everything else in `raised`.
    """

    def __init__(self) -> None:
        """Leave all signals as they are, until the context is entered."""
        self._is_asked = self._raises = False
        self._previous: Dict[signal.Signals, Any] = {}

    def __enter__(self) -> StopSignals:
        for number in _STOP_SIGNALS:
            handler = signal.getsignal(number)
            if number is not signal.SIGHUP or handler is not signal.SIG_IGN:
                self._previous[number] = handler
                signal.signal(number, self._take)
        return self

    def __exit__(self, _kind: Optional[Type[BaseException]], _error: Optional[BaseException],
                 _place: Optional[TracebackType]) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    @contextmanager
    def raised(self) -> Iterator[None]:
        """Raise StopRequested at the first signal, at once if it has arrived; ignore later ones."""
        self._raises = True
        try:
            if self._is_asked:
                raise StopRequested
            yield
        finally:
            self._raises = False

    def _take(self, _number: int, _frame: Optional[FrameType]) -> None:
        is_first, self._is_asked = not self._is_asked, True
        if is_first and self._raises:
            raise StopRequested
