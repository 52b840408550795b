# SPDX-License-Identifier: BSD-3-Clause
"""Problems, their order and their text."""
import os
import subprocess
import sys
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import (
    ConfigurationError,
    Location,
    Problem,
    ProblemList,
    advice,
    missing_file,
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


def test_what_is_no_file_is_called_what_it_is(tmp_path: Path) -> None:
    (tmp_path / 'sub').mkdir()
    os.mkfifo(str(tmp_path / 'pipe'))
    assert missing_file(f'{tmp_path}/sub') == f'"{tmp_path}/sub" is a folder; name a file in it'
    assert 'is not a regular file' in missing_file(f'{tmp_path}/pipe')
    assert f'did you mean "{tmp_path}/sub"?' in missing_file(f'{tmp_path}/sob')
    assert 'nor its folder' in missing_file(f'{tmp_path}/a/b')


def test_a_folder_that_cannot_be_read_is_no_error(tmp_path: Path) -> None:
    (tmp_path / 'locked').mkdir(mode=0o311)
    ask = ('import sys; from process_visualizer.cell.errors import missing_file; '
           'print(missing_file(sys.argv[1]))')
    as_root = ['setpriv', '--bounding-set=-dac_override,-dac_read_search'] \
        if os.geteuid() == 0 else []
    done = subprocess.run([*as_root, sys.executable, '-c', ask, f'{tmp_path}/locked/a'], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    assert 'its folder cannot be read: Permission denied' in done.stdout, done.stderr
