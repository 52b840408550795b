# SPDX-License-Identifier: BSD-3-Clause
"""Phrases that confused operators are in no text of the program and on no page."""
from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Iterator, List, Tuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ('src', 'sewing_cell/src', 'web/src', 'docs')
OLD_TESTS = 'moved_tests.md'
CPP_TEXT = re.compile(r'"(?:[^"\\\n]|\\.)*"')
ODD = [
    'Recording data', 'is silent', 'any more', 'showed is out of date', 'simulator: the computer',
    'leaves the band', 'may leave the band', 'ithin the band', 'What departed', r'\(good ',
    'when a run begins$', 'held against', 'hold runs against', 'what comes is drawn',
    'last values before', 'As the desktop', 'View of the next launch', 'the height of the timeline',
    'whole path, beginning', 'is no whole path', 'begins with a dot', 'has a slash in it',
    'live goes on', 'Box of', 'ts comments', 'ot recording, because these',
    'look whether the nodes']


def texts_of_python(path: Path) -> Iterator[str]:
    """The strings of a Python file, except docstrings."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    lone = {id(it.value) for it in ast.walk(tree) if isinstance(it, ast.Expr)}
    for it in ast.walk(tree):
        if isinstance(it, ast.Constant) and isinstance(it.value, str) and id(it) not in lone:
            yield it.value


def texts(path: Path) -> Iterator[str]:
    """The texts of a file that are shown to people."""
    if path.suffix == '.py':
        yield from texts_of_python(path)
    elif path.suffix in ('.cpp', '.hpp'):
        for line in path.read_text(encoding='utf-8').splitlines():
            yield from () if line.lstrip().startswith('//') else CPP_TEXT.findall(line)
    elif path.suffix in ('.md', '.js') and path.name != OLD_TESTS:
        yield from path.read_text(encoding='utf-8').splitlines()


@pytest.fixture(scope='module')
def shown() -> List[Tuple[str, str]]:
    """Each text with the name of its file."""
    found = [(path.name, text) for folder in FOLDERS
             for path in sorted((ROOT / folder).rglob('*')) for text in texts(path)]
    assert len(found) > 5000
    return found


@pytest.mark.parametrize('phrase', ODD)
def test_it_is_said_in_plain_words(shown: List[Tuple[str, str]], phrase: str) -> None:
    assert [it for it in shown if re.search(phrase, it[1])] == []
