# SPDX-License-Identifier: BSD-3-Clause
"""The output of roslaunch about its processes.

The lines come from roslaunch's own code where it can be called without a master.
"""
from __future__ import annotations

from typing import Optional

import pytest
from hypothesis import given
from hypothesis import strategies as st
from roslaunch.core import printlog_bold
from roslaunch.nodeprocess import LocalProcess

from process_visualizer.launching.run import LaunchEvent, exit_code_in, parse_line, plain

STARTED = 'process[{}]: started with pid [4711]'
DIED = '[{}] process has died [pid 4711, exit code {}, cmd /opt/a b __name:=n __log:=/x/n-1.log].'
FINISHED = '[{}] process has finished cleanly'
REQUIRED = '=' * 80 + 'REQUIRED process [{}] has died!'
CANNOT = ('ERROR: cannot launch node of type [pkg/kind]: Cannot locate node of type [kind] in '
          'package [pkg]. Make sure file exists in package path and permission is set to '
          'executable (chmod +x)')


@pytest.mark.parametrize('line, event', [
    (STARTED.format('rviz-1'), LaunchEvent('started', '/rviz')),
    (STARTED.format('arm/robot_proc-12'), LaunchEvent('started', '/arm/robot_proc')),
    (STARTED.format('a-2-3'), LaunchEvent('started', '/a-2')),
    (STARTED.format('a-3') + 'first words', LaunchEvent('started', '/a', rest='first words')),
    (DIED.format('arm/driver-3', 1), LaunchEvent('exited', '/arm/driver', 1)),
    (DIED.format('arm/driver-3', -11), LaunchEvent('exited', '/arm/driver', -11)),
    (DIED.format('d-3', 127), LaunchEvent('exited', '/d', 127)),
    (FINISHED.format('simulator-7'), LaunchEvent('exited', '/simulator', 0)),
    (REQUIRED.format('rviz-1'), LaunchEvent('required_died', '/rviz')),
    (CANNOT, LaunchEvent('cannot_launch', 'pkg/kind',
                         reason=CANNOT.split('[pkg/kind]: ')[1])),
    # from a roslaunch on another computer, which puts its name in front
    ('[pc-0]: ' + STARTED.format('far-1'), LaunchEvent('started', '/far')),
    ('[pc-0]: ' + DIED.format('far-1', 2), LaunchEvent('exited', '/far', 2)),
    ('[pc-0]: ' + FINISHED.format('far-1'), LaunchEvent('exited', '/far', 0)),
])
def test_events(line: str, event: LaunchEvent) -> None:
    assert parse_line(line) == event


@pytest.mark.parametrize('line', [
    '', 'started roslaunch server http://localhost:4711/', 'ROS_MASTER_URI=http://localhost:11311',
    'auto-starting new master', 'setting /run_id to 0815', 'started core service [/rosout]',
    '[rviz-1] killing on exit', '[rviz-1] restarting process', '[rviz-1] kill requested',
    'all processes on machine have died, roslaunch will exit', 'Initiating shutdown!', '=' * 80,
    'process has finished cleanly', 'log file: /root/.ros/log/0815/rviz-1*.log',
    'process has died [pid 4711, exit code 1, cmd /opt/a].',
    '[INFO] [1700000000.0]: the process has died', '[ERROR]: process [x] is gone',
    'local launch of a/b failed', 'No processes to monitor'])
def test_other_lines(line: str) -> None:
    assert parse_line(line) is None


@pytest.mark.parametrize('line, code', [
    ('process has died [pid 4711, exit code 3, cmd /opt/a b].', 3),
    ('process has died [pid 4711, exit code -9, cmd /opt/a b].', -9),
    ('process has finished cleanly', None), ('Initiating shutdown!', None)])
def test_exit_code_of_a_required_process(line: str, code: Optional[int]) -> None:
    assert exit_code_in(line) == code


@pytest.mark.parametrize('line, text', [
    ('\033[1mprocess[a-1]: started with pid [1]\033[0m\n', 'process[a-1]: started with pid [1]'),
    ('\033[31m[a-1] process has died\033[0m\r\n', '[a-1] process has died'),
    ('\033]2;/x/cell.launch http://localhost:11311\007... logging', '... logging'),
    ('  indented  ', '  indented'), ('', '')])
def test_plain_text(line: str, text: str) -> None:
    assert plain(line) == text


def test_lines_are_those_of_this_roslaunch(capsys: pytest.CaptureFixture[str]) -> None:
    """Start and end of a process as printed by roslaunch's own functions."""
    process = LocalProcess('run', 'pkg', 'arm/driver-3', ['/opt/driver', 'x'], {}, True, None)
    process.pid = 4711
    printlog_bold(f'process[{process.name}]: started with pid [{process.pid}]')
    for code in (-15, 1, 0):
        process.exit_code = code
        print(f'[{process.name}] {process.get_exit_description()}')
    events = [parse_line(plain(line)) for line in capsys.readouterr().out.splitlines()]
    assert events == [LaunchEvent('started', '/arm/driver'),
                      LaunchEvent('exited', '/arm/driver', -15),
                      LaunchEvent('exited', '/arm/driver', 1),
                      LaunchEvent('exited', '/arm/driver', 0)]


@given(st.text(max_size=60))
def test_any_line_is_understood_or_not(line: str) -> None:
    parse_line(plain(line))
    exit_code_in(line)


@given(st.from_regex(r'[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*', fullmatch=True),
       st.integers(1, 999), st.integers(-64, 255).filter(bool))
def test_any_node_name(name: str, number: int, code: int) -> None:
    process = f'{name}-{number}'
    assert parse_line(STARTED.format(process)) == LaunchEvent('started', f'/{name}')
    assert parse_line(DIED.format(process, code)) == LaunchEvent('exited', f'/{name}', code)
    assert parse_line(REQUIRED.format(process)) == LaunchEvent('required_died', f'/{name}')
