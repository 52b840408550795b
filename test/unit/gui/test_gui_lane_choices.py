# SPDX-License-Identifier: BSD-3-Clause
"""Curves are hidden, arranged, overlaid and folded, per configuration, and kept after a restart."""
from __future__ import annotations

import json
from typing import Any, Callable, List

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from timeline_bench import Bench

from process_visualizer.gui.lanes.curves_dialog import CurvesDialog, CurvesTree, is_folded
from process_visualizer.gui.lanes.lane_choice import LaneChoice, LaneChoices, restored_choice
from process_visualizer.gui.lanes.timeline_lanes import Lane, grouped_lanes

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


@st.composite
def changes(draw: Callable[..., Any]) -> LaneChoice:
    """A choice after some changes, with keys that may be missing in a recording."""
    choice, key = LaneChoice(), st.sampled_from(KEYS)
    for _ in range(draw(st.integers(0, 8))):
        choice = draw(st.sampled_from([
            lambda it: it.with_hidden(draw(key)), lambda it: it.with_joined(draw(key), draw(key)),
            lambda it: it.with_own_lane(draw(key)),
            lambda it: it.with_folded([draw(key)], draw(st.booleans())),
            lambda it: it.rearranged([draw(st.permutations(KEYS[:3]))], {draw(key)}, set()),
        ]))(choice)
    return choice


class TestLanes:
    """Lanes for any earlier choice and any set of curves."""

    @given(changes(), st.sets(st.sampled_from(KEYS)))
    def test_each_curve_is_in_one_lane(self, choice: LaneChoice, there: set) -> None:
        found = choice.lanes(tuple(there))
        assert sorted(key for lane in found for key in lane) == sorted(there)

    @given(changes(), st.sampled_from(KEYS), st.sampled_from(KEYS))
    def test_lanes_are_joined(self, choice: LaneChoice, key: Any, other: Any) -> None:
        before = {it: lane for lane in choice.lanes(KEYS) for it in lane}
        after = {it: lane for lane in choice.with_joined(key, other).lanes(KEYS) for it in lane}
        assert set(after[key]) == set(before[key]) | set(before[other])

    @given(changes(), st.sampled_from(KEYS))
    def test_a_curve_leaves_and_the_others_stay_together(self, choice: LaneChoice,
                                                         key: Any) -> None:
        before = next(lane for lane in choice.lanes(KEYS) if key in lane)
        after = choice.with_own_lane(key).lanes(KEYS)
        assert (key,) in after
        assert len(before) == 1 or tuple(it for it in before if it != key) in after

    @given(changes())
    def test_they_are_restored(self, choice: LaneChoice) -> None:
        assert restored_choice(json.loads(json.dumps(choice.settings()))) == choice

    def test_a_lane_is_where_its_first_curve_is(self) -> None:
        choice = LaneChoice((C, A, B, D)).with_joined(D, C).with_hidden(C)
        assert choice.lanes(choice.shown(KEYS)) == ((A,), (B,), (D,))

    def test_a_curve_of_another_recording_keeps_its_lane(self) -> None:
        choice = LaneChoice().with_joined(D, A)
        assert choice.rearranged([[B, A], [C]], set(), set()).lanes(KEYS) == ((B, A, D), (C,))

    def test_what_an_earlier_version_has_stored(self) -> None:
        assert restored_choice([[list(C), True], [list(A), False]]) == LaneChoice(
            (C, A), frozenset({A}))


