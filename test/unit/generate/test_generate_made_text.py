# SPDX-License-Identifier: BSD-3-Clause
"""A text that is only made again when its files have changed; with real files."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, List, Tuple

import pytest

from process_visualizer.robot import xacro_file
from process_visualizer.robot.xacro_file import MadeText, XacroError, expand_xacro

OLD_S = 100.0


def make_older(path: Path, age_s: float) -> None:
    """Move the last change of a file far into the past."""
    changed_s = time.time() - age_s
    os.utime(path, (changed_s, changed_s))


class Source:
    """A file from which a text is made."""

    def __init__(self, folder: Path) -> None:
        self.path, self.made = folder / 'source', 0
        self.text = MadeText(self._make)

    def write(self, content: str, age_s: float = OLD_S) -> None:
        self.path.write_text(content)
        make_older(self.path, age_s)

    def _make(self) -> Tuple[str, List[str]]:
        self.made += 1
        return self.path.read_text(), [str(self.path), str(self.path) + '.optional']


@pytest.fixture
def source(tmp_path: Path) -> Source:
    made = Source(tmp_path)
    made.write('one')
    return made


def test_it_is_made_once(source: Source) -> None:
    assert [source.text.get() for _ in range(3)] == 3 * ['one']
    assert source.made == 1


def test_it_is_made_again_when_a_file_changes(source: Source) -> None:
    source.text.get()
    source.write('two', OLD_S / 2.0)
    assert source.text.get() == 'two'
    source.write('three', OLD_S / 4.0)
    assert source.text.get() == 'three'


def test_it_is_made_again_when_a_file_appears(source: Source) -> None:
    source.text.get()
    Path(f'{source.path}.optional').touch()
    source.text.get()
    assert source.made == 2


def test_a_file_that_has_just_changed_may_change_again_unseen(source: Source) -> None:
    source.write('two', 0.0)
    assert [source.text.get(), source.text.get()] == ['two', 'two']
    assert source.made == 2


def test_a_failure_is_not_remembered(source: Source) -> None:
    source.text.get()
    source.path.unlink()
    for _ in range(2):
        with pytest.raises(FileNotFoundError):
            source.text.get()
    source.write('two')
    assert source.text.get() == 'two'


def test_xacro_runs_again_only_if_a_file_has_changed(tmp_path: Path, monkeypatch: Any) -> None:
    runs: List[str] = []
    run = xacro_file._run
    monkeypatch.setattr(xacro_file, '_run',
                        lambda path, *rest: (runs.append(path), run(path, *rest))[1])
    inner, outer = (tmp_path / name for name in ('inner.xacro', 'robot.xacro'))
    root = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
    outer.write_text(root.format(f'<xacro:include filename="{inner}"/><link name="$(arg link)"/>'))
    inner.write_text(root.format('<link name="before"/>'))
    for path in (inner, outer):
        make_older(path, OLD_S)

    def expanded(link: str) -> str:
        return expand_xacro(str(outer), (('link', link),))

    assert 'name="before"' in expanded('a') and 'name="a"' in expanded('a')
    assert len(runs) == 1
    assert 'name="b"' in expanded('b')
    runs.clear()
    inner.write_text(root.format('<link name="afterwards"/>'))
    assert 'name="afterwards"' in expanded('a')
    outer.unlink()
    with pytest.raises(XacroError):
        expanded('a')
    assert len(runs) == 2
