# SPDX-License-Identifier: BSD-3-Clause
"""Figures as text."""
from __future__ import annotations

import pytest

from process_visualizer.figures import (
    clock_seconds,
    clock_text,
    count_text,
    live_rate_text,
    long_time_text,
    rate_text,
    size_text,
)


@pytest.mark.parametrize('text, expected', [
    (size_text(0), '0 B'), (size_text(999), '999 B'), (size_text(42_123_456), '42.1 MB'),
    (size_text(999_600), '1.0 MB'), (size_text(213e9), '213 GB'), (size_text(5e15), '5000 TB'),
    (count_text(1, 'message'), '1 message'), (count_text(18230, 'message'), '18 230 messages'),
    (count_text(0), '0'),
    (clock_text(0, 1), '0:00.0'), (clock_text(3.61, 1), '0:03.6'), (clock_text(65.3, 1), '1:05.3'),
    (clock_text(3600 + 125.0, 1), '1:02:05.0'),
    (long_time_text(42.9), '42 s'), (long_time_text(299), '4 min'),
    (long_time_text(5 * 3600 + 12 * 60 + 5), '5 h 12 min'), (long_time_text(72 * 3600), '3 days'),
    (long_time_text(1e9), 'more than 4 days'),
    (rate_text(125.2), '125 Hz'), (rate_text(0.5), '0.5 Hz'), (rate_text(0.0), '0 Hz'),
    (live_rate_text(0.0, 3.0), 'last 3 s ago'), (live_rate_text(0.0, 0.9), 'just now'),
    (live_rate_text(1.0, 0.5), '1.0 Hz'),
    (live_rate_text(1.0, 0.5, True), 'latched'), (live_rate_text(0.0, 9.0, True), 'latched'),
    (live_rate_text(10.0, 0.1, True), '10 Hz'),
    (rate_text(1.0), '1.0 Hz'), (rate_text(0.987), '0.99 Hz'), (rate_text(0.0123), '0.012 Hz'),
])
def test_text(text: str, expected: str):
    assert text.replace('\u2009', ' ') == expected


def test_times_as_people_write_them() -> None:
    assert [clock_seconds(it) for it in ('12.5', '0:05', '1:02:03.5')] == [12.5, 5.0, 3723.5]


@pytest.mark.parametrize('text', ['', 'soon', '-1', '1:2:3:4', '1:-2', 'nan', '1e3', '0:05,5'])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match='is not a time'):
        clock_seconds(text)
