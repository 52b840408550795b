# SPDX-License-Identifier: BSD-3-Clause
"""The settings that the launcher keeps."""
from __future__ import annotations

import os
from pathlib import Path

import pytest
from PyQt5.QtCore import QSettings

from process_visualizer.gui.app.settings import Settings


def settings(folder: Path) -> Settings:
    return Settings(str(folder / 'launcher.conf'))


def test_values_keep_their_types(tmp_path: Path) -> None:
    first = settings(tmp_path)
    values = {'number': 0.5, 'flag': False, 'text': 'ünd "so"; [x]', 'list': ['a', 'b'],
              'table': {'path': '/a b', 'arguments': {'quality': 'poor'}}}
    for name, value in values.items():
        first.store(name, value)
    del first
    second = settings(tmp_path)
    assert {name: second.value(name) for name in values} == values


def test_what_was_never_stored_has_its_default(tmp_path: Path) -> None:
    assert settings(tmp_path).value('mode', 'realtime') == 'realtime'


def test_what_another_version_has_written_does_not_matter(tmp_path: Path) -> None:
    file = QSettings(str(tmp_path / 'launcher.conf'), QSettings.IniFormat)
    file.setValue('mode', '{not json')
    file.sync()
    assert settings(tmp_path).value('mode', 'playback') == 'playback'


def check_unusable(path: Path, reason: str) -> None:
    """Assert that the file is reported and not touched; the session has its values anyway."""
    kept = settings(path.parent)
    assert kept.problem.endswith(f'{path}: {reason}')
    assert (kept.value('mode', 'realtime'), kept.folder) == ('realtime', str(path.parent))
    kept.store('mode', 'playback')
    kept.sync()
    assert kept.value('mode') == 'playback'
    assert settings(path.parent).value('mode') is None


def test_nothing_but_a_file_is_read_or_written(tmp_path: Path) -> None:
    path = tmp_path / 'launcher.conf'
    os.mkfifo(path)
    check_unusable(path, 'is not a regular file')
    path.unlink()
    path.mkdir()
    check_unusable(path, 'is not a regular file')


def test_a_file_too_large_for_settings_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / 'launcher.conf'
    path.touch()
    os.truncate(path, 1 << 30)
    check_unusable(path, 'is larger than 1 MB')
    assert path.stat().st_size == 1 << 30


def test_the_file_is_where_qt_has_those_of_the_user(monkeypatch: pytest.MonkeyPatch,
                                                    tmp_path: Path) -> None:
    monkeypatch.setenv('XDG_CONFIG_HOME', str(tmp_path))
    kept = Settings()
    kept.store('mode', 'playback')
    kept.sync()
    assert kept.problem == '' and kept.folder == str(tmp_path / 'process_visualizer')
    assert 'playback' in (tmp_path / 'process_visualizer' / 'launcher.conf').read_text()


def test_a_program_that_takes_the_place_of_this_one_finds_them(tmp_path: Path) -> None:
    """Nothing in this process is shut down then, so Qt writes nothing."""
    first = settings(tmp_path)
    first.store('bag', {'open': ['/a.bag']})
    first.sync()
    assert '/a.bag' in (tmp_path / 'launcher.conf').read_text()
