# SPDX-License-Identifier: BSD-3-Clause
"""The colors of the launcher: a light theme and a dark one, each with one accent color."""
from __future__ import annotations

import gc
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, Callable, Iterator, Optional, Tuple

from PyQt5.QtCore import QEvent, QObject, Qt, pyqtSignal, pyqtSlot
from PyQt5.QtDBus import (
    QDBusConnection,
    QDBusMessage,
    QDBusPendingCallWatcher,
    QDBusPendingReply,
    QDBusVariant,
)
from PyQt5.QtGui import QColor, QFont, QGuiApplication, QPalette
from PyQt5.QtWidgets import (
    QApplication,
    QPushButton,
    QRadioButton,
    QStyleFactory,
    QToolTip,
    QWidget,
)


@dataclass(frozen=True)
class Theme:
    """Colors by their use, as Qt writes them (#rrggbb)."""

    accent: str
    text: str
    quiet: str  # text of less weight: units, hints, axes
    grid: str  # lines behind curves
    line: str  # borders and grids
    window: str
    good: str
    warning: str
    bad: str
    selected: str  # behind a selected row
    paper: str  # behind lists, fields and curves
    on_signal: str  # text on accent, warning, bad, text
    behind_bad: str  # backgrounds of notices
    behind_warning: str
    behind_good: str
    used: str  # used space of a disk: a quiet accent color
    shape: str  # icons whose color has no meaning
    waiting: str
    tick: str  # marks of a scale
    band: str  # the band of good runs behind a curve, and the line in its middle
    band_line: str
    disabled_text: str
    disabled_shape: str
    indicator: str  # inside of a check box or radio button
    indicator_tick: str
    indicator_off: str  # disabled
    indicator_off_tick: str
    groove: str  # of a slider
    loop: str
    loop_off: str
    row: str  # behind every other row
    button: str
    light: str  # edges of buttons and frames, from light to dark
    midlight: str
    mid: str
    dark: str
    shadow: str
    primary: str  # the button that launches, and behind selected text
    primary_hovered: str
    primary_pressed: str
    primary_focus: str
    primary_off: str
    primary_off_text: str


LIGHT = Theme(
    accent='#1f6f9f', text='#23292f', quiet='#5c6670', grid='#e9ecef', line='#d3d8dd',
    window='#f3f5f6', good='#247a4b', warning='#9a5b00', bad='#c0392b', selected='#e6f0f6',
    paper='#ffffff', on_signal='#ffffff', behind_bad='#fdf4f3', behind_warning='#fdf8ef',
    behind_good='#f2f9f4', used='#93b4c8', shape='#3c454d', waiting='#7a8590', tick='#aab2b9',
    band='#cfe0ea', band_line='#7fa3b8',
    disabled_text='#a3abb2', disabled_shape='#b4bbc1', indicator='#ffffff',
    indicator_tick='#23292f', indicator_off='#f3f5f6', indicator_off_tick='#a3abb2',
    groove='#dde2e6', loop='#8a5fb0', loop_off='#a0a8af', row='#f7f8f9', button='#fafbfb',
    light='#ffffff', midlight='#eceff1', mid='#c3c9ce', dark='#9aa3ab', shadow='#6b747c',
    primary='#1f6f9f', primary_hovered='#2a7fb3', primary_pressed='#185a82',
    primary_focus='#8fb8d0', primary_off='#d9dee2', primary_off_text='#87919a')

DARK = Theme(
    accent='#62b0de', text='#e3e7ea', quiet='#a4aeb7', grid='#262c32', line='#3c444c',
    window='#1f2428', good='#5fc48b', warning='#e2a44a', bad='#f28577', selected='#24384a',
    paper='#171b1e', on_signal='#14181b', behind_bad='#38221f', behind_warning='#352b1a',
    behind_good='#1b3025', used='#3f6d8a', shape='#c4ccd3', waiting='#8d99a4', tick='#69737c',
    band='#26404f', band_line='#55798d',
    disabled_text='#69727a', disabled_shape='#59626a', indicator='#d3dae0',
    indicator_tick='#14181b', indicator_off='#454e56', indicator_off_tick='#98a3ad',
    groove='#363e45', loop='#b794dc', loop_off='#77818a', row='#1b2024', button='#2a3036',
    light='#3a424a', midlight='#323940', mid='#454e56', dark='#101316', shadow='#0a0c0e',
    primary='#1f6f9f', primary_hovered='#2a7fb3', primary_pressed='#185a82',
    primary_focus='#8fb8d0', primary_off='#2c3339', primary_off_text='#77818a')


