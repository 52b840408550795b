# SPDX-License-Identifier: BSD-3-Clause
"""The tree of fixed frames refuses input that tf2 could not use."""
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.frames import Frame, FrameTree

ZERO = (0.0, 0.0, 0.0)


def tree():
    return FrameTree([Frame('world', 'base'), Frame('tool', 'force'), Frame('base', 'camera')])


def test_a_frame_moves_and_keeps_its_parent():
    frames = tree()
    moved = frames.move('', 'camera', (1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    assert moved == Frame('base', 'camera', (1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    assert frames.frames() == [Frame('world', 'base'), Frame('tool', 'force'), moved]


def test_a_frame_gets_another_parent():
    assert tree().move('world', 'force', ZERO, ZERO).parent == 'world'


def test_links_of_models_are_ancestors_too():
    links = {'tool': 'wrist', 'wrist': 'base', 'other': 'other'}
    with pytest.raises(ValueError, match='base would be its own ancestor with the parent force'):
        tree().move('force', 'base', ZERO, ZERO, links)
    assert tree().move('wrist', 'force', ZERO, ZERO, links).parent == 'wrist'
    assert tree().move('other', 'force', ZERO, ZERO, links).parent == 'other'


@pytest.mark.parametrize('parent, child, xyz, problem', [
    ('', 'bas', ZERO, "'bas' is not known; known are: base, camera, force"),
    ('', '', ZERO, 'not known'),
    ('', 'base', (0.0, math.nan, 0.0), 'NaN or infinity'),
    ('', 'base', (math.inf, 0.0, 0.0), 'NaN or infinity'),
    ('', 'base', (0.0, -1e308, 0.0), 'out of range: at most 1e.06 m'),
    ('base', 'base', ZERO, 'own ancestor'),
    ('camera', 'base', ZERO, 'own ancestor'),
])
def test_what_is_refused_changes_nothing(parent, child, xyz, problem):
    frames = tree()
    with pytest.raises(ValueError, match=problem):
        frames.move(parent, child, xyz, ZERO)
    assert frames.frames() == tree().frames()


@pytest.mark.parametrize('frames, problem', [
    ([Frame('a', 'b'), Frame('c', 'b')], 'b is there twice'),
    ([Frame('a', 'b'), Frame('b', 'a')], 'own ancestor'),
    ([Frame('', 'b')], 'needs a parent'),
    ([Frame('a', '')], 'needs a parent'),
])
def test_wrong_frames_are_refused(frames, problem):
    with pytest.raises(ValueError, match=problem):
        FrameTree(frames)


@given(st.lists(st.tuples(st.sampled_from('abcde'), st.sampled_from('bcdef')), max_size=30))
def test_every_frame_has_a_way_to_a_root(moves):
    frames = FrameTree([Frame('a', child) for child in 'bcdef'])
    for parent, child in moves:
        try:
            frames.move(parent, child, ZERO, ZERO)
        except ValueError:
            continue
    parents = {frame.child: frame.parent for frame in frames.frames()}
    for name in 'bcdef':
        for _ in parents:
            name = parents.get(name, name)
        assert name == 'a'
