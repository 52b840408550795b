# SPDX-License-Identifier: BSD-3-Clause
"""The files of a recording that was split, such as NAME_0.bag and NAME_1.bag."""
from __future__ import annotations

import os
import re
from typing import List, Tuple

from process_visualizer.bags.recording import Recording

_PART = re.compile(r'(.*_)(\d+)(\.bag)\Z')
_LONGEST_PAUSE_NS = 2_000_000_000
"""Between two parts; slow topics have nothing to say for so long."""


def recording_parts(path: str) -> Tuple[str, ...]:
    """Return a bag and the parts behind it, each of which begins where the one before ends.

    Raises:
        BagError: a file cannot be read as a bag.
    """
    found: List[str] = [path]
    following = _following(path)
    while os.path.exists(following) and _goes_on(found[-1], following):
        found.append(following)
        following = _following(following)
    return tuple(found)


def _following(path: str) -> str:
    """The name of the next part; empty if the name has no number."""
    match = _PART.match(path)
    if match is None:
        return ''
    stem, number, suffix = match.groups()
    return f'{stem}{int(number) + 1:0{len(number)}}{suffix}'


def _goes_on(path: str, following: str) -> bool:
    with Recording([path]) as first, Recording([following]) as second:
        return abs(second.begin_ns - first.end_ns) <= _LONGEST_PAUSE_NS
