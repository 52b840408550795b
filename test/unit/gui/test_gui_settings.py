# SPDX-License-Identifier: BSD-3-Clause
"""What the launcher remembers."""
from __future__ import annotations

from pathlib import Path

from PyQt5.QtCore import QSettings

from process_visualizer.gui.app.kept_state import Settings


def settings(folder: Path) -> Settings:
    return Settings(QSettings(str(folder / 'launcher.conf'), QSettings.IniFormat))


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


def test_a_program_that_takes_the_place_of_this_one_finds_them(tmp_path: Path) -> None:
    """Nothing of this process is ended then, and so Qt writes nothing."""
    first = settings(tmp_path)
    first.store('bag', {'open': ['/a.bag']})
    first.sync()
    assert '/a.bag' in (tmp_path / 'launcher.conf').read_text()
