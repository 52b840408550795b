# SPDX-License-Identifier: BSD-3-Clause
"""Wording in the window of reports from parts of the program."""
from __future__ import annotations

from typing import Iterable, Sequence, Tuple


def sentence(text: str) -> str:
    """Return a text with a capital first letter, except for names and paths."""
    first = text.partition(' ')[0]
    return text[:1].upper() + text[1:] if first.isalpha() and first.islower() else text


def within_sentence(text: str) -> str:
    """Return a text for use within a sentence: without a capital first letter."""
    first = text.partition(' ')[0]
    return text[:1].lower() + text[1:] if first.isalpha() and first[1:].islower() else text


def listing(words: Sequence[str]) -> str:
    """Return words as a list in a sentence, such as "one, two and three"."""
    *first, last = words
    return f'{", ".join(first)} and {last}' if first else last


_DETAILS = '\n\nDetails:\n'


def with_details(text: str, details: Iterable[str]) -> str:
    """Return a text with lines that are shown only on request."""
    return _DETAILS.join([text, '\n'.join(details)])


def parted(text: str) -> Tuple[str, str]:
    """Return text and details that ``with_details`` has joined; '' without details."""
    brief, _, details = text.partition(_DETAILS)
    return brief, details