def theme() -> Theme:
    """Return the theme of the application, according to its palette."""
    return DARK if is_dark(QGuiApplication.palette()) else LIGHT


def is_dark(palette: QPalette) -> bool:
    """Return whether a palette has light text on a dark window."""
    return bool(palette.color(QPalette.Window).lightness()
                < palette.color(QPalette.WindowText).lightness())


# Colors of widgets that follow the theme of the application.

_COLOR, _SHEET_KEY, _SELECTION = 'theme_color', 'theme_sheet', 'theme_selection'


def color(widget: QWidget, name: str) -> None:
    """Set the color of a widget's text while it is enabled; ``name`` is a field of Theme."""
    widget.setProperty(_COLOR, name)
    chosen = QColor(getattr(theme(), name))
    if widget.palette().color(QPalette.Active, QPalette.WindowText) != chosen:
        palette = QPalette()  # its other colors follow the application
        for group in (QPalette.Active, QPalette.Inactive):
            palette.setColor(group, QPalette.WindowText, chosen)
        widget.setPalette(palette)


def color_selection(view: QWidget, name: str) -> None:
    """Set the color behind selected rows; ``name`` is a field of Theme."""
    view.setProperty(_SELECTION, name)
    palette = QPalette()
    palette.setColor(QPalette.Highlight, QColor(getattr(theme(), name)))
    view.setPalette(palette)


def set_sheet(widget: QWidget, sheet: str) -> None:
    """Set a widget's style sheet, in which <NAME> stands for the color of that name in Theme."""
    widget.setProperty(_SHEET_KEY, sheet)
    colored = with_colors(sheet)
    if widget.styleSheet() != colored:
        widget.setStyleSheet(colored)


def with_colors(sheet: str) -> str:
    """Return a style sheet with each <NAME> replaced by the color of the theme."""
    for name, value in asdict(theme()).items():
        sheet = sheet.replace(f'<{name}>', value)
    return sheet


def recolor(app: QApplication) -> None:
    """Color all widgets again after the theme has changed."""
    for widget in app.allWidgets():
        for name, renew in ((_COLOR, color), (_SHEET_KEY, set_sheet),
                            (_SELECTION, color_selection)):
            if widget.property(name):
                renew(widget, widget.property(name))


class ThemeFollower(QObject):
    """Calls a function when a widget's theme changes, for parts that Qt does not repaint."""

    def __init__(self, widget: QWidget, show: Callable[[], None]) -> None:
        super().__init__(widget)
        self._show = show
        self._shown = theme()
        widget.installEventFilter(self)

    def eventFilter(self, widget: Optional[QObject], event: Optional[QEvent]) -> bool:
        """Notice that the palette belongs to another theme."""
        if event is not None and event.type() == QEvent.PaletteChange and theme() != self._shown:
            self._shown = theme()
            self._show()
        return super().eventFilter(widget, event)


_SERVICE, _PATH = 'org.freedesktop.portal.Desktop', '/org/freedesktop/portal/desktop'
_SETTINGS = 'org.freedesktop.portal.Settings'
_GROUP, _KEY = 'org.freedesktop.appearance', 'color-scheme'
_DARK, _LIGHT = 1, 2


