# SPDX-License-Identifier: BSD-3-Clause
"""The operator's own views of a choice of devices, by name."""
from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional
from urllib.parse import quote, unquote

import rospkg

from process_visualizer.rviz.view_file import read_view

_ENDING = '.rviz'
_CHOSEN_FILE = 'chosen.txt'


class SavedViewError(Exception):
    """A view cannot be saved or read; says which and why."""


class SavedViews:
    """The views for some devices of a configuration, as copies of RViz's own files.

    They are in ``~/.ros/process_visualizer/views``, in a folder for each set of devices.
    """

    def __init__(self, configuration: str, devices: Iterable[str]) -> None:
        """``configuration`` is the path of the file, ``devices`` are the chosen names."""
        path = os.path.abspath(configuration)
        key = hashlib.sha256('\0'.join([path, *sorted(devices)]).encode('utf-8', 'surrogateescape'))
        self.folder = (Path(rospkg.get_ros_home()) / 'process_visualizer' / 'views'
                       / f'{Path(path).stem}-{key.hexdigest()[:16]}')

    def names(self) -> List[str]:
        """The names of all views, in alphabetical order."""
        return sorted(unquote(path.stem) for path in self.folder.glob(f'*{_ENDING}'))

    def save(self, name: str, rviz_file: str) -> None:
        """Keep a copy of a file written by RViz, and choose it; replaces one of that name.

        Raises:
            SavedViewError: it cannot be written, or the file is not one of RViz's.
        """
        if not name.strip():
            raise SavedViewError('a view needs a name')
        try:
            read_view(rviz_file)
            self.folder.mkdir(parents=True, exist_ok=True)
            _write_whole(self._path(name), Path(rviz_file).read_bytes())
        except (OSError, ValueError) as error:
            raise SavedViewError(f'the view "{name}" cannot be saved: {_reason(error)}') from None
        self.choose(name)

    def load(self, name: str) -> Dict[str, Any]:
        """The content of a view's file.

        Raises:
            SavedViewError: it cannot be read.
        """
        try:
            return read_view(str(self._path(name)))
        except (OSError, ValueError) as error:
            raise SavedViewError(f'the view "{name}" cannot be read: {_reason(error)}; the '
                                 'generated view is used') from None

    def remove(self, name: str) -> None:
        """Delete a view.

        Raises:
            SavedViewError: it cannot be removed.
        """
        try:
            self._path(name).unlink()
        except OSError as error:
            raise SavedViewError(f'the view "{name}" cannot be removed: {_reason(error)}') from None
        if self.chosen() is None:
            self.choose(None)

    def choose(self, name: Optional[str]) -> None:
        """Choose the view of the next launch; None is the generated one.

        Raises:
            SavedViewError: it cannot be written.
        """
        try:
            if name is None:
                (self.folder / _CHOSEN_FILE).unlink(missing_ok=True)
            else:
                _write_whole(self.folder / _CHOSEN_FILE, name.encode('utf-8', 'surrogatepass'))
        except OSError as error:
            raise SavedViewError('the choice of a view cannot be saved: '
                                 f'{_reason(error)}') from None

    def chosen(self) -> Optional[str]:
        """The chosen name, or None if there is none, or the view no longer exists."""
        try:
            name = (self.folder / _CHOSEN_FILE).read_bytes().decode('utf-8', 'surrogatepass')
        except (OSError, UnicodeDecodeError):
            return None
        return name if self._path(name).is_file() else None

    def _path(self, name: str) -> Path:
        """Its file; characters not allowed in file names, and dots, are encoded."""
        return self.folder / (quote(name, safe=' ', errors='surrogatepass').replace('.', '%2E')
                              + _ENDING)


def _write_whole(path: Path, content: bytes) -> None:
    """Write to another file first, so that a full disk keeps the old one."""
    handle, new = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, 'wb') as file:
            file.write(content)
        os.replace(new, path)
    except OSError:
        os.unlink(new)
        raise


def _reason(error: Exception) -> str:
    return getattr(error, 'strerror', None) or str(error)
