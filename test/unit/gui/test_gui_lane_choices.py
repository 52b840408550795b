# SPDX-License-Identifier: BSD-3-Clause
"""Curves are hidden and put in another order, for each configuration, also after a restart."""
from __future__ import annotations

import json
from typing import List

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtCore import QModelIndex, Qt
from PyQt5.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from timeline_bench import Bench

from process_visualizer.gui.models.playback.lane_choices import LaneChoice, LaneChoices
from process_visualizer.gui.views.playback.curves_dialog import CurvesDialog
from process_visualizer.gui.views.playback.timeline_lanes import Lane

KEYS = tuple(('robot', label, '/topic') for label in 'abcd')
A, B, C, D = KEYS


@given(st.permutations(KEYS), st.sets(st.sampled_from(KEYS)), st.sets(st.sampled_from(KEYS)))
def test_every_curve_is_there_once_and_hidden_ones_are_not_shown(
        order: list, ordered: set, hidden: set) -> None:
    choice = LaneChoice(tuple(key for key in order if key in ordered), frozenset(hidden))
    assert sorted(choice.arranged(KEYS)) == sorted(KEYS)
    assert set(choice.shown(KEYS)) == set(KEYS) - hidden


def test_new_curves_come_last() -> None:
    assert LaneChoice((C, A)).arranged((A, B, C)) == (C, A, B)


def test_each_configuration_has_its_own_choice(qtbot: QtBot) -> None:
    choices = LaneChoices()
    choices.set_configuration('/a.xml')
    choices.hide(A)
    with qtbot.waitSignal(choices.changed):
        choices.set_configuration('/b.xml')
    assert choices.choice.shown(KEYS) == KEYS
    choices.set_configuration('/a.xml')
    assert choices.choice.shown(KEYS) == (B, C, D)


def test_it_is_remembered(qtbot: QtBot) -> None:
    choices = LaneChoices()
    choices.set_configuration('/a.xml')
    choices.choose(LaneChoice((C, A), frozenset({B, C})))
    after = LaneChoices()
    after.restore(json.loads(json.dumps(choices.settings())))
    after.set_configuration('/a.xml')
    assert after.choice.shown(KEYS) == choices.choice.shown(KEYS) == (A, D)
    assert after.choice.hidden == {B, C}


def test_only_the_newest_configurations_are_remembered(qtbot: QtBot) -> None:
    choices = LaneChoices()
    for number in range(60):
        choices.set_configuration(f'/{number}.xml')
        choices.hide(A)
    assert len(choices.settings()) == 50 and '/59.xml' in choices.settings()


class TestDialog:
    """Ticks and order."""

    @pytest.fixture
    def choices(self, qtbot: QtBot) -> LaneChoices:
        return LaneChoices()

    @pytest.fixture
    def dialog(self, qtbot: QtBot, choices: LaneChoices) -> CurvesDialog:
        values = np.zeros(2)
        choices.choose(LaneChoice((), frozenset({C, ('other', 'x', '/y')})))
        made = CurvesDialog([Lane(key[1], 'N', (1.0, 0.0, 0.0), values, values, key)
                             for key in KEYS], choices)
        qtbot.addWidget(made)
        return made

    @staticmethod
    def rows(dialog: CurvesDialog) -> List[str]:
        items = [dialog.list.item(row) for row in range(dialog.list.count())]
        return [('' if item.checkState() == Qt.Checked else '-') + item.text()[0]
                for item in items]

    def test_all_are_listed(self, dialog: CurvesDialog) -> None:
        assert self.rows(dialog) == ['a', 'b', '-c', 'd']

    def test_ticks(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        dialog.list.item(0).setCheckState(Qt.Unchecked)
        dialog.list.item(2).setCheckState(Qt.Checked)
        assert choices.choice.shown(KEYS) == (B, C, D)
        assert ('other', 'x', '/y') in choices.choice.hidden

    def test_order(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        dialog.list.model().moveRow(QModelIndex(), 3, QModelIndex(), 0)
        assert choices.choice.shown(KEYS) == (D, A, B)

    def test_everything_again(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        dialog.list.model().moveRow(QModelIndex(), 3, QModelIndex(), 0)
        dialog.findChild(QPushButton, 'curves_reset').click()
        assert self.rows(dialog) == ['a', 'b', 'c', 'd']
        assert choices.choice.shown(KEYS) == KEYS


def test_the_menu_of_a_lane_hides_it(qtbot: QtBot) -> None:
    bench = Bench(qtbot)
    values = np.zeros(2)
    bench.view.set_lanes([Lane(key[1], 'N', (1.0, 0.0, 0.0), values, values, key)
                          for key in KEYS])
    row = bench.view.stack.row_at(bench.view.stack.lane_rect(1).center().y())
    actions = {it.text(): it for it in bench.view.menu_at(7.5, row).actions()}
    with qtbot.waitSignal(bench.view.hide_wanted) as wanted:
        actions['Hide “b”'].trigger()
    assert wanted.args == [B]
    with qtbot.waitSignal(bench.view.curves_wanted):
        actions['Curves…'].trigger()
    assert bench.view.stack.row_at(10) is None
