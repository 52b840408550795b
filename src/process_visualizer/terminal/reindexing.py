# SPDX-License-Identifier: BSD-3-Clause
"""Makes an indexed copy of a bag in the terminal: asks, shows progress, can be cancelled."""
from __future__ import annotations

import os
import sys
import time

from process_visualizer.bags.reindex import ReindexCancelled, copy_path, reindex
from process_visualizer.shown_text import say

_PERIOD_S = 0.2


class ReindexRefused(Exception):
    """The user refused to copy a bag without an index, or cancelled it."""


def reindexed(path: str, reason: str, allowed: bool) -> str:
    """Return the path of a copy of a bag with an index; the bag itself is only read.

    A copy that is newer than the bag is used as it is.

    Raises:
        ReindexRefused: the user does not want it.
        BagError: the bag holds nothing that can be copied, or the copy cannot be written.
    """
    copy = copy_path(path)
    if os.path.exists(copy) and os.path.getmtime(copy) >= os.path.getmtime(path):
        say(f'{reason}: playing {copy}', file=sys.stderr)
        return copy
    if not allowed and not _agreed(reason, copy):
        raise ReindexRefused(f'{reason}; bag_player --reindex {path} makes {copy} and plays it')
    try:
        result = reindex(path, _Progress(copy).show)
    except (ReindexCancelled, KeyboardInterrupt):
        raise ReindexRefused(f'{path}: the copy was cancelled') from None
    say(f'{result.path}: {result.message_count} messages', file=sys.stderr)
    for gap in result.gaps:
        say(gap, file=sys.stderr)
    return result.path


def _agreed(reason: str, copy: str) -> bool:
    if not sys.stdin.isatty():
        return False
    say(f'{reason}.\nWrite an indexed copy to {copy} and play that? [Y/n] ', end='',
        file=sys.stderr)
    return sys.stdin.readline().strip().lower() in ('', 'y', 'yes')


class _Progress:
    """A line that is rewritten from time to time."""

    def __init__(self, copy: str) -> None:
        self._copy = copy
        self._next_s = 0.0

    def show(self, part: float) -> bool:
        """Show the finished part; the copying continues."""
        now_s = time.monotonic()
        if now_s >= self._next_s or part >= 1.0:
            self._next_s = now_s + _PERIOD_S
            end = '\n' if part >= 1.0 else '\r'
            say(f'{self._copy}: {100 * part:3.0f} %  (Ctrl-C cancels)', end=end,
                file=sys.stderr)
        return True
