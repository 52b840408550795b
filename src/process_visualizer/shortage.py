# SPDX-License-Identifier: BSD-3-Clause
"""Messages for a program that runs out of memory, threads or processes."""
from __future__ import annotations

import errno
import os
import sys
from contextlib import contextmanager
from typing import Iterator

_MEMORY = ('there is not enough memory; end other programs, or allow this one more '
           '(ulimit -v, or its memory group)')
_THREADS = ('no thread or process can be started; end other programs, or allow this one more '
            '(ulimit -u, ulimit -v, or its group of processes)')
_NO_THREAD = "can't start new thread"  # the text of Python's RuntimeError
_UNMAPPED = 'failed to map segment', 'cannot allocate memory'  # texts of the dynamic linker


def shortage_words(error: BaseException) -> str:
    """Return what is exhausted, and a remedy; empty if the error has another reason."""
    text = str(error).lower()
    number = error.errno if isinstance(error, OSError) else None
    if isinstance(error, MemoryError) or number == errno.ENOMEM or (
            isinstance(error, ImportError) and any(it in text for it in _UNMAPPED)) or (
            isinstance(error, SystemError) and 'exception set' in text):  # of a lost MemoryError
        return _MEMORY
    # A failed fork; a nonblocking output that is full has another error text.
    is_fork = isinstance(error, BlockingIOError) and error.strerror == os.strerror(errno.EAGAIN)
    if is_fork or (isinstance(error, RuntimeError) and _NO_THREAD in text):
        return _THREADS
    return ''


@contextmanager
def telling_shortages(program: str) -> Iterator[None]:
    """End the process with a sentence and exit code 1, not a traceback, if a resource is exhausted.

    Enter this context before a program's modules are loaded, which may need more than there is.
    """
    try:
        yield
    except Exception as error:
        words = shortage_words(error)
        if not words:
            raise
        print(f'{program}: {words}', file=sys.stderr, flush=True)
        sys.exit(1)
