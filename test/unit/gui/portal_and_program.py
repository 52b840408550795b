# SPDX-License-Identifier: BSD-3-Clause
"""A desktop's portal, and a program that asks it; exits with 0 if it finds the expected theme.

usage: portal_and_program.py SCHEME LATER-SCHEME EXPECTED
"""
from __future__ import annotations

import sys

from PyQt5.QtCore import Q_CLASSINFO, QCoreApplication, QObject, pyqtSlot
from PyQt5.QtDBus import (
    QDBusAbstractAdaptor,
    QDBusConnection,
    QDBusMessage,
    QDBusVariant,
)
from PyQt5.QtGui import QGuiApplication

from process_visualizer.gui.toolkit.theme import LIGHT, DesktopTheme, palette

PATH, SETTINGS = '/org/freedesktop/portal/desktop', 'org.freedesktop.portal.Settings'
GROUP, KEY = 'org.freedesktop.appearance', 'color-scheme'


class Portal(QDBusAbstractAdaptor):
    Q_CLASSINFO('D-Bus Interface', SETTINGS)

    def __init__(self, parent: QObject, scheme: int) -> None:
        super().__init__(parent)
        self.scheme = scheme

    @pyqtSlot(str, str, result=QDBusVariant)
    def Read(self, _group: str, _key: str) -> QDBusVariant:
        return QDBusVariant(QDBusVariant(self.scheme))


def main() -> int:
    begin, later, expected = sys.argv[1:4]
    app = QGuiApplication([sys.argv[0], '-platform', 'offscreen'])
    bus = QDBusConnection.sessionBus()
    home = QObject()
    portal = Portal(home, int(begin))
    assert bus.registerService('org.freedesktop.portal.Desktop')
    assert bus.registerObject(PATH, home)
    asker = QDBusConnection.connectToBus(QDBusConnection.SessionBus, 'asker')
    desktop = DesktopTheme(palette(LIGHT), asker)

    def take_answer() -> None:
        if later:
            desktop.changed.connect(end)
            portal.scheme = int(later)
            message = QDBusMessage.createSignal(PATH, SETTINGS, 'SettingChanged')
            message.setArguments([GROUP, KEY, QDBusVariant(portal.scheme)])
            bus.send(message)
        else:
            end()

    def end() -> None:
        QCoreApplication.exit(0 if desktop.is_dark == (expected == 'dark') else 1)

    assert desktop._watcher is not None
    desktop._watcher.finished.connect(take_answer)  # after the program has received it
    return app.exec_()


if __name__ == '__main__':
    sys.exit(main())
