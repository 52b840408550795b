# SPDX-License-Identifier: BSD-3-Clause
"""The values that thesis_table computes from arrivals."""
from __future__ import annotations

import struct

import numpy as np
import pytest
from thesis_plots import round_ticks
from thesis_run import Stream, rate_hz, streams, window

FRONT = np.dtype([('time_ns', '<i8'), ('topic', '<u4'), ('size', '<u4'), ('front', 'u1', 64)])


def stream(*times_s: float) -> Stream:
    """Messages whose number is their index."""
    return Stream(np.array(times_s), np.arange(len(times_s), dtype=float)[:, None])


def test_rate_is_that_of_the_steps() -> None:
    assert rate_hz(np.arange(5) / 125) == pytest.approx(125)
    assert stream(0.0, 0.1, 0.4).rate_hz == pytest.approx(5)


@pytest.mark.parametrize('times_s', [[], [3.0]])
def test_less_than_two_messages_have_no_rate(times_s: 'list[float]') -> None:
    assert rate_hz(np.array(times_s)) == 0.0


def test_window_keeps_what_was_recorded() -> None:
    recorded_s = np.array([10.0001, 10.5, 10.9999])
    inside = window(stream(9.99, 10.0, 10.5, 11.0, 11.01), recorded_s).since(10.0)
    assert inside.time_s.tolist() == [0.0, 0.5, 1.0]
    assert inside.values[:, 0].tolist() == [1.0, 2.0, 3.0]


def test_arrivals_by_topic() -> None:
    wrench = struct.pack('<III3f', 0, 0, 3, 1.0, 2.0, 3.0)
    arrivals = np.zeros(3, FRONT)
    for arrival, (time_ns, topic, front) in zip(arrivals, [
            (1_000_000_000, 1, b'\x05\x00'), (2_000_000_000, 0, wrench), (3_500_000_000, 1, b'')]):
        arrival['time_ns'], arrival['topic'], arrival['size'] = time_ns, topic, len(front)
        arrival['front'][:len(front)] = list(front)
    found = streams(arrivals, ['/ft_lower/ft', '/edge_finder_lower'])
    assert found['/ft_lower/ft'].values.tolist() == [[1.0, 2.0, 3.0]]
    assert found['/edge_finder_lower'].time_s.tolist() == [1.0, 3.5]
    assert found['/edge_finder_lower'].values.shape == (2, 0)


def test_a_topic_of_which_nothing_came() -> None:
    found = streams(np.zeros(0, FRONT), ['/ft_lower/ft'])
    assert len(found['/ft_lower/ft'].time_s) == 0


@pytest.mark.parametrize('low, high, ticks', [
    (-0.13, 0.29, [-0.2, 0.0, 0.2, 0.4]), (0.1, 19.0, [0, 5, 10, 15, 20]),
    (-3.2, 0.9, [-4, -2, 0, 2]), (2.0, 2.0, [2.0, 2.0005, 2.001])])
def test_ticks_hold_all_values(low: float, high: float, ticks: 'list[float]') -> None:
    assert round_ticks(np.array([high, 0.5 * (low + high), low])) == pytest.approx(ticks)
