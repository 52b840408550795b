# SPDX-License-Identifier: BSD-3-Clause
"""ROS time that does not advance or goes back is reported; a coarse clock is not."""
from process_visualizer.nodes.robot.message_reader import TimeWatch


def test_time_that_goes_on_is_right():
    watch = TimeWatch()
    for ros_s, steady_s in ((0.0, 100.0), (0.0, 100.9), (0.5, 101.5), (0.5, 102.4)):
        assert watch.problem(ros_s, steady_s) == ''


def test_time_that_stands_still_or_goes_back_is_named():
    watch = TimeWatch()
    assert watch.problem(7.0, 100.0) == ''
    assert 'is not advancing' in watch.problem(7.0, 101.1)
    assert 'gone back' in watch.problem(6.9, 101.2)
    assert 'gone back' in watch.problem(7.0, 105.0)  # it may not be reported yet
    assert watch.problem(8.0, 108.0) == ''
