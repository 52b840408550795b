# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures of the system tests: a master port, a screen, and runs of the command ``cell``."""
from __future__ import annotations

import os
import uuid
from pathlib import Path
from typing import Dict, Iterator

import pytest
from running import CellRun
from surroundings import SOFTWARE_GRAPHICS, end_marked_processes, free_port, virtual_screen

from process_visualizer.launching.ros_master import RosMaster

MARK = 'SYSTEM_TEST_MARK'


@pytest.fixture(scope='module')
def ros_environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dict[str, str]]:
    """An environment with a master port and folders of its own; ends what a test left running."""
    mark = uuid.uuid4().hex
    environment = {**os.environ, **SOFTWARE_GRAPHICS, MARK: mark,
                   'ROS_MASTER_URI': f'http://localhost:{free_port()}',
                   'ROS_HOME': str(tmp_path_factory.mktemp('ros_home'))}
    yield environment
    end_marked_processes(f'{MARK}={mark}')


@pytest.fixture(scope='module')
def mark(ros_environment: Dict[str, str]) -> str:
    """The environment variables of every process of these tests."""
    return f'{MARK}={ros_environment[MARK]}'


@pytest.fixture(scope='module')
def own_surroundings(ros_environment: Dict[str, str]) -> Iterator[None]:
    """The tests themselves run in the environment of their processes."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ros_environment.items():
            patch.setenv(name, value)
        yield


@pytest.fixture(scope='module')
def master(own_surroundings: None) -> Iterator[RosMaster]:
    """A master that all tests of a module use."""
    own = RosMaster()
    assert own.ensure() is True
    yield own
    own.stop()


@pytest.fixture(scope='module')
def screen(ros_environment: Dict[str, str]) -> Iterator[str]:
    """A virtual screen; yields its display name, which is also set in the environment."""
    with virtual_screen() as display:
        ros_environment['DISPLAY'] = display
        yield display


@pytest.fixture(scope='session')
def simulated_config() -> str:
    """The configuration of the simulated sewing cell."""
    return str(Path(__file__).parents[2] / 'sewing_cell' / 'devices' / 'simulated.xml')


@pytest.fixture
def write_config(tmp_path: Path) -> 'object':
    """Write a configuration with the given devices; return its path."""
    def write(devices: str) -> str:
        path = tmp_path / 'cell.xml'
        path.write_text(f'<visualizer>{devices}</visualizer>')
        return str(path)
    return write


@pytest.fixture
def run_cell(ros_environment: Dict[str, str]) -> Iterator['object']:
    """Start ``cell run`` with the given arguments; end it after the test."""
    runs = []

    def start(*arguments: str) -> CellRun:
        runs.append(CellRun(['run', *arguments], ros_environment))
        return runs[-1]

    yield start
    for run in runs:
        run.end()
        print(run.text)  # pytest shows it beside a failure
