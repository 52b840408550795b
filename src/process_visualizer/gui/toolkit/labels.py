# SPDX-License-Identifier: BSD-3-Clause
"""Texts in the window: labels, tooltips, and sentences from reports of the program.

Qt guesses whether a text is HTML, and so takes a file or topic with a name such as ``<b>a</b>`` for
HTML. In the window, no text is left to that guess.
"""
from __future__ import annotations

import html
from typing import Iterable, Sequence, Tuple

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QLabel


def plain_label(text: str = '') -> QLabel:
    """Return a label that shows its text as it is."""
    label = QLabel(text)
    label.setTextFormat(Qt.PlainText)
    return label


def html_label(text: str = '') -> QLabel:
    """Return a label for HTML; names in it must be escaped."""
    label = QLabel(text)
    label.setTextFormat(Qt.RichText)
    return label


def plain_tip(text: str) -> str:
    """Return a tooltip that shows a text as it is."""
    if not Qt.mightBeRichText(text):
        return text
    return f'<p style="white-space: pre">{html.escape(text)}</p>'


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
