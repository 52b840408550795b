# SPDX-License-Identifier: BSD-3-Clause
"""The progress of a long task, and the request to cancel it."""
from __future__ import annotations

import threading
from typing import Optional

from PyQt5.QtCore import QObject, pyqtSignal


class Progress(QObject):
    """Made in the GUI thread; the task reports to it from its own, the view shows it."""

    changed = pyqtSignal(float)
    """The finished part, 0 to 1; arrives in the GUI thread."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._cancelled = threading.Event()

    def report(self, fraction: float) -> None:
        """Report the finished part, 0 to 1; for any thread."""
        self.changed.emit(fraction)

    def cancel(self) -> None:
        """Ask the task to end soon."""
        self._cancelled.set()

    def is_cancelled(self) -> bool:
        """Return whether the task must end; for any thread."""
        return self._cancelled.is_set()
