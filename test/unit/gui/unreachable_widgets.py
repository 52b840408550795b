# SPDX-License-Identifier: BSD-3-Clause
"""A program that loses widgets while its style or theme changes.

usage: unreachable_widgets.py CHANGE
From then on, Python's garbage collector deletes them when it runs.
"""
from __future__ import annotations

import gc
import sys
import weakref
from pathlib import Path
from typing import List, Optional

from PyQt5.QtCore import QEvent, QObject
from PyQt5.QtWidgets import QApplication, QLabel, QPushButton, QWidget

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'src'))

from process_visualizer.gui.toolkit.theme import (  # noqa: E402
    DARK,  # noqa: E402
    apply_style,
    apply_theme,
)

CHANGES = {'style': apply_style, 'theme': lambda app: apply_theme(app, DARK)}
HEARD = (QEvent.StyleChange, QEvent.PaletteChange)


class Loser(QObject):
    """Object that loses widgets when Qt notifies another one of a change; it makes many objects."""

    def __init__(self, heard: QWidget) -> None:
        super().__init__()
        self.lost: List[QWidget] = []
        heard.installEventFilter(self)

    def eventFilter(self, heard: Optional[QObject], event: Optional[QEvent]) -> bool:
        if self.lost and event is not None and event.type() in HEARD:
            self.lost.clear()
            self.made: List[object] = [[] for _ in range(2 * gc.get_threshold()[0])]
        return super().eventFilter(heard, event)


def shown(widget: QWidget) -> QWidget:
    """Return a widget that was on the screen: its style is known."""
    widget.show()
    widget.hide()
    return widget


def main() -> None:
    """Run the command line while widgets are lost."""
    app = QApplication(sys.argv[:1] + ['-platform', 'offscreen'])
    apply_style(app)
    kept = [shown(QLabel('kept')) for _ in range(100)]
    loser = Loser(kept[50])
    for _ in range(100):
        lost = shown(QPushButton('lost'))
        lost.itself = lost  # only the collector finds it  # type: ignore[attr-defined]
        loser.lost.append(lost)
    last = weakref.ref(lost)
    del lost
    CHANGES[sys.argv[1]](app)
    gc.collect()
    assert not loser.lost and last() is None


main()
