# SPDX-License-Identifier: BSD-3-Clause
"""The part of a recording that is read next, and the poses that are known then."""
from __future__ import annotations

import math
from typing import List, Optional

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.recorded_velocity import (
    AHEAD_S,
    MARGIN_S,
    MAX_S,
    PosePart,
    RecordedPose,
    RecordedPoses,
    kept_part,
    needed_part,
    next_part,
)

NO_TURN = (0.0, 0.0, 0.0, 1.0)
durations_s = st.floats(0.0, 100.0)
speeds = st.sampled_from([0.0, 0.01, 0.25, 1.0, 8.0, 16.0, -0.25, -1.0, -8.0, -16.0])


def poses(begin_s: float, end_s: float) -> RecordedPoses:
    """Poses every 0.1 s that move at 1 m/s along x, for a part with its bounds."""
    times_s = [number / 10 for number in range(math.ceil(begin_s * 10 - 1e-6),
                                               math.floor(end_s * 10 + 1e-6) + 1)]
    return RecordedPoses(PosePart(begin_s, end_s), [
        RecordedPose(time_s, math.nan, (time_s, 0.0, 0.0), NO_TURN) for time_s in times_s])


def read(
    known: Optional[PosePart], position_s: float, speed: float, duration_s: float
) -> List[PosePart]:
    """All parts that are read at a position, in their order."""
    parts: List[PosePart] = []
    while True:
        part = next_part(known, position_s, speed, duration_s)
        if part is None:
            return parts
        parts.append(part)
        assert len(parts) < 100
        if known is not None and part.begin_s == known.end_s:
            known = PosePart(known.begin_s, part.end_s)
        elif known is not None and part.end_s == known.begin_s:
            known = PosePart(part.begin_s, known.end_s)
        else:
            known = part


@given(durations_s, st.floats(0.0, 1.0), st.floats(0.0, 1.0), speeds)
def test_what_a_position_needs_comes_first_and_then_what_lies_ahead(
        duration_s: float, before: float, share: float, speed: float) -> None:
    known = read(None, before * duration_s, 1.0, duration_s)
    old = PosePart(min(part.begin_s for part in known), max(part.end_s for part in known))
    position_s = share * duration_s
    needed = needed_part(position_s, duration_s)
    for begun_with in (None, old):
        parts = read(begun_with, position_s, speed, duration_s)
        whole = PosePart(0.0, duration_s)
        assert all(whole.holds(part) and part.begin_s <= part.end_s for part in parts)
        if begun_with is None:
            assert parts[0].holds(needed)
        ahead = PosePart(position_s, position_s + AHEAD_S * speed) if speed > 0.0 else PosePart(
            position_s + AHEAD_S * speed, position_s)
        all_parts = [*parts, *([] if begun_with is None else [begun_with])]
        for place_s in np.linspace(*ahead.within(whole), 50):
            assert any(part.begin_s <= place_s <= part.end_s for part in all_parts)


def test_while_it_plays_little_is_read_at_once_and_nothing_twice() -> None:
    known, parts = read(None, 10.0, 1.0, 100.0), []
    part = PosePart(min(it.begin_s for it in known), max(it.end_s for it in known))
    for position_s in np.arange(10.0, 60.0, 0.1):
        for new in read(part, position_s, 1.0, 100.0):
            assert new.begin_s == part.end_s
            parts.append(new)
            part = PosePart(part.begin_s, new.end_s)
    assert len(parts) == pytest.approx(50.0 / MAX_S, abs=1)


@pytest.mark.parametrize('speed', [0.0, 1.0, -8.0])
def test_what_is_kept_is_what_is_wanted(speed: float) -> None:
    kept = kept_part(50.0, speed)
    parts = read(None, 50.0, speed, 100.0)
    assert all(kept.holds(part) for part in parts)
    assert kept.end_s - kept.begin_s < 2 * (MAX_S + MARGIN_S) + 3.0 * abs(speed) + 2.1


def test_parts_are_joined_without_doubles() -> None:
    for first, second in ((poses(1.0, 2.0), poses(2.0, 3.5)), (poses(2.0, 3.5), poses(1.0, 2.0))):
        joined = first.joined(second)
        assert joined == poses(1.0, 3.5)
    assert joined.only(PosePart(1.5, 9.0)) == poses(1.5, 3.5)
    assert joined.only(PosePart(7.0, 9.0)) == joined  # not an empty known part


def test_the_velocity_of_no_poses_is_none_and_of_some_is_theirs() -> None:
    assert RecordedPoses(PosePart(0.0, 5.0), []).velocity(0.2).velocity(1.0) is None
    assert poses(0.0, 5.0).velocity(0.2).velocity(2.5) == pytest.approx((1.0, 0.0, 0.0))


@pytest.mark.parametrize('behind_s', [0.0, 0.05, 0.15, 0.4, 1.0])
def test_poses_that_were_held_up_make_no_velocity(behind_s: float) -> None:
    """The recorder hung from 10 s to 20 s; of that time it got the first half second of poses."""
    measured_s = [0.008 * number for number in range(1313)] + [
        20.005 + 0.008 * number for number in range(300)]
    times_s = [time_s if not 10.0 < time_s < 20.0 else 20.0 + 1e-5 * row
               for row, time_s in enumerate(measured_s)]
    part = PosePart(20.0 + behind_s - MARGIN_S, 20.0 + behind_s + MARGIN_S)
    known = RecordedPoses(part, [
        RecordedPose(time_s, math.nan, (0.06 * at_s, 0.0, 0.0), NO_TURN)
        for time_s, at_s in sorted(zip(times_s, measured_s))
        if part.begin_s <= time_s <= part.end_s])
    velocity = known.velocity(0.2, 0.008).velocity(20.0 + behind_s)
    assert velocity is None or velocity[0] == pytest.approx(0.06, rel=1e-6)
    assert velocity is not None or behind_s < 0.2
