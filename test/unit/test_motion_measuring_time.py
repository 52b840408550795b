# SPDX-License-Identifier: BSD-3-Clause
"""Stamps are used where possible."""
from process_visualizer.robot.measuring_time import MeasuringTime


def test_stamps_are_used():
    times = MeasuringTime()
    assert [times.wall_s(stamp, stamp + 0.01) for stamp in (5.0, 5.1)] == [5.0, 5.1]
    assert not times.stamp_did_not_advance


def test_no_stamp_and_the_stamp_of_another_clock():
    times = MeasuringTime()
    assert [times.wall_s(0.0, 7.0), times.wall_s(4.0, 7.1), times.wall_s(11.0, 7.2)] == [
        7.0, 7.1, 7.2]
    assert not times.stamp_did_not_advance


def test_stamps_that_stand_still_or_run_back():
    times = MeasuringTime()
    times.wall_s(5.0, 5.0)
    for stamp in (5.0, 4.9):
        assert times.wall_s(stamp, 5.2) == 5.2
        assert times.stamp_did_not_advance
    assert times.wall_s(5.3, 5.3) == 5.3
    assert not times.stamp_did_not_advance