class DesktopTheme(QObject):
    """Reads the theme from the desktop's portal (XDG Desktop Portal, Settings), and follows it.

    Until the portal answers, or without a portal, the palette that Qt got from the desktop counts.
    """

    changed = pyqtSignal()

    def __init__(self, palette: QPalette, bus: Optional[QDBusConnection] = None,
                 parent: Optional[QObject] = None) -> None:
        """Initialize with the palette that the application had before another was set."""
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
        """Adopt the portal's value, which is wrapped once or twice."""
        while isinstance(value, QDBusVariant):
            value = value.variant()
        if value in (_DARK, _LIGHT) and (value == _DARK) != self._is_dark:
            self._is_dark = value == _DARK
            self.changed.emit()


# Colors chosen for RViz, made readable with the colors of the launcher.

_MIN_CONTRAST = 3.6  # to the paper; WCAG 2.1 requires 3 for graphics and 4.5 for small text
_SATURATION = 0.85
_STEP = 0.05


def readable_color(color: Tuple[float, float, float]) -> QColor:
    """Return a color (red, green, blue, 0 to 1), less saturated and visible on the paper."""
    return QColor(_readable(color, theme().paper))


@lru_cache(maxsize=256)
def _readable(color: Tuple[float, float, float], paper_name: str) -> QColor:
    """Return the readable color, cached as each picture needs the same few colors."""
    chosen = QColor.fromRgbF(*(min(max(part, 0.0), 1.0) for part in color))
    readable = QColor.fromHsvF(max(chosen.hsvHueF(), 0.0), _SATURATION * chosen.hsvSaturationF(),
                               chosen.valueF())
    paper = QColor(paper_name)
    while contrast(readable, paper) < _MIN_CONTRAST:
        readable = _farther(readable, paper)
    return readable


def translucent(name: str, alpha: int) -> QColor:
    """Return a color of the theme (#rrggbb) with an opacity from 0 to 255."""
    color = QColor(name)
    color.setAlpha(alpha)
    return color


def _farther(color: QColor, paper: QColor) -> QColor:
    """Return a darker color on light paper; on dark paper a brighter one, at the limit a paler."""
    hue, saturation, value, _alpha = color.getHsvF()
    if _luminance(paper) > 0.5:
        return QColor.fromHsvF(max(hue, 0.0), saturation, value * (1.0 - _STEP))
    return QColor.fromHsvF(max(hue, 0.0), saturation if value < 1.0 else saturation * 0.9,
                           min(value + _STEP, 1.0))


def contrast(one: QColor, other: QColor) -> float:
    """Return the contrast ratio of WCAG 2.1 (1.4.3) of two colors, at least 1."""
    darker, lighter = sorted(map(_luminance, (one, other)))
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(color: QColor) -> float:
    red, green, blue = (_linear(part) for part in color.getRgbF()[:3])
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linear(part: float) -> float:
    return part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4


# The style of the launcher: one accent color on a calm palette, light or dark.

_ROLES = {
    QPalette.Window: 'window', QPalette.WindowText: 'text', QPalette.Base: 'paper',
    QPalette.AlternateBase: 'row', QPalette.Text: 'text', QPalette.Button: 'button',
    QPalette.ButtonText: 'text', QPalette.Light: 'light', QPalette.Midlight: 'midlight',
    QPalette.Mid: 'mid', QPalette.Dark: 'dark', QPalette.Shadow: 'shadow',
    QPalette.Highlight: 'primary', QPalette.Link: 'accent', QPalette.LinkVisited: 'accent',
    QPalette.ToolTipBase: 'paper', QPalette.ToolTipText: 'text',
    QPalette.PlaceholderText: 'quiet',
}
_ON_PRIMARY = (QPalette.BrightText, QPalette.HighlightedText)
_DISABLED_ROLES = (QPalette.WindowText, QPalette.Text, QPalette.ButtonText)
STYLE_SHEET = """
QGroupBox { border: 0; margin-top: 1.6em; padding: 0; font-weight: bold; }
QGroupBox::title { subcontrol-origin: margin; subcontrol-position: top left; padding: 0; }
QRadioButton::indicator { width: 12px; height: 12px; border-radius: 7px;
  border: 1px solid palette(window-text); background: palette(base); }
QRadioButton::indicator:focus, QRadioButton::indicator:hover { border-color: palette(link); }
QRadioButton::indicator:checked { background: qradialgradient(cx: 0.5, cy: 0.5, radius: 0.5,
  fx: 0.5, fy: 0.5, stop: 0 palette(text), stop: 0.55 palette(text), stop: 0.65 palette(base),
  stop: 1 palette(base)); }
QToolTip { background: palette(base); color: palette(text); border: 1px solid palette(mid);
  padding: 3px; }
"""
"""The sheet of all widgets in all themes: a new sheet would make Qt polish all widgets again."""
_PRIMARY = """
QPushButton { background: <primary>; color: white; border: 0; border-radius: 3px;
  font-weight: bold; }
QPushButton:hover { background: <primary_hovered>; }
QPushButton:pressed { background: <primary_pressed>; }
QPushButton:focus { border: 2px solid <primary_focus>; }
QPushButton:disabled { background: <primary_off>; color: <primary_off_text>; }
"""


