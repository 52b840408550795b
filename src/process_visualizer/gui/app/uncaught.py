# SPDX-License-Identifier: BSD-3-Clause
"""Unexpected errors: they are logged and shown, and the program continues."""
from __future__ import annotations

import logging
import os
import sys
import threading
import traceback
from logging.handlers import RotatingFileHandler
from types import TracebackType
from typing import Optional, Type

import rospkg
from PyQt5.QtCore import QObject, Qt, pyqtSignal
from PyQt5.QtWidgets import QWidget

from process_visualizer.gui.app.error_dialog import CaughtError, ErrorDialog

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
    """Return file:line where it was raised."""
    frames = traceback.extract_tb(trace, limit=-1)
    return f'{frames[0].filename}:{frames[0].lineno}' if frames else ''
