# SPDX-License-Identifier: BSD-3-Clause
"""The operator's choice of a theme."""
from __future__ import annotations

from enum import Enum
from typing import Optional

from PyQt5.QtCore import QObject
from PyQt5.QtWidgets import QActionGroup, QApplication, QMenu, QToolButton

from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.toolkit.desktop_theme import DesktopTheme
from process_visualizer.gui.toolkit.style import apply_theme
from process_visualizer.gui.toolkit.theme import DARK, LIGHT
from process_visualizer.gui.views.parts.labels import tool_button

_SETTING = 'theme'


class Wanted(Enum):
    """A theme, or the one that the desktop has."""

    DESKTOP = 'Follow desktop'
    LIGHT = 'Light'
    DARK = 'Dark'


def theme_choice(settings: Settings, parent: QObject) -> ThemeChoice:
    """Return the choice for the running application."""
    app = QApplication.instance()
    assert isinstance(app, QApplication)
    desktop = app.findChild(DesktopTheme) or DesktopTheme(app.palette(), parent=app)
    return ThemeChoice(app, desktop, settings, parent)


class ThemeChoice(QObject):
    """Gives the application the theme that is chosen, and remembers the choice."""

    def __init__(self, app: QApplication, desktop: DesktopTheme, settings: Settings,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._app, self._desktop, self._settings = app, desktop, settings
        names = {wanted.name: wanted for wanted in Wanted}
        self.wanted = names.get(settings.value(_SETTING, ''), Wanted.DESKTOP)
        desktop.changed.connect(self._apply)
        self._apply()

    def choose(self, wanted: Wanted) -> None:
        """Take another choice."""
        self.wanted = wanted
        self._settings.store(_SETTING, wanted.name)
        self._apply()

    def button(self) -> QToolButton:
        """Return a button with a menu of the choices."""
        button = tool_button('theme', 'theme', 'Light or dark', lambda: None)
        menu = QMenu(button)
        group = QActionGroup(menu)
        for wanted in Wanted:
            action = menu.addAction(wanted.value)
            action.setCheckable(True)
            action.setChecked(wanted is self.wanted)
            action.setActionGroup(group)
            action.triggered.connect(lambda _, wanted=wanted: self.choose(wanted))
        button.setMenu(menu)
        button.setPopupMode(QToolButton.InstantPopup)
        button.setStyleSheet('QToolButton::menu-indicator { image: none; }')
        return button

    def _apply(self) -> None:
        is_dark = self._desktop.is_dark if self.wanted is Wanted.DESKTOP \
            else self.wanted is Wanted.DARK
        apply_theme(self._app, DARK if is_dark else LIGHT)
