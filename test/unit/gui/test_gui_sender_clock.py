# SPDX-License-Identifier: BSD-3-Clause
"""Sending times of messages, from their stamps."""
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.gui.recording.recording_types import SenderClock

_TIMES = st.floats(-1e6, 1e6)


@given(skew_s=_TIMES, first_s=_TIMES, delays_s=st.lists(st.floats(0.0, 50.0), max_size=20))
def test_a_delay_is_seen_whatever_the_clocks_show(skew_s: float, first_s: float,
                                                  delays_s: list) -> None:
    clock = SenderClock()
    assert abs(clock.sent_s(first_s + skew_s, first_s) - first_s) < 1e-3
    for count, delay_s in enumerate(delays_s):
        sent_s = first_s + 0.5 * count
        assert abs(clock.sent_s(sent_s + skew_s, sent_s + delay_s) - sent_s) < 1e-3


def test_a_sender_whose_clock_is_put_back_is_late_for_a_minute_at_most() -> None:
    clock = SenderClock()
    clock.sent_s(1000.0, 100.0)
    assert clock.sent_s(0.0, 101.0) == 101.0 - 60.0


def test_a_sender_whose_clock_is_put_forward_is_not_in_the_future() -> None:
    clock = SenderClock()
    clock.sent_s(1000.0, 100.0)
    assert clock.sent_s(5000.0, 101.0) == 101.0