def test_each_configuration_has_its_own_choice(qtbot: QtBot) -> None:
    choices = LaneChoices()
    choices.set_configuration('/a.xml')
    choices.choose(choices.choice.with_hidden(A))
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
        choices.choose(choices.choice.with_hidden(A))
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
        """The lanes; a minus marks a curve that is not ticked, an f one that is folded."""
        return [' '.join(('' if it.checkState(0) == Qt.Checked else '-') + it.text(0)[0]
                         + ('f' if is_folded(it) else '') for it in lane)
                for lane in dialog.tree.lanes()]

    @staticmethod
    def press(dialog: CurvesDialog, row: int, *names: str) -> None:
        """Select the row of a lane and press buttons."""
        dialog.tree.setCurrentItem(dialog.tree.topLevelItem(row))
        for name in names:
            dialog.findChild(QPushButton, f'curves_{name}').click()

    def test_all_are_listed(self, dialog: CurvesDialog) -> None:
        assert self.rows(dialog) == ['a', 'b', '-c', 'd']

    def test_ticks(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        dialog.tree.topLevelItem(0).setCheckState(0, Qt.Unchecked)
        dialog.tree.topLevelItem(2).setCheckState(0, Qt.Checked)
        assert choices.choice.shown(KEYS) == (B, C, D)
        assert ('other', 'x', '/y') in choices.choice.hidden

    def test_order(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        self.press(dialog, 3, 'up', 'up', 'up', 'up', 'down')
        assert self.rows(dialog) == ['a', 'd', 'b', '-c']
        assert choices.choice.shown(KEYS) == (A, D, B)

    def test_overlaid_and_folded(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        self.press(dialog, 3, 'join', 'fold')
        assert self.rows(dialog) == ['a', 'b', '-cf d']
        self.press(dialog, 2, 'join')
        assert self.rows(dialog) == ['a', 'b -c d']
        assert choices.choice.lanes(choices.choice.shown(KEYS)) == ((A,), (B, D))
        dialog.tree.setCurrentItem(dialog.tree.topLevelItem(1).child(0))
        assert dialog.join.text() == 'Own lane'
        dialog.join.click()
        assert self.rows(dialog) == ['a', 'b d', '-c']

    def test_one_is_dropped_on_another(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        self.press(dialog, 1, 'join')
        tree = dialog.tree
        tree.setCurrentItem(tree.topLevelItem(0))
        tree.drop(tree.topLevelItem(2), CurvesTree.OnItem)
        assert self.rows(dialog) == ['-c', 'd a b']
        assert choices.choice.lanes(KEYS)[1] == (D, A, B)

    @pytest.mark.parametrize('dragged, target, where, rows', [
        (0, 2, CurvesTree.BelowItem, ['b', '-c', 'a', 'd']),
        (3, 0, CurvesTree.AboveItem, ['d', 'a', 'b', '-c']),
        (3, 1, CurvesTree.AboveItem, ['a', 'd', 'b', '-c']),
        (1, None, CurvesTree.OnViewport, ['a', '-c', 'd', 'b']),
        (1, 1, CurvesTree.OnItem, ['a', 'b', '-c', 'd'])])
    def test_rows_are_dropped(self, dialog: CurvesDialog, dragged: int, target: Any, where: Any,
                              rows: List[str]) -> None:
        tree = dialog.tree
        tree.setCurrentItem(tree.topLevelItem(dragged))
        tree.drop(None if target is None else tree.topLevelItem(target), where)
        assert self.rows(dialog) == rows

    def test_the_first_one_of_a_lane_takes_the_others_along(self, dialog: CurvesDialog) -> None:
        tree = dialog.tree
        self.press(dialog, 1, 'join')
        tree.setCurrentItem(tree.topLevelItem(0))
        tree.drop(tree.topLevelItem(0).child(0), CurvesTree.BelowItem)
        assert self.rows(dialog) == ['a b', '-c', 'd']  # not into itself
        tree.drop(tree.topLevelItem(2), CurvesTree.BelowItem)
        assert self.rows(dialog) == ['-c', 'd', 'a b']

    def test_everything_again(self, dialog: CurvesDialog, choices: LaneChoices) -> None:
        self.press(dialog, 3, 'up', 'join', 'reset')
        assert self.rows(dialog) == ['a', 'b', 'c', 'd']
        assert choices.choice.shown(KEYS) == KEYS


def test_the_menu_of_a_lane_hides_overlays_and_folds_it(qtbot: QtBot) -> None:
    bench, values = Bench(qtbot), np.zeros(2)
    curves = {key: Lane(key[1], 'N', (1.0, 0.0, 0.0), values, values, key) for key in KEYS}
    view, choices = bench.view, bench.choices

    def press(row: int, text: str) -> None:
        view.set_lanes(grouped_lanes(curves, choices.choice))
        middle = view.stack.lane_rect(row).center().y()
        actions = {it.text(): it for it in view.menu_at(7.5, view.stack.row_at(middle)).actions()}
        actions[text].trigger()

    press(1, 'Overlay on “a”')
    press(1, 'Hide “c”')
    press(0, 'Fold the lane')
    assert choices.choice.lanes(choices.choice.shown(KEYS)) == ((A, B), (D,))
    press(1, 'Overlay on “a”')
    press(0, 'A lane of its own for “b”')
    assert choices.choice.lanes(choices.choice.shown(KEYS)) == ((A, D), (B,))
    with qtbot.waitSignal(view.curves_wanted):
        press(0, 'Curves…')
    assert view.stack.row_at(10) is None
