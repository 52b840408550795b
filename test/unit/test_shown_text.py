# SPDX-License-Identifier: BSD-3-Clause
"""Text from outside is displayed in a terminal, and never controls it."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
import rosbag
from genpy import Time
from std_msgs.msg import Float32, String

from process_visualizer.bagio.recorder_topics import CONFIGURATION, MARKS
from process_visualizer.commands.command_line import main
from process_visualizer.player.player_program import exit_code
from process_visualizer.shown_text import say, shown, shown_in_line

_TITLE = '\x1b]0;owned\x07'
_ODD = f'a{_TITLE}\x9b2J\u202e\r\x00\x7fz'


@pytest.mark.parametrize(('text', 'seen'), [
    ('plain µ — 20\u00a0° 日本 🙂', 'plain µ — 20\u00a0° 日本 🙂'), ('a\n\tb', 'a\n\tb'),
    (_ODD, r'a\x1b]0;owned\x07\x9b2J\u202e\r\x00\x7fz'), (os.fsdecode(b'\xff.bag'), r'\xff.bag'),
    ('\ud800', r'\ud800'), (3, '3')])
def test_only_characters_to_be_seen_remain(text: Any, seen: str) -> None:
    assert shown(text) == seen


def test_a_part_of_a_line_begins_no_other() -> None:
    assert shown_in_line('mark\nverdict: complete') == r'mark\nverdict: complete'


def test_a_line_that_can_be_encoded_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    say(os.fsdecode(b'\xff.bag'))
    assert capsys.readouterr().out == '\\xff.bag\n'


@pytest.fixture
def bag(tmp_path: Path) -> str:
    """A bag with a mark, a publisher and a configuration of escape sequences."""
    path = tmp_path / f'a{_TITLE}.bag'
    configuration = {'file': f'/{_TITLE}.xml', 'files': {
        f'/{_TITLE}.xml': '<visualizer><device type="other" name="a"><node pkg="b" type="c" '
                          'name="d"/></device></visualizer>'}, 'arguments': {_TITLE: _ODD}}
    with rosbag.Bag(str(path), 'w') as file:
        file.write(f'/{CONFIGURATION.strip("/")}', String(json.dumps(configuration)), Time(1))
        file.write(f'/{MARKS.strip("/")}', String(f'{_ODD}\nverdict: complete'), Time(1))
        file.write(f'/b{_TITLE}', Float32(1.0), Time(2))
    return str(path)


@pytest.mark.parametrize('words', [
    ['report'], ['report', '--json'], ['configuration'], ['runs'], ['calibration'], ['new'],
    ['compare', '--reference', 'x.bag'], ['mark']])
def test_no_command_sends_what_is_in_a_bag(bag: str, words: 'list[str]', tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str],
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    more = {'mark': ['99', _ODD]}.get(words[0], [])
    main([words[0], bag, *more, *words[1:]])
    output = capsys.readouterr()
    for text in (output.out, output.err):
        assert not any(it in text for it in '\x1b\x9b\x07\r\x00\u202e')
    if words == ['report']:
        assert [it for it in output.out.splitlines() if it.startswith('verdict')] == \
            [output.out.splitlines()[-1]]
    if words == ['report', '--json']:
        assert json.loads(output.out)['marks'][0]['label'].startswith(_ODD)


def test_nor_does_the_player(capsys: pytest.CaptureFixture[str]) -> None:
    def fails() -> int:
        raise ValueError(_ODD)
    assert exit_code(fails) == 1
    assert capsys.readouterr().err == f'bag_player: {shown(_ODD)}\n'
