# SPDX-License-Identifier: BSD-3-Clause
"""The choice of the editor, and the message if none can be started."""
from __future__ import annotations

from pathlib import Path
from typing import Dict

import pytest

from process_visualizer.gui.toolkit.desktop import EditorError, commands, open_in_editor


def program(folder: Path, name: str, text: str = 'exit 0') -> Path:
    path = folder / name
    path.write_text(f'#!/bin/sh\n{text}\n')
    path.chmod(0o755)
    return path


@pytest.fixture
def environment(tmp_path: Path) -> Dict[str, str]:
    return {'PATH': str(tmp_path)}


def test_the_operators_own_editor_comes_first(tmp_path, environment):
    program(tmp_path, 'kate')
    environment.update(VISUAL='gedit --wait', EDITOR='/opt/bin/code')
    assert list(commands('a b.xml', 7, environment)) == [
        ['gedit', '--wait', '+7', 'a b.xml'], ['/opt/bin/code', '--goto', 'a b.xml:7'],
        ['kate', '--line', '7', 'a b.xml'], ['xdg-open', 'a b.xml']]


@pytest.mark.parametrize('editor', ['vim', '/usr/bin/nano', 'emacs -nw'])
def test_editors_of_terminals_are_left_out(environment, editor):
    environment.update(VISUAL=editor, EDITOR=editor)
    assert list(commands('a.xml', 7, environment)) == [['xdg-open', 'a.xml']]


def test_an_editor_that_nobody_knows_gets_the_file(environment):
    environment['EDITOR'] = 'my-editor --new'
    assert next(commands('a.xml', 7, environment)) == ['my-editor', '--new', 'a.xml']


def test_one_that_fails_is_followed_by_the_next(tmp_path, environment):
    seen = tmp_path / 'seen'
    bad = program(tmp_path, 'bad', 'exit 3')
    good = program(tmp_path, 'good', f'echo "$@" > {seen}')
    environment.update(VISUAL=str(bad), EDITOR=str(good))
    assert open_in_editor('a.xml', 7, environment) == str(good)
    assert seen.read_text() == 'a.xml\n'


def test_a_quote_that_is_not_closed_leaves_the_other_editors(environment):
    environment.update(VISUAL='gedit "--wait', EDITOR="it's")
    assert list(commands('a.xml', 7, environment)) == [['xdg-open', 'a.xml']]
    environment['EDITOR'] = 'kate'
    assert next(commands('a.xml', 7, environment))[0] == 'kate'


def test_no_editor_at_all(environment, monkeypatch):
    environment.update(VISUAL='/nowhere/code', EDITOR='')
    monkeypatch.setenv('PATH', environment['PATH'])  # so that there is no xdg-open
    with pytest.raises(EditorError, match=r'tried: code, xdg-open\); open a.xml at line 7'):
        open_in_editor('a.xml', 7, environment)
