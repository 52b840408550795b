# SPDX-License-Identifier: BSD-3-Clause
"""Widgets are tested without a screen, which must be set before Qt is loaded."""
import os
from pathlib import Path

import pytest

os.environ['QT_QPA_PLATFORM'] = 'offscreen'

from patient_qtbot import PatientQtBot  # noqa: E402
from PyQt5.QtWidgets import QApplication  # noqa: E402
from recording_stand_in import StandInRecorder  # noqa: E402


@pytest.fixture
def qtbot(qapp: QApplication, request: pytest.FixtureRequest) -> PatientQtBot:
    """pytest-qt's qtbot, with timeouts for a busy machine."""
    return PatientQtBot(request)


@pytest.fixture
def client(tmp_path: Path) -> StandInRecorder:
    """A recorder that writes seam.bag."""
    recorder = StandInRecorder()
    recorder.path = str(tmp_path / 'seam.bag')
    return recorder
