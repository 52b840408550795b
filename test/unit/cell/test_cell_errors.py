# SPDX-License-Identifier: BSD-3-Clause
"""Problems, their order and their text."""
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import (
    ConfigurationError,
    Location,
    Problem,
    ProblemList,
    advice,
    nearest,
    quoted,
    shortened,
)


def test_order_and_repetition() -> None:
    problems = ProblemList()
    problems.begin_file('b')
    problems.add(Location('a', 1), 'x', 'first')
    problems.add(Location('b', 9), 'x', 'last')
    problems.add(Location('b', 2), '', 'middle')
    problems.extend([Problem(Location('b', 9), 'x', 'last')])
    try:
        problems.raise_if_any()
    except ConfigurationError as error:
        assert str(error).splitlines() == ['b:2: middle', 'b:9: <x>: last', 'a:1: <x>: first']
        assert len(error.problems) == 3
    else:
        raise AssertionError('nothing was raised')


def test_no_problem_is_no_error() -> None:
    ProblemList().raise_if_any()


@given(st.text())
def test_quoted_text_is_short_and_on_one_line(text: str) -> None:
    assert len(shortened(text)) <= 60
    assert len(quoted(text).splitlines()) == 1


def test_nearest_names() -> None:
    names = ['PointCloud', 'PointCloud2', 'Pose']
    assert nearest('pointcloud2', names) == 'PointCloud2'
    assert nearest('xyz', names) is None
    assert advice('xyz', names) == 'expected one of: PointCloud, PointCloud2, Pose'
