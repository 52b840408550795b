# SPDX-License-Identifier: BSD-3-Clause
"""An operator uses the keys while RViz has the keyboard, and closes RViz by its own button."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator, List

import pytest
from operator_at_work import Operator, launch_small_cell
from screen_mouse import press_key_in

from process_visualizer.gui.recording.recording_types import RecordingPhase

RVIZ = r'\.rviz\*? - RViz'


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_keys_work_in_rviz_and_rviz_can_be_closed(operator: Operator, tmp_path: Path) -> None:
    launch_small_cell(operator, tmp_path)
    recording = operator.launcher.recording
    press_key_in(RVIZ, 'r')
    operator.wait(lambda: recording.phase is RecordingPhase.RECORDING and recording.elapsed_s > 0.5,
                  'R begins to record')
    press_key_in(RVIZ, 'm')
    operator.wait(lambda: [it.label for it in recording.state.marks] == ['mark 1'], 'M marks')
    operator.let_it_be_meant('record')
    press_key_in(RVIZ, 'r')
    operator.wait(lambda: recording.phase is RecordingPhase.IDLE, 'R ends the recording')
    close_rviz(operator)


def close_rviz(operator: Operator) -> None:
    """Close it as its menu and its button do; the cell keeps running."""
    place = operator.keeper.rviz_place
    press_key_in(RVIZ, 'ctrl+q')
    operator.wait(place.isVisible, 'its place says so',
                  instead=lambda: operator.launcher.launch.reports)
    assert operator.text('rviz_place_text') == 'RViz was closed.'
    assert any(it.condition.said == 'RViz was closed' for it in operator.launcher.alarms.alarms)
    displays: List[Any] = []
    operator.launcher.link.displays.connect(displays.append)
    operator.click('rviz_place_restart')
    operator.wait(lambda: not place.isVisible() and bool(displays), 'RViz is back')
    assert operator.launcher.alarms.alarms == ()
