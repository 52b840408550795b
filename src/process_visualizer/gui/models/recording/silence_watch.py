# SPDX-License-Identifier: BSD-3-Clause
"""Notices that somebody who speaks several times a second does not speak any more."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

_SILENCE_MS, _SILENCES = 1000, 3


class SilenceWatch(QObject):
    """Counts the times without a word, instead of measuring one long one.

    So a window that was held up itself does not take what waits for it for silence.
    """

    silent = pyqtSignal()
    """Nobody has spoken for long; the next ``hear`` ends it."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._count = 0
        self._timer = QTimer(self, interval=_SILENCE_MS)
        self._timer.timeout.connect(self._wait)

    def hear(self) -> None:
        """Begin to wait for the next word."""
        self._count = 0
        self._timer.start()

    def stop(self) -> None:
        """Wait for nothing."""
        self._timer.stop()

    def _wait(self) -> None:
        self._count += 1
        if self._count >= _SILENCES:
            self.stop()
            self.silent.emit()
