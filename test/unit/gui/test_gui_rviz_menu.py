# SPDX-License-Identifier: BSD-3-Clause
"""The menu of RViz, while it runs and after it died."""
from __future__ import annotations

from typing import List, Optional

import pytest
from PyQt5.QtWidgets import QAction
from pytestqt.qtbot import QtBot

from process_visualizer.gui.cell.launch_view import RvizMenu


@pytest.fixture
def menu(qtbot: QtBot) -> RvizMenu:
    rviz = RvizMenu()
    qtbot.addWidget(rviz)
    return rviz


def action(menu: RvizMenu, text: str) -> QAction:
    return next(it for it in menu.actions() if it.text() == text)


def test_a_dead_rviz_can_be_restarted_and_has_no_view_to_be_saved(menu: RvizMenu,
                                                                  qtbot: QtBot) -> None:
    menu.show_rviz(False)
    save = action(menu, 'Save this view as…')
    assert not save.isEnabled()
    assert menu.toolTipsVisible() and save.toolTip() == 'RViz is not running: restart it first'
    with qtbot.waitSignal(menu.restart_wanted):
        action(menu, 'Restart RViz').trigger()
    menu.show_rviz(True)
    assert save.isEnabled()
    with qtbot.waitSignal(menu.save_wanted):
        save.trigger()


def test_the_views_are_offered_once_each(menu: RvizMenu) -> None:
    chosen: List[Optional[str]] = []
    menu.chosen.connect(chosen.append)
    menu.show_views(('old',), None)
    menu.show_views(('side', 'top'), 'top')
    views = [it for it in menu.actions() if it.isCheckable()]
    assert [(it.text(), it.isChecked()) for it in views] == [
        ('default', False), ('side', False), ('top', True)]
    views[0].trigger()
    views[1].trigger()
    assert chosen == [None, 'side']
