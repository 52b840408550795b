# SPDX-License-Identifier: BSD-3-Clause
"""Handling of Ctrl-C while a program is being loaded."""
from __future__ import annotations

import signal
from contextlib import contextmanager
from typing import Iterator


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
