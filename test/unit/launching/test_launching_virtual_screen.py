# SPDX-License-Identifier: BSD-3-Clause
"""A screen in memory: there while it is open, and gone afterwards."""
from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from process_visualizer.commands.scene_pictures import ScreenError, VirtualScreen


def is_open(variables: 'dict[str, str]') -> bool:
    asked = subprocess.run(['import', '-silent', '-window', 'root', 'null:'], check=False,
                           env={**os.environ, **variables}, stderr=subprocess.DEVNULL)
    return asked.returncode == 0


def test_two_screens_have_pictures_of_their_own() -> None:
    with VirtualScreen(60, 40) as one, VirtualScreen(60, 40) as other:
        assert one.variables['DISPLAY'] != other.variables['DISPLAY']
        assert is_open(one.variables)
        picture = one.picture('30x20+10+10')
    assert picture.startswith(b'\xff\xd8') and picture.endswith(b'\xff\xd9')  # a whole JPEG
    size = subprocess.run(['identify', '-format', '%w %h', '-'], input=picture, check=True,
                          stdout=subprocess.PIPE).stdout
    assert size == b'30 20'
    assert not is_open(one.variables)
    with pytest.raises(ScreenError, match='ImageMagick cannot take a picture'):
        one.picture('30x20+10+10')


def test_without_a_server_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch,
                                                  tmp_path: Path) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(ScreenError, match='install the package xvfb'), VirtualScreen(60, 40):
        pass


def test_a_server_that_ends_at_once_is_told() -> None:
    with pytest.raises(ScreenError, match='has ended'), VirtualScreen(-1, 40):
        pass
