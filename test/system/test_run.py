# SPDX-License-Identifier: BSD-3-Clause
"""``cell run`` with real nodes: states, exit codes, and nothing left behind."""
from __future__ import annotations

import signal
from pathlib import Path

import pytest
from running import CellRun, run_command
from surroundings import wait_until_alone

ROBOT = '''
<device type="robot" name="arm">
  <model pkg="sewing_cell" path="urdf/ur_rt_upper.urdf.xacro" />
  <base frame="ur_rt_upper/link0" />
</device>'''
FRAMES = '<device type="other" name="box"><base frame="box/base" />{}</device>'


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_everything(run_cell, write_config, mark, number):
    run = run_cell(write_config(ROBOT), '--no-rviz')
    run.wait_for_line('/arm/robot_proc: running')
    run.wait_for_line('/arm/robot_state_publisher: running')
    assert run.signal_and_wait(number) == 0
    wait_until_alone(mark)


def test_nohup_is_respected(ros_environment, write_config):
    """The terminal from which it was started may be closed."""
    run = CellRun(['run', write_config(FRAMES.format('')), '--no-rviz'], ros_environment, ['nohup'])
    try:
        run.wait_for_line('/cell_frames: running')
        status = Path(f'/proc/{run.process.pid}/status').read_text()
        [ignored] = [line.split()[1] for line in status.splitlines() if line.startswith('SigIgn')]
        assert int(ignored, 16) & 1 << signal.SIGHUP - 1
        assert run.signal_and_wait(signal.SIGINT) == 0
    finally:
        run.end()


def test_a_killed_run_leaves_nothing(run_cell, write_config, mark):
    run = run_cell(write_config(ROBOT), '--no-rviz')
    run.wait_for_line('/arm/robot_proc: running')
    run.signal_and_wait(signal.SIGKILL)
    wait_until_alone(mark)


def test_the_next_run_cleans_up_after_a_crash(run_cell, write_config, ros_environment, mark):
    config = write_config(FRAMES.format(''))
    run = run_cell(config, '--no-rviz')
    run.wait_for_line('/cell_frames: running')
    roslaunch = run_command(ros_environment, 'pgrep', '-P', str(run.process.pid), '-f',
                            'roslaunch').stdout.split()
    run_command(ros_environment, 'kill', '-KILL', *roslaunch, str(run.process.pid))
    run.wait()
    second = run_cell(config, '--no-rviz')
    second.wait_for_line('processes that a crashed run had left')
    second.wait_for_line('/cell_frames: running')
    assert second.signal_and_wait(signal.SIGINT) == 0
    wait_until_alone(mark)


def test_a_second_cell_is_refused_beside_the_first(run_cell, write_config):
    """ROS would end the first one's nodes, and its recorder's messages would be lost."""
    config = write_config('<device type="other" name="box"><base frame="box"/></device>')
    first = run_cell(config, '--no-rviz')
    first.wait_for_line('/scene_watch: running')
    second = run_cell(config, '--no-rviz')
    assert second.wait() == 1
    assert 'another cell is already running on the master' in second.text
    assert 'Traceback' not in second.text
    assert first.signal_and_wait(signal.SIGINT) == 0
    assert 'shutting down' not in first.text and 'died' not in first.text


def test_a_failed_required_node_ends_the_run(run_cell, write_config, mark):
    node = '<node pkg="process_visualizer" type="view_picture" name="bad" required="true" />'
    run = run_cell(write_config(FRAMES.format(node)), '--no-rviz')
    assert run.wait() == 1
    assert '/box/bad: ended with code' in run.text
    assert 'the required node /box/bad' in run.text
    wait_until_alone(mark)


def test_the_default_configuration_runs_without_the_driver(run_cell, mark):
    config = str(Path(__file__).parents[2] / 'devices.xml')
    run = run_cell(config, '--no-rviz')
    for name in ('/ur_rt_upper/robot_proc', '/ur_rt_lower/robot_state_publisher',
                 '/kinect/depth_proc', '/sewing_machine/sewing_machine',
                 '/sewing_machine/needle_frame_transformer', '/cell_frames'):
        run.wait_for_line(f'{name}: running')
    assert 'device "kinect": openni_live.launch: the node /camera/driver needs the package ' \
           '"openni_camera", which is not installed' in run.text
    assert run.signal_and_wait(signal.SIGINT) == 0
    wait_until_alone(mark)
