# SPDX-License-Identifier: BSD-3-Clause
"""Holes of a run, in which nothing at all was recorded, and gaps in the motion of its tools."""
from __future__ import annotations

from typing import List

import numpy as np

from process_visualizer.runs.run import Run
from process_visualizer.runs.series import data_gaps, period_s

MIN_HOLE_S = 0.1
_OFTEN_S = 0.25
"""Maximum time between two messages of a topic [s] for a hole to show that some are missing."""


def holes_s_of(run: Run) -> np.ndarray:
    """Return where a run has no message at all, (k, 2) [s], though one topic usually has many.

    A state that is sent only when it changes may have changed there, too. Several slow topics
    pause together now and then; that is not a hole.
    """
    series = [it.times_s for it in run.motions] + [it.times_s for it in run.channels]
    usual_s = min((max(period_s(it), run.duration_s / len(it)) for it in series if len(it) > 1),
                  default=np.inf)
    if usual_s >= _OFTEN_S:
        return np.empty((0, 2))
    gaps = data_gaps(np.unique(np.concatenate([[0.0, run.duration_s], *series])), usual_s)
    result: np.ndarray = gaps[gaps[:, 1] - gaps[:, 0] >= MIN_HOLE_S]
    return result


def motion_gaps_s(run: Run) -> List[np.ndarray]:
    """Return the gaps in the motion of each tool that moves, (k, 2) [s].

    A run may begin or end within a hole: it is cut where its events are, which are noticed late. A
    tool that is silent there while other topics are not may just be at rest.
    """
    holes = holes_s_of(run)
    begins, ends = (bool(it.any()) for it in (holes[:, 0] <= 0.0, holes[:, 1] >= run.duration_s))
    return [data_gaps(np.unique(np.concatenate(
        ([0.0] * begins, it.times_s, [run.duration_s] * ends))))
        for it in run.motions if len(it.times_s)]
