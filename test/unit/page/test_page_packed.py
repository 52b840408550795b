# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a page: precision of times and positions."""
from __future__ import annotations

import numpy as np
import pytest

from process_visualizer.page.packed import Packed


@pytest.mark.parametrize('gap_s', [0.01, 5000.0])
def test_times_are_exact_to_the_nanosecond(gap_s: float) -> None:
    """A step in the launcher goes to the exact time of a message, which is then shown."""
    times_s = np.array([0.0, 1.000000001, 1.000000002, 1.0 + gap_s])
    packed = Packed()
    assert packed.column(packed.times(times_s)).tolist() == times_s.tolist()


@pytest.mark.parametrize('length_m', [0.5, 5.9, 40.0, 3000.0])
def test_places_are_exact_however_far_something_moves(length_m: float) -> None:
    places = np.random.default_rng(1).uniform(0.0, length_m, (1000, 3))
    packed = Packed()
    assert np.abs(packed.column(packed.scaled(places)) - places).max() < 5e-5
