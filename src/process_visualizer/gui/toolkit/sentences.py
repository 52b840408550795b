# SPDX-License-Identifier: BSD-3-Clause
"""How the window writes what parts of the program have said."""
from __future__ import annotations


def sentence(text: str) -> str:
    """Return a text as a sentence begins: with a capital letter, but for names and paths."""
    first = text.partition(' ')[0]
    return text[:1].upper() + text[1:] if first.isalpha() and first.islower() else text
