# SPDX-License-Identifier: BSD-3-Clause
"""Unexpected errors: they are logged and shown, and the program continues."""
from __future__ import annotations

import html
import logging
import os
import sys
import threading
import traceback
from logging.handlers import RotatingFileHandler
from types import TracebackType
from typing import Dict, NamedTuple, Optional, Type

import rospkg
from PyQt5.QtCore import QObject, QSize, Qt, pyqtSignal
from PyQt5.QtWidgets import QWidget

from process_visualizer.gui.toolkit.dialogs import TextDialog, show_aside
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label

_MAX_ERRORS = 20
_ICON_PX = 28


class CaughtError(NamedTuple):
    """An error: its summary, its traceback, and where it was raised (file:line)."""

    summary: str
    traceback: str
    place: str


class ErrorDialog(TextDialog):
    """Lists each error once, with its count; the program keeps running."""

    def __init__(self, log_file: str, parent: Optional[QWidget] = None) -> None:
        super().__init__('error', 'Process Visualizer: an error', parent)
        self._log_file = log_file
        self._errors: Dict[CaughtError, int] = {}
        picture = plain_label()
        picture.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))
        self.row.insertWidget(0, picture, 0, Qt.AlignTop)
        self.finished.connect(lambda _: self._errors.clear())  # the operator has seen them

    def add(self, error: CaughtError) -> None:
        """Show an error, or count it if it is listed already."""
        known = next((it for it in self._errors
                      if (it.place, it.summary) == (error.place, error.summary)), error)
        if known in self._errors or len(self._errors) < _MAX_ERRORS:
            self._errors[known] = self._errors.get(known, 0) + 1
        self._refresh()
        if not self.isVisible():
            show_aside(self)

    def _refresh(self) -> None:
        total = sum(self._errors.values())
        number = 'An error has' if total == 1 else f'{total} errors have'
        where = f' Details are also in <i>{html.escape(self._log_file)}</i>.' \
            if self._log_file else ''
        self.show_text(
            f'<b>{number} occurred in the launcher itself.</b> The program continues; nodes and '
            f'recordings are not affected. Please send this to the maintainer.{where}',
            '\n\n'.join(f'{count}×  {error.summary}\n\n{error.traceback.rstrip()}'
                        for error, count in self._errors.items()))


_LOG_BYTES = 1 << 20
_FORMAT = '%(asctime)s %(threadName)s %(message)s'


class UncaughtErrors(QObject):
    """Accepts errors from any thread; reports them in the GUI thread."""

    caught = pyqtSignal(object)
    """A CaughtError."""

    def __init__(self, log_file: str = '', parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._logger = logging.Logger('process_visualizer.launcher')
        self.log_file = log_file if self._log_into(log_file) else ''

    def install(self) -> None:
        """Become the hook of this process for uncaught exceptions (sys and threading)."""
        sys.excepthook = self.take
        threading.excepthook = self._take_from_thread

    def take(self, kind: Type[BaseException], error: BaseException,
             trace: Optional[TracebackType]) -> None:
        """Log and report an error; Ctrl-C and exits are handled as usual."""
        if not issubclass(kind, Exception):
            sys.__excepthook__(kind, error, trace)
            return
        text = ''.join(traceback.format_exception(kind, error, trace))
        sys.stderr.write(text)
        self._logger.error('%s', text)
        summary = ''.join(traceback.format_exception_only(kind, error)).strip()
        self.caught.emit(CaughtError(summary, text, _place(trace)))

    def _take_from_thread(self, arguments: threading.ExceptHookArgs) -> None:
        if arguments.exc_type is not SystemExit and arguments.exc_value is not None:
            self.take(arguments.exc_type, arguments.exc_value, arguments.exc_traceback)

    def _log_into(self, file: str) -> bool:
        if not file:
            return False
        try:
            os.makedirs(os.path.dirname(file), exist_ok=True)
            handler = RotatingFileHandler(file, maxBytes=_LOG_BYTES, backupCount=1,
                                          encoding='utf-8')
        except OSError as error:
            sys.stderr.write(f'errors are not logged: {error}\n')
            return False
        handler.setFormatter(logging.Formatter(_FORMAT))
        self._logger.addHandler(handler)
        return True


def install_hooks(window: QWidget) -> UncaughtErrors:
    """Log uncaught errors into the launcher's log file and show them in a dialog of the window."""
    log_file = os.path.join(rospkg.get_ros_home(), 'process_visualizer', 'launcher.log')
    errors = UncaughtErrors(log_file, window)
    dialog = ErrorDialog(errors.log_file, window)
    errors.caught.connect(dialog.add, Qt.QueuedConnection)
    errors.install()
    return errors


def _place(trace: Optional[TracebackType]) -> str:
    """Return file:line where an error was raised."""
    frames = traceback.extract_tb(trace, limit=-1)
    return f'{frames[0].filename}:{frames[0].lineno}' if frames else ''
