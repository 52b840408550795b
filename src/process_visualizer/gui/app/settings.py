# SPDX-License-Identifier: BSD-3-Clause
"""The settings that the launcher keeps for the user, by name, in launcher.conf."""
from __future__ import annotations

import json
import os
from typing import Any, Dict, Optional

from PyQt5.QtCore import QSettings, QStandardPaths

from process_visualizer.whole_file import small_file

_MAX_SETTINGS_BYTES = 1 << 20  # the launcher writes some kB


class Settings:
    """A file of the user (``~/.config/process_visualizer/launcher.conf``).

    A path that cannot be a settings file is not opened: Qt would wait for a pipe forever.
    ``problem`` then says why, and values are kept only until the program ends.
    """

    def __init__(self, path: Optional[str] = None) -> None:
        """Read a file; the default is that of the user."""
        self._path = path or _users_file()
        self._settings: Optional[QSettings] = None
        self._unsaved: Dict[str, str] = {}
        self.problem = ''
        try:
            small_file(self._path, _MAX_SETTINGS_BYTES)
        except FileNotFoundError:
            pass  # this is the first session
        except OSError as error:
            self.problem = ('The settings of the last session cannot be read, and those of this '
                            f'one are not kept: {self._path}: {error.strerror}')
        if not self.problem:
            self._settings = QSettings(self._path, QSettings.NativeFormat)

    @property
    def folder(self) -> str:
        """The folder of the file."""
        return os.path.dirname(self._path)

    def value(self, name: str, default: Any = None) -> Any:
        """Return what was stored under a name, of the type in which it was stored."""
        text = self._unsaved.get(name) if self._settings is None else self._settings.value(name)
        if text is None:
            return default
        try:
            return json.loads(str(text))
        except ValueError:  # written by another version
            return default

    def store(self, name: str, value: Any) -> None:
        """Remember a number, text, truth value, list or dictionary."""
        text = json.dumps(value)
        if self._settings is None:
            self._unsaved[name] = text
        elif self._settings.value(name) != text:  # Qt would write the file in any case
            self._settings.setValue(name, text)

    def sync(self) -> None:
        """Write everything into the file now; otherwise Qt does, when the program is idle."""
        if self._settings is not None:
            self._settings.sync()


def _users_file() -> str:
    folder = QStandardPaths.writableLocation(QStandardPaths.GenericConfigLocation)
    return os.path.join(folder, 'process_visualizer', 'launcher.conf')
