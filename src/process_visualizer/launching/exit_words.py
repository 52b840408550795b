# SPDX-License-Identifier: BSD-3-Clause
"""Words for the end of a process, the same everywhere."""
from __future__ import annotations

import signal
from typing import Optional


def exit_words(code: Optional[int]) -> str:
    """Return how a process with this exit code ended; below 0 it is the number of a signal."""
    if code is not None and code < 0:
        return f'killed by {_signal_words(-code)}'
    return f'ended with code {"unknown" if code is None else code}'


def _signal_words(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # one that has no name
        return f'signal {number}'
