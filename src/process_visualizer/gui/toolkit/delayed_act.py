# SPDX-License-Identifier: BSD-3-Clause
"""An act that can be taken back for some seconds."""
from __future__ import annotations

import math
import time
from typing import Callable, Optional

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

_LOOK_MS = 200


class DelayedAct(QObject):
    """Waits, then acts; ``changed`` tells of each second that is left."""

    changed = pyqtSignal()

    def __init__(self, delay_s: float, act: Callable[[], None],
                 clock_s: Callable[[], float] = time.monotonic,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._delay_s, self._act, self._clock_s = delay_s, act, clock_s
        self._due_s: Optional[float] = None
        self._left_s = 0
        self._timer = QTimer(self)
        self._timer.setInterval(_LOOK_MS)
        self._timer.timeout.connect(self.look)

    @property
    def is_waiting(self) -> bool:
        """Return whether the act is to come, and can be taken back."""
        return self._due_s is not None

    @property
    def left_s(self) -> int:
        """The seconds until then; 0 if nothing is to come."""
        return self._left_s

    def begin(self) -> None:
        """Act after the delay."""
        self._due_s = self._clock_s() + self._delay_s
        self._timer.start()
        self.look()

    def take_back(self) -> None:
        """Do not act."""
        self._due_s = None
        self._timer.stop()
        self._show(0)

    def look(self) -> None:
        """Act if it is time."""
        if self._due_s is None:
            return
        left_s = self._due_s - self._clock_s()
        if left_s > 0.0:
            self._show(math.ceil(left_s))
        else:
            self.take_back()
            self._act()

    def _show(self, left_s: int) -> None:
        if left_s != self._left_s:
            self._left_s = left_s
            self.changed.emit()
