"""A recording of the simulated cell, played back through ``cell run --mode playback --bag``."""
from __future__ import annotations

import signal
import subprocess
from pathlib import Path
from typing import Dict

import pytest
from running import CellRun, run_command

TOPICS = ['/ur_rt_upper/q_act', '/ur_rt_upper/tcf', '/ft_upper/ft', '/feed_rate_est']


@pytest.fixture(scope='module')
def bag(ros_environment: Dict[str, str], simulated_config: str,
        tmp_path_factory: pytest.TempPathFactory) -> str:
    """Six seconds of the drivers' topics, recorded with rosbag; a file name with a space."""
    path = tmp_path_factory.mktemp('bags') / 'a seam.bag'
    run = CellRun(['run', simulated_config, 'image_rate:=0', '--no-rviz',
                   '--devices', 'simulator'], ros_environment)
    run.wait_for_line('/simulator: running')
    recorded = run_command(ros_environment, 'rosbag', 'record', '--duration', '6', '-O', str(path),
                           *TOPICS)
    assert recorded.returncode == 0 and path.exists(), recorded.stdout
    assert run.signal_and_wait(signal.SIGINT) == 0
    return str(path)


def test_the_cell_moves_as_recorded(bag, ros_environment, simulated_config, run_cell):
    run = run_cell(simulated_config, '--no-rviz', '--mode', 'playback', '--bag', bag,
                   '--devices', 'ur_rt_upper,sewing_machine')
    run.wait_for_line('/ur_rt_upper/robot_proc: running')
    moved = run_command(ros_environment, 'timeout', '20', 'rostopic', 'echo', '-n', '1',
                        '/ur_rt_upper/joint_states/position')
    assert moved.returncode == 0 and len(moved.stdout.split(',')) == 6, moved.stdout
    nodes = run_command(ros_environment, 'rosnode', 'list').stdout.split()
    assert '/simulator' not in nodes
    early, late = joints_at(ros_environment, 0.5), joints_at(ros_environment, 4.5)
    assert early.count(',') == late.count(',') == 5 and early != late
    assert joints_at(ros_environment, 0.5) == early
    assert run.signal_and_wait(signal.SIGINT) == 0


def joints_at(environment: Dict[str, str], position_s: float) -> str:
    """The joints that the cell shows after a seek while paused."""
    run_command(environment, 'rosservice', 'call', '/bag_player/pause')
    with subprocess.Popen(['timeout', '40', 'rostopic', 'echo', '-n', '1',
                           '/ur_rt_upper/joint_states/position'], env=environment,
                          stdout=subprocess.PIPE, text=True) as echo:
        while echo.poll() is None:  # until it has subscribed, the answer is not for it
            answer = run_command(environment, 'rosservice', 'call', '/bag_player/seek',
                                 str(position_s))
            assert 'success: True' in answer.stdout, answer.stdout
        assert echo.stdout is not None
        return echo.stdout.read()


@pytest.mark.parametrize(('options', 'message'), [
    (['--mode', 'playback', '--bag', 'missing.bag'], 'there is no file "missing.bag"'),
    (['--bag', 'missing.bag'], '--bag needs --mode playback'),
])
def test_a_wrong_choice_starts_nothing(simulated_config, run_cell, options, message):
    run = run_cell(simulated_config, '--no-rviz', *options)
    assert run.wait() == 1
    assert message in run.text
    assert 'starting' not in run.text


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
