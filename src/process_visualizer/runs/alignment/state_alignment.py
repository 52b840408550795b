# SPDX-License-Identifier: BSD-3-Clause
"""Two runs aligned by the order of their states, where the tools go to other places."""
from __future__ import annotations

from difflib import SequenceMatcher
from typing import List, Optional, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment, Means
from process_visualizer.runs.alignment.common_events import common_events
from process_visualizer.runs.alignment.time_map import time_map
from process_visualizer.runs.run import Run
from process_visualizer.runs.states import States, is_sequence, states

_FEWEST, _ALIKE = 4, 0.6


def aligned_by_states(reference: Run, run: Run) -> Optional[Alignment]:
    """Return the alignment at which states and events begin; None where they are too few.

    The way to another place is another one, so the motion does not tell which moments are the same.
    """
    theirs = run.by_key
    best: List[Tuple[float, float]] = []
    for channel in reference.channels:
        if channel.key in theirs and is_sequence(channel) and is_sequence(theirs[channel.key]):
            found = _common(states(channel), states(theirs[channel.key]))
            best = max(best, found, key=len)
    if len(best) < _FEWEST:
        return None
    events = common_events(reference.events, run.events)
    pairs = sorted([*best, *zip(events.reference_s.tolist(), events.run_s.tolist())])
    rising = [pairs[0]]
    for pair in pairs[1:]:
        if pair[0] > rising[-1][0] and pair[1] > rising[-1][1]:
            rising.append(pair)
    return Alignment(time_map(*np.array(rising).T), Means.STATES, events.notes)


def _common(mine: States, other: States) -> List[Tuple[float, float]]:
    """Return begins (s of both) of states that both have in the same order; none if few."""
    blocks = SequenceMatcher(None, mine.values, other.values, False).get_matching_blocks()
    found = [(mine.since_s[block.a + row], other.since_s[block.b + row])
             for block in blocks for row in range(block.size)]
    if len(found) < _ALIKE * max(len(mine.values), len(other.values)):
        return []
    return [it for it in found if it[0] > 0.0 and it[1] > 0.0]
