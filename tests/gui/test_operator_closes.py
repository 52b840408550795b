"""An operator closes the window while a recording is being made."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator

import pytest
from operator_at_work import Operator, processes
from PyQt5.QtWidgets import QMessageBox
from running_program import SMALL_CELL

from process_visualizer.bags.catalogue import read_catalogue
from process_visualizer.gui.models.recording_types import Phase

LAUNCH_S = 60.0


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_finish_and_close(operator: Operator, tmp_path: Path) -> None:
    start_recording(operator, tmp_path)
    operator.window.close()
    assert operator.window.isVisible()
    assert 'Finish it, quit all nodes and close?' in operator.widget('question', QMessageBox).text()
    assert operator.text('yes') == 'Finish and close'
    operator.click('yes')
    operator.wait(lambda: not operator.window.isVisible(), 'the window closes', LAUNCH_S)
    operator.close()
    [bag] = tmp_path.glob('*.bag')
    assert read_catalogue([str(bag)]).duration_s > 0.5
    assert not list(tmp_path.glob('*.active'))
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


def start_recording(operator: Operator, folder: Path) -> None:
    config = folder / 'cell.xml'
    config.write_text(SMALL_CELL)
    recording = operator.launcher.recording
    recording.choices.set_folder(str(folder))
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record', LAUNCH_S)
    operator.click('record')
    operator.wait(lambda: recording.phase is Phase.RECORDING and recording.elapsed_s > 1.0,
                  'it records')
