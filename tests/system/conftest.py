"""Fixtures of the system tests: a master port, a screen, and runs of the command ``cell``."""
from __future__ import annotations

import os
import socket
import subprocess
import uuid
from pathlib import Path
from typing import Dict, Iterator

import pytest
from running import CellRun, end_marked_processes

MARK = 'SYSTEM_TEST_MARK'


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(('', 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope='module')
def ros_environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dict[str, str]]:
    """An environment with a master port and folders of its own; ends what a test left running."""
    mark = uuid.uuid4().hex
    environment = {**os.environ, MARK: mark,
                   'ROS_MASTER_URI': f'http://localhost:{_free_port()}',
                   'ROS_HOME': str(tmp_path_factory.mktemp('ros_home')),
                   'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1'}
    yield environment
    end_marked_processes(f'{MARK}={mark}')


@pytest.fixture(scope='module')
def screen(ros_environment: Dict[str, str]) -> Iterator[str]:
    """A virtual screen; yields its display name, which is also set in the environment."""
    reader, writer = os.pipe()
    process = subprocess.Popen(
        ['Xvfb', '-displayfd', str(writer), '-screen', '0', '1600x1000x24', '-nolisten', 'tcp'],
        pass_fds=[writer], stderr=subprocess.DEVNULL)
    os.close(writer)
    with os.fdopen(reader) as numbers:
        display = ':' + numbers.readline().strip()
    ros_environment['DISPLAY'] = display
    yield display
    process.terminate()
    process.wait()


@pytest.fixture(scope='session')
def simulated_config() -> str:
    """The configuration of the simulated sewing cell."""
    return str(Path(__file__).parents[2] / 'sewing_cell' / 'devices' / 'simulated.xml')


@pytest.fixture
def write_config(tmp_path: Path) -> 'object':
    """Writes a configuration with the given devices; returns its path."""
    def write(devices: str) -> str:
        path = tmp_path / 'cell.xml'
        path.write_text(f'<visualizer>{devices}</visualizer>')
        return str(path)
    return write


@pytest.fixture
def run_cell(ros_environment: Dict[str, str]) -> Iterator['object']:
    """Starts ``cell run`` with the given arguments; ends it after the test."""
    runs = []

    def start(*arguments: str) -> CellRun:
        runs.append(CellRun(['run', *arguments], ros_environment))
        return runs[-1]

    yield start
    for run in runs:
        run.end()
