# SPDX-License-Identifier: BSD-3-Clause
"""The desktop's theme: dark or light."""
from __future__ import annotations

from typing import Any, Optional

from PyQt5.QtCore import QObject, pyqtSignal, pyqtSlot
from PyQt5.QtDBus import (
    QDBusConnection,
    QDBusMessage,
    QDBusPendingCallWatcher,
    QDBusPendingReply,
    QDBusVariant,
)
from PyQt5.QtGui import QPalette

from process_visualizer.gui.toolkit.theme import is_dark

_SERVICE, _PATH = 'org.freedesktop.portal.Desktop', '/org/freedesktop/portal/desktop'
_SETTINGS = 'org.freedesktop.portal.Settings'
_GROUP, _KEY = 'org.freedesktop.appearance', 'color-scheme'
_DARK, _LIGHT = 1, 2


class DesktopTheme(QObject):
    """Asks the desktop's portal (XDG Desktop Portal, Settings), and listens to its changes.

    Until it answers, and where there is none, the palette counts that Qt had from the desktop.
    """

    changed = pyqtSignal()

    def __init__(self, palette: QPalette, bus: Optional[QDBusConnection] = None,
                 parent: Optional[QObject] = None) -> None:
        """``palette`` is the one of the application before it was given another."""
        super().__init__(parent)
        self._is_dark = is_dark(palette)
        self._bus = bus or QDBusConnection.sessionBus()
        self._watcher: Optional[QDBusPendingCallWatcher] = None
        if self._bus.isConnected():
            self._bus.connect(_SERVICE, _PATH, _SETTINGS, 'SettingChanged', self._take_change)
            self._ask()

    @property
    def is_dark(self) -> bool:
        """Return whether the desktop is dark."""
        return self._is_dark

    def _ask(self) -> None:
        question = QDBusMessage.createMethodCall(_SERVICE, _PATH, _SETTINGS, 'Read')
        question.setArguments([_GROUP, _KEY])
        self._watcher = QDBusPendingCallWatcher(self._bus.asyncCall(question), self)
        self._watcher.finished.connect(self._take_answer)

    def _take_answer(self, watcher: QDBusPendingCallWatcher) -> None:
        reply = QDBusPendingReply(watcher)
        if not reply.isError() and reply.reply().arguments():
            self._take(reply.reply().arguments()[0])

    @pyqtSlot(QDBusMessage)
    def _take_change(self, message: QDBusMessage) -> None:
        group, key, value = (*message.arguments(), None, None, None)[:3]
        if (group, key) == (_GROUP, _KEY):
            self._take(value)

    def _take(self, value: Any) -> None:
        """Take the portal's value, which is wrapped once or twice."""
        while isinstance(value, QDBusVariant):
            value = value.variant()
        if value in (_DARK, _LIGHT) and (value == _DARK) != self._is_dark:
            self._is_dark = value == _DARK
            self.changed.emit()
