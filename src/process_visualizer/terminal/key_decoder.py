# SPDX-License-Identifier: BSD-3-Clause
"""Turns the bytes that a terminal sends into keys."""
from __future__ import annotations

import codecs
import re
from typing import Dict, List

ESCAPE = 'escape'
UNKNOWN = 'unknown'

_NAMES: Dict[str, str] = {
    '[A': 'up', '[B': 'down', '[C': 'right', '[D': 'left', '[H': 'home', '[F': 'end',
    'OA': 'up', 'OB': 'down', 'OC': 'right', 'OD': 'left', 'OH': 'home', 'OF': 'end',
    '[1~': 'home', '[4~': 'end', '[7~': 'home', '[8~': 'end',
}
# After the escape: a control sequence, a shifted letter, or a key pressed together with Alt.
_SEQUENCE = re.compile(r'\x1b(\[[0-?]{0,16}[ -/]{0,4}[@-~]|O[@-~]|[^\[O\x1b])', re.DOTALL)
_BEGINNING = re.compile(r'\x1b(\[[0-?]{0,16}[ -/]{0,4}|O)?\Z')


class KeyDecoder:
    """Names keys: a character by itself, left, right, up, down, home, end, escape, unknown.

    Sequences may come in any number of pieces.
    """

    def __init__(self) -> None:
        """Nothing has been received yet."""
        self._text = ''
        self._decoder = codecs.getincrementaldecoder('utf-8')('replace')

    @property
    def is_waiting(self) -> bool:
        """Return whether an escape was received that may be a key or the beginning of one."""
        return bool(self._text)

    def feed(self, data: bytes) -> List[str]:
        """Return the keys that these bytes complete."""
        self._text += self._decoder.decode(data)
        keys: List[str] = []
        while self._text and not _BEGINNING.match(self._text):
            keys.append(self._next_key())
        return keys

    def flush(self) -> List[str]:
        """Return the unfinished key, as nothing more is coming: escape, or an unknown one."""
        keys = [ESCAPE if self._text == '\x1b' else UNKNOWN] if self._text else []
        self._text = ''
        return keys

    def _next_key(self) -> str:
        sequence = _SEQUENCE.match(self._text)
        if sequence:
            key = _NAMES.get(sequence.group(1), UNKNOWN)
        else:
            key = ESCAPE if self._text[0] == '\x1b' else self._text[0]
        self._text = self._text[sequence.end() if sequence else 1:]
        return key
