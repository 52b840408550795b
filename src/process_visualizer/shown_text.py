# SPDX-License-Identifier: BSD-3-Clause
"""Prints text from outside in a terminal, with control characters escaped.

Names of topics, labels of marks, paths in recordings and messages of other nodes can contain escape
sequences that change the window's title, hide lines, or write to the clipboard.
"""
from __future__ import annotations

import unicodedata
from typing import Optional, TextIO

_LINES = '\n\t'


def shown(text: object) -> str:
    """Return a text without control characters except newlines and tabs.

    Anything else that a terminal might obey, characters that change the direction of writing, and
    bytes that are not UTF-8 are escaped as in Python: the escape character as a backslash and x1b.
    """
    return ''.join(it if _is_seen(it) else _escaped(it) for it in str(text))


def shown_in_line(text: object) -> str:
    """Return the text of ``shown`` for a part of a line, which cannot begin a new line."""
    return shown(text).replace('\n', '\\n').replace('\t', ' ')


def say(text: object, file: Optional[TextIO] = None, end: str = '\n') -> None:
    """Print a text as returned by ``shown``; the default file is standard output."""
    print(shown(text), end=end, file=file, flush=True)


def _is_seen(character: str) -> bool:
    return character.isprintable() or character in _LINES \
        or unicodedata.category(character) == 'Zs'


def _escaped(character: str) -> str:
    if '\udc80' <= character <= '\udcff':  # a byte, as decoded by os.fsdecode
        return f'\\x{ord(character) - 0xdc00:02x}'
    return character.encode('unicode_escape').decode('ascii')
