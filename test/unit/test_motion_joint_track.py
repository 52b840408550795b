# SPDX-License-Identifier: BSD-3-Clause
"""Joint positions at any time of a track."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.joints import joint_track

TIMES = st.lists(st.floats(0.0, 100.0), min_size=1, max_size=20, unique=True).map(sorted)


@given(TIMES, st.floats(-10.0, 110.0))
def test_it_is_the_line_between_neighbors(times_s: List[float], at_s: float) -> None:
    values = np.sin(np.array(times_s))
    found = joint_track(('a',), np.array(times_s), values).at(at_s)
    if times_s[0] <= at_s <= times_s[-1]:
        assert found is not None
        assert found['a'] == pytest.approx(float(np.interp(at_s, times_s, values)), abs=1e-9)
    else:
        assert found is None


def test_between_two_runs_there_is_nothing() -> None:
    track = joint_track(('a', 'b'), np.array([0.0, 1.0, 1.0, 4.0, 5.0]), np.array(
        [[0.0, 0.0], [1.0, 2.0], [np.nan, np.nan], [7.0, 7.0], [8.0, 9.0]]))
    assert track.at(0.5) == {'a': 0.5, 'b': 1.0}
    assert track.at(1.0) is None and track.at(2.0) is None
    assert track.at(4.0) == {'a': 7.0, 'b': 7.0}
    assert track.at(5.0) == {'a': 8.0, 'b': 9.0}


@pytest.mark.parametrize('joints, times_s, positions', [
    (('a', 'b'), [0.0, 1.0], [1.0, 2.0, 3.0]), ((), [0.0], []), (('a',), [1.0, 0.0], [0.0, 0.0]),
    (('a',), [np.nan], [0.0])])
def test_what_does_not_fit_is_refused(joints: tuple, times_s: List[float],
                                      positions: List[float]) -> None:
    with pytest.raises(ValueError, match='times|positions'):
        joint_track(joints, np.array(times_s), np.array(positions))
