# SPDX-License-Identifier: BSD-3-Clause
"""Text from outside in a terminal: what would command the terminal is shown instead.

Names of topics, labels of marks, paths in recordings and messages of other nodes can hold escape
sequences, which change the window's title, hide lines, or write into the clipboard.
"""
from __future__ import annotations

import unicodedata
from typing import Optional, TextIO

_LINES = '\n\t'


def shown(text: object) -> str:
    """Return a text in which only lines and tabs are more than characters to be seen.

    Anything else that a terminal might obey, or that turns the direction of writing, and bytes
    that are not UTF-8, appear as in Python: the escape character as a backslash and x1b.
    """
    return ''.join(it if _is_seen(it) else _escaped(it) for it in str(text))


def shown_in_line(text: object) -> str:
    """Return the same for a part of a line: it cannot begin another one."""
    return shown(text).replace('\n', '\\n').replace('\t', ' ')


def say(text: object, file: Optional[TextIO] = None, end: str = '\n') -> None:
    """Print a text as ``shown`` returns it; the default is standard output."""
    print(shown(text), end=end, file=file, flush=True)


def _is_seen(character: str) -> bool:
    return character.isprintable() or character in _LINES \
        or unicodedata.category(character) == 'Zs'


def _escaped(character: str) -> str:
    if '\udc80' <= character <= '\udcff':  # a byte, as os.fsdecode has it
        return f'\\x{ord(character) - 0xdc00:02x}'
    return character.encode('unicode_escape').decode('ascii')
