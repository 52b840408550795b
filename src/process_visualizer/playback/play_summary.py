# SPDX-License-Identifier: BSD-3-Clause
"""A summary of what was not played, for the terminal."""
from __future__ import annotations

from typing import Mapping, Sequence, Tuple

_MOST_LINES = 20


def play_summary(left_out: Mapping[str, int], recorded: Mapping[str, int],
                 problems: Sequence[str], dropped: int) -> Tuple[str, ...]:
    """Return it as lines, none where all was played and has arrived.

    Args:
        left_out: how many messages of each topic could not be played.
        recorded: how many messages each of these topics has in the recording.
        problems: why, and what else went wrong.
        dropped: how many messages slow subscribers did not get.
    """
    lines = [f'{topic}: {count} of {recorded[topic]} messages could not be played'
             for topic, count in sorted(left_out.items())]
    lines += problems[:_MOST_LINES]
    if len(problems) > _MOST_LINES:
        lines.append(f'and {len(problems) - _MOST_LINES} more such problems')
    if dropped:
        lines.append(f'{dropped} messages did not reach subscribers that were too slow for them; '
                     'a longer --queue or a lower rate helps')
    return tuple(lines)


def printable(text: str) -> str:
    """Return a text that can be sent: a file's name need not be UTF-8."""
    return text.encode('utf-8', 'surrogateescape').decode('utf-8', 'replace')
