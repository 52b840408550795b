# SPDX-License-Identifier: BSD-3-Clause
"""The real window on a virtual screen, with a master, folders and settings of its own.

These tests have a process of their own: a process can be a ROS node only once.
"""
from __future__ import annotations

import os
import sys
import uuid
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from patient_qtbot import PatientQtBot
from PyQt5.QtWidgets import QApplication
from surroundings import SOFTWARE_GRAPHICS, end_marked_processes, free_port, virtual_screen

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'bench'))  # its modules write bags
MARK = 'GUI_TEST_MARK'
_STARTED = ExitStack()


@pytest.fixture(scope='session')
def qapp() -> QApplication:
    """Create the application as the program does, with its look."""
    from process_visualizer.gui.app.main import make_application  # after pytest_configure
    return make_application()


@pytest.fixture
def qtbot(qapp: QApplication, request: pytest.FixtureRequest) -> PatientQtBot:
    """Extend pytest-qt's fixture with limits for a busy machine."""
    return PatientQtBot(request)


def pytest_configure(config: pytest.Config) -> None:
    """Start the screen before the application is made."""
    folder = _STARTED.enter_context(TemporaryDirectory(prefix='process_visualizer_gui_'))
    os.environ.update({
        **SOFTWARE_GRAPHICS, 'DISPLAY': _STARTED.enter_context(virtual_screen()),
        'QT_QPA_PLATFORM': 'xcb', 'ROS_MASTER_URI': f'http://localhost:{free_port()}',
        'ROS_HOME': os.path.join(folder, 'ros_home'), 'XDG_CONFIG_HOME': folder,
        'HOME_FOLDER': folder, MARK: uuid.uuid4().hex})


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the screen, and everything that a failed test has left."""
    _STARTED.close()
    end_marked_processes(f'{MARK}={os.environ[MARK]}')
