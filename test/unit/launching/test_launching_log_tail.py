# SPDX-License-Identifier: BSD-3-Clause
"""The last lines of a log."""
from __future__ import annotations

from pathlib import Path

from process_visualizer.launching.run import TAIL_LINES, LogTail, last_lines


def test_last_lines_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / 'a.log'
    path.write_text('\n'.join(f'line {number}' for number in range(100)) + '\n')
    assert last_lines(str(path)) == tuple(f'line {number}' for number in range(80, 100))


def test_large_file_with_long_lines_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / 'a.log'
    path.write_bytes(b'x' * 100_000 + b'\n\xff\x1b[31mred\x1b[0m \n')
    lines = last_lines(str(path))
    assert lines[1:] == ('\ufffdred',)
    assert len(lines[0]) < 20_000


def test_files_without_lines(tmp_path: Path) -> None:
    (tmp_path / 'empty').touch()
    assert last_lines(str(tmp_path / 'empty')) == ()
    assert last_lines(str(tmp_path / 'missing')) == last_lines(str(tmp_path)) == ()


def test_lines_of_an_output() -> None:
    tail = LogTail()
    assert tail.lines() == ()
    for number in range(TAIL_LINES + 5):
        tail.add(str(number))
    assert tail.lines() == tuple(str(number) for number in range(5, TAIL_LINES + 5))


def test_lines_of_two_logs() -> None:
    tail = LogTail()
    tail.add('error')
    assert tail.after(()) == ('error',)
    assert tail.after(('a', 'b')) == ('a', 'b', 'error')
    assert tail.after(tuple('abcdefghijklm'))[0] == 'd'
