# SPDX-License-Identifier: BSD-3-Clause
"""Runs of a tool that moves to a point and back, with a value that depends on its position."""
from __future__ import annotations

from typing import Callable, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.run import Channel, ChannelKind, Run, RunEvent, ToolMotion

RATE_HZ, PROCESS_S = 100.0, 10.0

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]


def progress(process_s: np.ndarray) -> np.ndarray:
    """Distance of the tool from its start [m]: it waits, moves away, waits, moves back, waits."""
    u = np.clip(np.stack([(process_s - 1.0) / 4.0, (process_s - 6.0) / 3.0]), 0.0, 1.0)
    there, back = u * u * (3.0 - 2.0 * u)
    result: np.ndarray = 0.5 * (there - back)
    return result


def made_run(seed: int = 0, speed: float = 1.0, start_s: float = 2.0, noise: float = 0.05,
             value: Optional[Change] = None, place: Optional[Change] = None, dwell_s: float = 0.0,
             has_motion: bool = True, events: Optional[Sequence[Tuple[str, float]]] = None) -> Run:
    """Return a run.

    Args:
        seed: seed of the noise.
        speed: duration of one second of the process [s].
        start_s: time at which the process begins.
        noise: standard deviation of the value.
        value, place: change the value (n,), and the tool's positions (n, 3), at process times (n,).
        dwell_s: duration of a pause of the process, 3 s after its beginning.
        has_motion: whether the tool's motion is known.
        events: names and process times; default: go and back.
    """
    random = np.random.default_rng(seed)
    duration_s = start_s + speed * PROCESS_S + dwell_s + 1.0
    times_s = np.arange(0.0, duration_s, 1.0 / RATE_HZ)
    process_s = (times_s - start_s) / speed
    process_s -= np.clip(process_s - 3.0, 0.0, dwell_s / speed)
    along = progress(process_s)
    values = 10.0 * along + noise * random.standard_normal(len(times_s))
    positions = np.column_stack((along, 0.2 * along ** 2, np.full(len(along), 0.3)))
    if value is not None:
        values = value(process_s, values)
    if place is not None:
        positions = place(process_s, positions)
    found = [RunEvent(name, start_s + speed * (at_s + dwell_s / speed * (at_s > 3.0)))
             for name, at_s in (events if events is not None else (('go', 1.0), ('back', 6.0)))]
    motions = (ToolMotion('robot', times_s, positions),) if has_motion else ()
    return Run(f'run {seed}', duration_s,
               (Channel('robot', 'tool force', 'N', ChannelKind.FORCE, times_s, values),),
               motions, tuple(found))
