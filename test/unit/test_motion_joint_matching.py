# SPDX-License-Identifier: BSD-3-Clause
"""The model joints for a driver's joint names."""
from __future__ import annotations

import math

import pytest

from process_visualizer.robot.joints import JointMatching


@pytest.mark.parametrize('names', [('shoulder', 'left/elbow'), ('l_shoulder', 'elbow'),
                                   ('elbow', 'shoulder', 'of_another_robot'), ()])
def test_names(names: 'tuple[str, ...]') -> None:
    matching = JointMatching('left', ['shoulder', 'left/elbow'], prefix='l_')
    positions = [2.0, 1.0, 9.0] if len(names) == 3 else [1.0, 2.0]
    assert matching.match(names, positions) == {'shoulder': 1.0, 'left/elbow': 2.0}


def test_offsets() -> None:
    matching = JointMatching('left', ['shoulder', 'left/elbow'], {'elbow': 0.5, 'none': 1.0})
    assert matching.match((), (1.0, 2.0)) == {'shoulder': 1.0, 'left/elbow': 2.5}


def test_what_a_joint_may_be_called() -> None:
    matching = JointMatching('left', ['elbow', 'left/elbow', 'shoulder'], prefix='l_')
    assert matching.names('shoulder') == ('l_shoulder', 'shoulder')
    assert set(matching.names('left/elbow')) == {'left/elbow', 'l_left/elbow'}  # one is elbow
    assert matching.names('wrist') == ()


def test_only_a_joint_without_a_usable_position_is_left_out() -> None:
    matching = JointMatching('left', ['shoulder', 'elbow'])
    assert matching.match((), (1.0, math.nan)) == {'shoulder': 1.0}
    assert matching.match(('gripper', 'elbow'), (math.inf, 2.0)) == {'elbow': 2.0}
    assert matching.match((), (-1e308, 2.0)) == {'elbow': 2.0}
    assert matching.match(('wheel', 'elbow'), ()) == {}  # velocities only


@pytest.mark.parametrize('positions', [(1.0,), (1.0, 2.0, 3.0)])
def test_what_does_not_fit(positions: 'tuple[float, ...]') -> None:
    with pytest.raises(ValueError):
        JointMatching('left', ['shoulder', 'elbow']).match((), positions)
