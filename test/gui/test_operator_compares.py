# SPDX-License-Identifier: BSD-3-Clause
"""An operator finds the poor run of a recording, and seeks to the beginning of its fault."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator

import pytest
from cycle_bags import write_bag
from operator_at_work import Operator
from PyQt5.QtWidgets import QTreeWidget

POOR_S = 27.0
"""In the third of four cycles."""


@pytest.fixture
def bag(tmp_path: Path) -> str:
    """Write the bag before the window exists: the thread that writes is the window's."""
    return write_bag(tmp_path, cycles=4, poor=2)


@pytest.fixture
def operator(bag: str, qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_from_a_poor_run_to_its_cause(operator: Operator, bag: str, tmp_path: Path) -> None:
    play(operator, bag, tmp_path / 'cell.xml')
    operator.window.panels.setCurrentIndex(2)
    operator.click('find_runs')
    runs = operator.widget('runs', QTreeWidget)
    operator.wait(lambda: runs.topLevelItemCount() == 4, 'the runs are listed')
    for row in (0, 1):
        operator.click_check_box(runs, runs.topLevelItem(row))
    operator.click('compare_runs')
    operator.wait(lambda: operator.text('compare_state').startswith('1 of 4 runs'), 'a verdict',
                  instead=lambda: operator.text('compare_state'))
    assert runs.topLevelItem(2).text(2).startswith('arm tool force from 0:2')
    departures = operator.widget('departures', QTreeWidget)
    operator.click_row(departures, departures.topLevelItem(0))
    playback = operator.launcher.playback
    operator.wait(lambda: abs(playback.position_s - POOR_S) < 0.2, 'the playback goes there',
                  instead=lambda: playback.position_s)


def play(operator: Operator, bag: str, config: Path) -> None:
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('playback')
    operator.launcher.bag.open([bag])
    operator.wait(lambda: operator.launcher.session.recording is not None, 'the recording is open')
    operator.click('launch')
    operator.wait(lambda: operator.launcher.playback.state.is_available, 'the player is there')
