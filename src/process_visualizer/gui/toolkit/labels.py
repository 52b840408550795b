# SPDX-License-Identifier: BSD-3-Clause
"""Labels and tooltips that say whether their text is plain or HTML.

Qt guesses by itself, and so takes a file or topic with a name such as ``<b>a</b>`` for HTML. In the
window, no text is left to that guess.
"""
from __future__ import annotations

import html

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
