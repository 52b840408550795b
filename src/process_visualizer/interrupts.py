# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C while a program is being loaded."""
from __future__ import annotations

import signal
from contextlib import contextmanager
from typing import Iterator


@contextmanager
def silent_interrupts() -> Iterator[None]:
    """Let Ctrl-C end the process silently, as the signal itself does (a shell says 130).

    To be entered before a program's modules are loaded, which takes a second where the machine is
    busy: Python would print where it was. A program that has to clean up has handlers of its own,
    which hold from when it sets them.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is to be ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    yield
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
