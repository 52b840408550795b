# SPDX-License-Identifier: BSD-3-Clause
"""Qt's tests on a machine with other load: long limits for everything that must happen."""
from __future__ import annotations

from typing import Any, List

from pytestqt.qtbot import QtBot

LIMIT_MS = 60_000


class PatientQtBot(QtBot):
    """Waits longer than pytest-qt, whose limits of 5 s, and 1 s for windows, prove nothing."""

    def __init__(self, request: Any) -> None:
        super().__init__(request)
        self._widgets: List[Any] = []

    def addWidget(self, widget: Any, **options: Any) -> None:
        """Close a widget at the end of the test, and keep it until then.

        pytest-qt does not keep it. If it is a local variable of the test, it may be destroyed while
        it is painted afterwards, when the garbage collector happens to run.
        """
        super().addWidget(widget, **options)
        self._widgets.append(widget)

    def waitUntil(self, callback: Any, *, timeout: int = LIMIT_MS) -> None:
        """Wait until a condition holds."""
        super().waitUntil(callback, timeout=timeout)

    def waitSignal(self, signal: Any, *, timeout: int = LIMIT_MS, **options: Any) -> Any:
        """Wait for a signal, in a ``with``."""
        return super().waitSignal(signal, timeout=timeout, **options)

    def waitExposed(self, widget: Any, *, timeout: int = LIMIT_MS) -> Any:
        """Wait until a window is on the screen, in a ``with``."""
        return super().waitExposed(widget, timeout=timeout)
