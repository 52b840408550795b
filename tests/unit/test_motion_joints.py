"""Joints of a model, and measurements that belong to them."""
import pytest

from process_visualizer.motion.joints import match_joints, movable_joints

URDF = '''<robot name="r">
  <joint name="r/b" type="revolute"/><joint name="r/fixed" type="fixed"/>
  <joint name="r/a" type="continuous"/><joint name="r/slide" type="prismatic"/>
  <joint name="r/finger" type="revolute"><mimic joint="r/b"/></joint>
  <transmission name="t"><joint name="r/b"/></transmission>
</robot>'''
JOINTS = ['r/b', 'r/a', 'r/slide']


def test_movable_joints_in_the_order_of_the_file():
    assert movable_joints(URDF) == JOINTS


def test_a_model_that_is_not_xml():
    with pytest.raises(ValueError, match='not XML'):
        movable_joints('<robot>')


def test_positions_without_names_are_in_order():
    assert match_joints('r', JOINTS, [], [1.0, 2.0, 3.0]) == (JOINTS, [1.0, 2.0, 3.0])


def test_names_match_with_and_without_the_robots_name():
    found = match_joints('r', JOINTS, ['a', 'gripper', 'r/b'], [1.0, 2.0, 3.0])
    assert found == (['r/a', 'r/b'], [1.0, 3.0])


@pytest.mark.parametrize('names, positions, problem', [
    ([], [1.0, 2.0], '3 values are expected.*not 2'),
    ([], [], '3 values are expected.*not 0'),
    (['r/a'], [1.0, 2.0], '1 joint names come with 2 positions'),
    (['x'], [1.0], 'none of the names'),
])
def test_what_does_not_fit_says_why(names, positions, problem):
    with pytest.raises(ValueError, match=problem):
        match_joints('r', JOINTS, names, positions)
