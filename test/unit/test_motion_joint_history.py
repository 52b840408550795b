# SPDX-License-Identifier: BSD-3-Clause
"""The positions of joints between, before and after the received states."""
import pytest

from process_visualizer.robot.joints import JointHistory


def test_positions_between_states() -> None:
    history = JointHistory()
    assert history.at(1.0) == {}
    history.add(10.0, {'a': 0.0, 'b': 5.0})
    history.add(10.4, {'a': 1.0})
    history.add(10.5, {'a': 3.0, 'c': 7.0})
    assert history.at(10.1) == {'a': pytest.approx(0.25), 'b': 5.0}
    assert history.at(10.4) == {'a': 1.0, 'b': 5.0}
    assert history.at(9.0) == {'a': 0.0, 'b': 5.0}
    assert history.at(11.0) == history.at(0.0) == {'a': 3.0, 'b': 5.0, 'c': 7.0}


def test_a_step_back_begins_anew() -> None:
    history = JointHistory()
    history.add(10.0, {'a': 0.0})
    history.add(2.0, {'a': 4.0})
    assert history.at(6.0) == {'a': 4.0} == history.at(1.0)


def test_states_of_one_time() -> None:
    history = JointHistory()
    history.add(1.0, {'a': 0.0})
    history.add(1.0, {'a': 4.0})
    assert history.at(1.0) == {'a': 4.0}
