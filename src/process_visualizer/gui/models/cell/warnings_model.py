# SPDX-License-Identifier: BSD-3-Clause
"""The present warnings of the nodes, for the window."""
from __future__ import annotations

import time
from typing import Callable, Optional, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.health.node_warnings import NodeWarning, NodeWarnings

PERIOD_MS = 500


class WarningsModel(QObject):
    """Updates twice a second while nodes run, however fast warnings arrive."""

    changed = pyqtSignal()

    def __init__(self, warnings: NodeWarnings, parent: Optional[QObject] = None,
                 clock_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(parent)
        self._warnings, self._clock_s = warnings, clock_s
        self.present: Tuple[NodeWarning, ...] = ()
        self._timer = QTimer(self, interval=PERIOD_MS)
        self._timer.timeout.connect(self.look)

    def follow(self, is_running: bool) -> None:
        """Set whether nodes are running."""
        if is_running == self._timer.isActive():
            return
        if is_running:
            self._timer.start()
        else:
            self._timer.stop()
            self._warnings.forget()
            self.look()

    def look(self) -> None:
        """Look now."""
        present = self._warnings.present(self._clock_s())
        if present != self.present:
            self.present = present
            self.changed.emit()
