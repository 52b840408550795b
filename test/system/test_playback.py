# SPDX-License-Identifier: BSD-3-Clause
"""The simulated cell is run and recorded by its recorder, then the recording is played back."""
from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path
from typing import Dict

import pytest
from running import CELL, CellRun, run_command

TOPICS = ['/ur_rt_upper/q_act', '/ur_rt_upper/tcf', '/ft_upper/ft', '/feed_rate_est']
MARK = 'the seam tears'


@pytest.fixture(scope='module')
def bag(ros_environment: Dict[str, str], simulated_config: str,
        tmp_path_factory: pytest.TempPathFactory) -> str:
    """Some seconds of the drivers' topics with a mark at their end; a file name with a space."""
    path = tmp_path_factory.mktemp('bags') / 'a seam.bag'
    run = CellRun(['run', simulated_config, 'image_rate:=0', '--no-rviz',
                   '--devices', 'ur_rt_upper,sewing_machine,simulator'], ros_environment)
    run.wait_for_line('/simulator: running')
    run.wait_for_line('/bag_recorder: running')
    request = f'{{folder: "{path.parent}", name: "{path.stem}"}}'
    assert 'success: True' in call(ros_environment, '/bag_recorder/start', request)
    for topic in TOPICS:
        run_command(ros_environment, 'rostopic', 'echo', '-n', '300', topic)
    assert 'success: True' in call(ros_environment, '/bag_recorder/mark', MARK)
    assert str(path) in call(ros_environment, '/bag_recorder/stop')
    assert run.signal_and_wait(signal.SIGINT) == 0
    return str(path)


def call(environment: Dict[str, str], service: str, *request: str) -> str:
    """Return the answer of a service, as text."""
    return run_command(environment, 'rosservice', 'call', '--wait', service, *request).stdout


def test_the_recording_has_all_that_came_and_holds_its_cell(bag, ros_environment, simulated_config,
                                                            tmp_path: Path):
    report = json.loads(run_command(ros_environment, CELL, 'report', '--json', bag).stdout)
    topics = {it['topic']: it for it in report['topics']}  # gaps: of a simulator without a core
    assert all(topics[topic]['messages'] > 200 for topic in TOPICS), topics
    assert all(it['dropped'] == 0 for it in topics.values()), topics
    assert [it['label'] for it in report['marks']] == [MARK]
    stored = run_command(ros_environment, CELL, 'configuration', bag, '--output', str(tmp_path))
    assert stored.stdout.splitlines()[0] == f'{tmp_path / "simulated.xml"} image_rate:=0'
    assert (tmp_path / 'simulated.xml').read_bytes() == Path(simulated_config).read_bytes()


def test_the_cell_moves_as_recorded(bag, ros_environment, simulated_config, run_cell):
    run = run_cell(simulated_config, '--no-rviz', '--mode', 'playback', '--bag', bag,
                   '--devices', 'ur_rt_upper,sewing_machine')
    run.wait_for_line('/ur_rt_upper/robot_proc: running')
    moved = run_command(ros_environment, 'timeout', '20', 'rostopic', 'echo', '-n', '1',
                        '/ur_rt_upper/joint_states/position')
    assert moved.returncode == 0 and len(moved.stdout.split(',')) == 6, moved.stdout
    nodes = run_command(ros_environment, 'rosnode', 'list').stdout.split()
    assert '/simulator' not in nodes
    shown = [joints_at(ros_environment, position_s) for position_s in (0.5, 2.5, 4.5)]
    assert all(joints.count(',') == 5 for joints in shown)
    assert len(set(shown)) > 1, shown  # the robot may rest in the same pose at two of them
    assert joints_at(ros_environment, 0.5) == shown[0]
    assert run.signal_and_wait(signal.SIGINT) == 0


def joints_at(environment: Dict[str, str], position_s: float) -> str:
    """Return the joints that the cell shows after a seek while paused."""
    call(environment, '/bag_player/pause')
    with subprocess.Popen(['timeout', '40', 'rostopic', 'echo', '-n', '1',
                           '/ur_rt_upper/joint_states/position'], env=environment,
                          stdout=subprocess.PIPE, text=True) as echo:
        while echo.poll() is None:  # until it has subscribed, it does not receive the answer
            assert 'success: True' in call(environment, '/bag_player/seek', str(position_s))
        assert echo.stdout is not None
        return echo.stdout.read()


def test_the_temporary_folder_is_gone_after_a_good_run(ros_environment, write_config, run_cell,
                                                       tmp_path: Path):
    ros_environment['TMPDIR'] = str(tmp_path)
    try:
        run = run_cell(write_config('<device type="other" name="a"><base frame="b" /></device>'),
                       '--no-rviz')
        run.wait_for_line('/cell_frames: running')
        assert list(tmp_path.glob('process_visualizer-*')) != []
        assert run.signal_and_wait(signal.SIGINT) == 0
    finally:
        del ros_environment['TMPDIR']
    assert list(tmp_path.glob('process_visualizer-*')) == []
