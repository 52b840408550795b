# SPDX-License-Identifier: BSD-3-Clause
"""Qt's tests on a machine that has other work: they wait for what shall happen, and long enough."""
from __future__ import annotations

from typing import Any

from pytestqt.qtbot import QtBot

LIMIT_MS = 60_000


class PatientQtBot(QtBot):
    """pytest-qt gives up after 5 s, for windows after 1 s: that proves nothing of the program."""

    def waitUntil(self, callback: Any, *, timeout: int = LIMIT_MS) -> None:
        """Wait until a condition holds."""
        super().waitUntil(callback, timeout=timeout)

    def waitSignal(self, signal: Any, *, timeout: int = LIMIT_MS, **options: Any) -> Any:
        """Wait for a signal, in a ``with``."""
        return super().waitSignal(signal, timeout=timeout, **options)

    def waitExposed(self, widget: Any, *, timeout: int = LIMIT_MS) -> Any:
        """Wait until a window is on the screen, in a ``with``."""
        return super().waitExposed(widget, timeout=timeout)