def apply_style(app: QApplication, wanted: Theme = LIGHT) -> None:
    """Give an application the launcher's style, palette and group boxes."""
    app.setAttribute(Qt.AA_UseHighDpiPixmaps)
    with _no_widget_collected():
        app.setStyle(QStyleFactory.create('Fusion'))
        app.setStyleSheet(STYLE_SHEET)
    apply_theme(app, wanted)


def apply_theme(app: QApplication, wanted: Theme) -> None:
    """Give an application, and all of its widgets, the colors of a theme."""
    with _no_widget_collected():
        app.setPalette(palette(wanted))
        app.setPalette(_check_box_palette(wanted), 'QCheckBox')
        QToolTip.setPalette(palette(wanted))  # it keeps the colors of the last theme otherwise
        recolor(app)
        for widget in app.allWidgets():
            if isinstance(widget, QRadioButton):  # the sheet keeps the colors of the last theme
                widget.style().unpolish(widget)
                widget.style().polish(widget)


@contextmanager
def _no_widget_collected() -> Iterator[None]:
    """Keep Python's garbage collector from deleting unreachable widgets in this context.

    Qt goes through a list of all widgets and sets the style, palette or sheet of each. Python
    handlers of these changes create objects, which may start the collector. Qt would then continue
    with a deleted widget, and the program would end with SIGSEGV.
    """
    is_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_on:
            gc.enable()


def set_primary(button: QPushButton, is_primary: bool) -> None:
    """Give a button the accent color, or remove it."""
    set_sheet(button, _PRIMARY if is_primary else '')


def palette(wanted: Theme) -> QPalette:
    """Return the colors of a theme."""
    colors = QPalette()
    for role, name in _ROLES.items():
        colors.setColor(role, QColor(getattr(wanted, name)))
    for role in _ON_PRIMARY:
        colors.setColor(role, QColor(Qt.white))
    for role in _DISABLED_ROLES:
        colors.setColor(QPalette.Disabled, role, QColor(wanted.disabled_text))
    colors.setColor(QPalette.Disabled, QPalette.Highlight, QColor(wanted.mid))
    return colors


def _check_box_palette(wanted: Theme) -> QPalette:
    colors = palette(wanted)
    color_indicators(colors, wanted)
    return colors


def color_indicators(colors: QPalette, wanted: Theme) -> None:
    """Make boxes, ticks and dots visible; Fusion's outline is darker than the window.

    The text of a QCheckBox has another color role than its tick.
    """
    colors.setColor(QPalette.Base, QColor(wanted.indicator))
    colors.setColor(QPalette.Text, QColor(wanted.indicator_tick))
    colors.setColor(QPalette.Disabled, QPalette.Base, QColor(wanted.indicator_off))
    colors.setColor(QPalette.Disabled, QPalette.Text, QColor(wanted.indicator_off_tick))


def tabular_font(font: QFont) -> QFont:
    """Return a font of the same size with digits of equal width, so that times do not jitter."""
    tabular = QFont(font)
    tabular.setFamily('monospace')
    tabular.setStyleHint(QFont.Monospace)
    return tabular
