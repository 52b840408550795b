# SPDX-License-Identifier: BSD-3-Clause
"""The settings of the launcher: window, configuration, bag folder and options."""
from __future__ import annotations

import json
from typing import Any, Optional

from PyQt5.QtCore import QByteArray, QSettings


class Settings:
    """A file of the user (``~/.config/process_visualizer/launcher.conf``)."""

    def __init__(self, settings: Optional[QSettings] = None) -> None:
        self._settings = settings or QSettings('process_visualizer', 'launcher')

    def value(self, name: str, default: Any = None) -> Any:
        """Return what was stored under a name, of the type in which it was stored."""
        text = self._settings.value(name)
        if text is None:
            return default
        try:
            return json.loads(str(text))
        except ValueError:  # written by another version
            return default

    def store(self, name: str, value: Any) -> None:
        """Remember a number, text, truth value, list or dictionary."""
        self._settings.setValue(name, json.dumps(value))

    def sync(self) -> None:
        """Write everything into the file now; otherwise Qt does, when the program is idle."""
        self._settings.sync()

    def geometry(self, screen: str) -> Optional[QByteArray]:
        """Return the window's place on a screen, as saved by Qt."""
        text = self.value(f'geometry/{screen}')
        return None if text is None else QByteArray.fromBase64(str(text).encode())

    def store_geometry(self, screen: str, geometry: QByteArray) -> None:
        """Remember the window's place on a screen."""
        self.store(f'geometry/{screen}', bytes(geometry.toBase64()).decode())
