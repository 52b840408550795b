# SPDX-License-Identifier: BSD-3-Clause
"""The dark theme and the light one: switched while everything is visible."""
from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PyQt5.QtGui import QColor, QPalette
from PyQt5.QtWidgets import QLabel, QToolTip, QTreeWidget, QTreeWidgetItem

from process_visualizer.gui.app.launcher_app import ThemeChoice, Wanted
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme import (
    DARK,
    LIGHT,
    STYLE_SHEET,
    DesktopTheme,
    ThemeFollower,
    apply_theme,
    color,
    palette,
    set_sheet,
    theme,
)
from process_visualizer.gui.toolkit.widgets import NoticeFrame, RowDelegate, color_row


@pytest.fixture
def app(qapp):
    apply_theme(qapp, LIGHT)
    yield qapp
    apply_theme(qapp, LIGHT)


def colors_of(widget) -> 'set[str]':
    image = widget.grab().toImage()
    return {image.pixelColor(x, y).name() for x in range(image.width())
            for y in range(image.height())}


def test_the_palette_says_which_theme_there_is(app) -> None:
    assert theme() == LIGHT
    apply_theme(app, DARK)
    assert theme() == DARK


def test_tool_tips_have_the_colors_of_the_theme(app) -> None:
    """Qt keeps those of the first one: light text on white after a change to dark."""
    for wanted in (DARK, LIGHT, DARK):
        apply_theme(app, wanted)
        tip = QToolTip.palette()
        assert [tip.color(it).name() for it in (QPalette.Base, QPalette.Text)] == [
            wanted.paper, wanted.text]
    assert 'QToolTip { background: palette(base); color: palette(text)' in STYLE_SHEET


def test_a_colored_label_changes_with_the_theme_and_back(app, qtbot) -> None:
    label = QLabel('text')
    qtbot.addWidget(label)
    color(label, 'warning')
    for wanted in (DARK, LIGHT, DARK):
        apply_theme(app, wanted)
        assert label.palette().color(QPalette.WindowText) == QColor(wanted.warning)
        assert label.palette().color(QPalette.Window) == QColor(wanted.window)


def test_a_disabled_label_is_grey_in_both_themes(app, qtbot) -> None:
    label = QLabel('text')
    qtbot.addWidget(label)
    color(label, 'bad')
    label.setEnabled(False)
    for wanted in (DARK, LIGHT):
        apply_theme(app, wanted)
        assert label.palette().color(QPalette.WindowText) == QColor(wanted.disabled_text)


def test_style_sheets_icons_and_rows_change(app, qtbot) -> None:
    notice, tree = NoticeFrame('notice', 'bad'), QTreeWidget()
    row = QTreeWidgetItem(tree, ['row'])
    tree.setItemDelegate(RowDelegate(tree))
    color_row(row, 0, 'good')
    for widget in (notice, tree):
        qtbot.addWidget(widget)
        widget.resize(120, 60)
        widget.show()
    for wanted, other in ((DARK, LIGHT), (LIGHT, DARK)):
        apply_theme(app, wanted)
        shown = colors_of(notice)
        assert wanted.behind_bad in shown and other.behind_bad not in shown
        assert other.warning not in shown  # for its icon
        assert wanted.paper in colors_of(tree) and other.paper not in colors_of(tree)
        row.setSelected(True)
        assert wanted.selected in colors_of(tree)
        row.setSelected(False)


def test_icons_are_drawn_in_the_colors_of_the_theme(app) -> None:
    drawn = icon('play')
    for wanted in (LIGHT, DARK):
        apply_theme(app, wanted)
        image = drawn.pixmap(32, 32).toImage()
        assert image.pixelColor(image.width() // 2, image.height() // 2).name() == wanted.shape


def test_a_follower_is_called_once_for_each_change(app, qtbot) -> None:
    label, calls = QLabel(), []
    qtbot.addWidget(label)
    ThemeFollower(label, lambda: calls.append(theme()))
    set_sheet(label, 'color: <bad>')
    color(label, 'bad')
    assert calls == []
    for wanted in (DARK, DARK, LIGHT):
        apply_theme(app, wanted)
    assert calls == [DARK, LIGHT]


@pytest.mark.parametrize('change', ['style', 'theme'])
def test_widgets_that_become_unreachable_meanwhile_outlive_the_change(change: str) -> None:
    """In a separate program, which Qt ends by SIGSEGV if they are deleted earlier."""
    program = Path(__file__).with_name('unreachable_widgets.py')
    result = subprocess.run([sys.executable, str(program), change], timeout=60,
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


class TestChoice:
    @pytest.fixture
    def settings(self, tmp_path: Path) -> Settings:
        return Settings(str(tmp_path / 'settings'))

    def test_it_is_that_of_the_desktop_at_first(self, app, settings) -> None:
        ThemeChoice(app, DesktopTheme(palette(DARK)), settings)
        assert theme() == DARK

    def test_it_is_remembered(self, app, settings) -> None:
        desktop = DesktopTheme(palette(LIGHT))
        ThemeChoice(app, desktop, settings).choose(Wanted.DARK)
        assert theme() == DARK
        apply_theme(app, LIGHT)
        assert ThemeChoice(app, desktop, settings).wanted is Wanted.DARK
        assert theme() == DARK

    def test_the_desktop_is_followed_only_if_that_is_wanted(self, app, settings) -> None:
        desktop = DesktopTheme(palette(LIGHT))
        choice = ThemeChoice(app, desktop, settings)
        desktop._take(1)
        assert theme() == DARK
        choice.choose(Wanted.LIGHT)
        assert theme() == LIGHT
        desktop._take(2)
        desktop._take(1)
        assert theme() == LIGHT

    def test_its_menu_shows_and_changes_it(self, app, settings, qtbot) -> None:
        choice = ThemeChoice(app, DesktopTheme(palette(LIGHT)), settings)
        button = choice.button()
        qtbot.addWidget(button)
        actions = {action.text(): action for action in button.menu().actions()}
        assert actions['Follow desktop'].isChecked()
        actions['Dark'].trigger()
        assert theme() == DARK
        assert [name for name, action in actions.items() if action.isChecked()] == ['Dark']


@pytest.mark.parametrize('begin, later, expected', [
    ('1', '', 'dark'), ('2', '', 'light'), ('0', '', 'light'), ('2', '1', 'dark'),
    ('1', '2', 'light')])
def test_the_portal_of_a_desktop_is_asked_and_followed(begin: str, later: str,
                                                       expected: str) -> None:
    """A portal on its own message bus."""
    program = Path(__file__).with_name('portal_and_program.py')
    result = subprocess.run(
        ['dbus-run-session', '--', sys.executable, str(program), begin, later, expected],
        timeout=60, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


def test_without_a_message_bus_the_palette_counts(qapp, monkeypatch) -> None:
    monkeypatch.setenv('DBUS_SESSION_BUS_ADDRESS', 'unix:path=/nonexistent')
    assert DesktopTheme(palette(DARK)).is_dark
    assert not DesktopTheme(palette(LIGHT)).is_dark
