# SPDX-License-Identifier: BSD-3-Clause
"""Missing items are reported after a delay."""
from __future__ import annotations

from process_visualizer.nodes.common.complaints import Patience


def test_only_what_is_missing_for_long_is_told() -> None:
    patience = Patience(5.0)
    looks = [(True, 10.0), (True, 14.9), (False, 15.5), (True, 16.0), (True, 20.0), (True, 21.0),
             (True, 22.0), (False, 23.0), (True, 24.0)]
    told = [now_s for is_missing, now_s in looks if patience.is_over(is_missing, now_s)]
    assert told == [21.0, 22.0]
