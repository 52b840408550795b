# SPDX-License-Identifier: BSD-3-Clause
"""Problems with the target of a recording on the disk."""
from __future__ import annotations

import os
from pathlib import Path

import pytest

from process_visualizer.gui.recording import recording_choices as bag_target
from process_visualizer.gui.recording.recording_choices import is_for_anybody, look_at


def test_a_folder_that_is_there_or_can_be_made(tmp_path: Path):
    for folder in (tmp_path, tmp_path / 'new' / 'er'):
        target = look_at(str(folder), 'seam')
        assert target.problem == '' and target.free_bytes and target.free_bytes > 0
    assert not (tmp_path / 'new').exists()


@pytest.mark.parametrize('folder, expected', [
    ('/home/me/bags', True), ('/home/me', True), ('/media/stick', True), ('/tmp', True),
    ('/data/bags', False), ('/home/metoo', False), ('/home/me/../you', False), ('/', False)])
def test_folders_that_the_recorder_takes_from_anybody(folder: str, expected: bool) -> None:
    assert is_for_anybody(folder, '/home/me') is expected


@pytest.mark.parametrize('file', ['seam.bag', 'seam.bag.active', 'seam_0.bag'])
def test_a_name_that_is_taken(tmp_path: Path, file: str):
    (tmp_path / file).touch()
    (tmp_path / 'seam-2.bag').touch()
    for name in ('seam', 'seam.bag'):
        target = look_at(str(tmp_path), name)
        assert 'seam.bag exists already' in target.problem and target.free_name == 'seam-3'


@pytest.mark.parametrize('name, part', [('a/b', 'slash'), ('.a', 'dot'), ('a\tb', 'printed')])
def test_names_that_are_none(tmp_path: Path, name: str, part: str):
    assert part in look_at(str(tmp_path), name).problem
    assert part in look_at(str(tmp_path), '', name).problem


def test_folders_that_are_none(tmp_path: Path):
    (tmp_path / 'file').touch()
    assert f'{tmp_path / "file"} is not a folder' in look_at(str(tmp_path / 'file' / 'x')).problem
    assert 'Enter a full path (starting with /)' in look_at('bags').problem


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, 'access', lambda path, mode: False)  # root may write everywhere
    assert f'you have no write permission for {tmp_path}' in look_at(str(tmp_path / 'new')).problem


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bag_target, 'MIN_FREE_BYTES', 1 << 60)
    assert 'is full' in look_at(str(tmp_path)).problem


def test_a_disk_that_is_mounted_read_only_is_no_question_of_permission(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.statvfs(tmp_path)
    monkeypatch.setattr(os, 'statvfs', lambda _path: os.statvfs_result(
        (*real[:8], real.f_flag | os.ST_RDONLY, real.f_namemax)))
    assert 'mounted read-only' in look_at(str(tmp_path / 'new')).problem
