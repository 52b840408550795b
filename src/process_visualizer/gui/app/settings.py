# SPDX-License-Identifier: BSD-3-Clause
"""The settings of the launcher: window, configuration, bag folder and options."""
from __future__ import annotations

import json
import os
from typing import Any, Optional

from PyQt5.QtCore import QSettings


class Settings:
    """A file of the user (``~/.config/process_visualizer/launcher.conf``)."""

    def __init__(self, settings: Optional[QSettings] = None) -> None:
        self._settings = settings or QSettings('process_visualizer', 'launcher')

    @property
    def folder(self) -> str:
        """The folder of the file."""
        return os.path.dirname(self._settings.fileName())

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
