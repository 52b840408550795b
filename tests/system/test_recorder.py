"""`cell record`, and what happens to a recording when the master or the launcher is killed."""
from __future__ import annotations

import os
import signal
import socket
import subprocess
from pathlib import Path
from typing import Dict, Iterator

import pytest
import rosbag
from running import CellRun, run_command, wait_until_alone

TOPIC = '/robot/q_act'
DEVICE = """<device type="other" name="robot"><base frame="b" /><topic ns="robot" name="q_act" />
<topic ns="robot" name="silent" /><topic ns="robot" name="points" record="False" /></device>"""


@pytest.fixture
def free_port() -> int:
    """A port for a master that no other test uses."""
    with socket.socket() as probe:
        probe.bind(('', 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def own_environment(ros_environment: Dict[str, str], free_port: int) -> Dict[str, str]:
    """An environment with a master's port that no other test uses."""
    return {**ros_environment, 'ROS_MASTER_URI': f'http://localhost:{free_port}'}


@pytest.fixture
def master(own_environment: Dict[str, str]) -> Iterator['subprocess.Popen[bytes]']:
    """A running master."""
    process = subprocess.Popen(['rosmaster', '--core', '-p',
                                own_environment['ROS_MASTER_URI'].split(':')[-1]],
                               env=own_environment, stdout=subprocess.DEVNULL)
    _wait_for(own_environment, 'rosparam', 'list')
    yield process
    process.kill()
    process.wait()


@pytest.fixture
def driver(own_environment: Dict[str, str], master: object) -> Iterator['subprocess.Popen[bytes]']:
    """Publishes at 50 Hz."""
    process = subprocess.Popen(
        ['rostopic', 'pub', '-r', '50', TOPIC, 'std_msgs/Float32MultiArray', 'data: [1.0]'],
        env=own_environment, stdout=subprocess.DEVNULL)
    _wait_for(own_environment, 'rostopic', 'echo', '-n', '1', TOPIC)
    yield process
    process.kill()
    process.wait()


def _wait_for(environment: Dict[str, str], *command: str) -> None:
    """Run a command until it succeeds."""
    for _ in range(100):
        if run_command(environment, 'timeout', '10', *command).returncode == 0:
            return
    raise AssertionError(f'{command} never succeeded')


@pytest.fixture
def record(own_environment: Dict[str, str], driver: object, write_config: 'object',
           tmp_path: Path) -> Iterator['object']:
    """Starts `cell record` into tmp_path/bags."""
    runs = []

    def start(*options: str) -> CellRun:
        runs.append(CellRun(['record', write_config(DEVICE), '--folder', str(tmp_path / 'bags'),
                             *options], own_environment))
        return runs[-1]

    yield start
    for run in runs:
        run.end()


def _count(path: Path) -> int:
    with rosbag.Bag(str(path)) as bag:
        return int(bag.get_message_count(TOPIC))


def _wait_until_written(path: Path, size: int = 20_000) -> None:
    """Wait until the recorder has written so many bytes."""
    subprocess.run(['timeout', '30', 'sh', '-c',
                    f'until [ "$(stat -c %s "$0")" -gt {size} ]; do sleep 0.1; done', str(path)],
                   check=True)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_recording_and_its_report(record, own_environment, tmp_path: Path, number: int):
    run = record('--name', 'seam', '--lz4')
    run.wait_for_line('recording ' + str(tmp_path / 'bags' / 'seam.bag'))
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active', 6_000)
    assert run.signal_and_wait(number) == 0, run.text
    assert 'verdict: complete' in run.text
    assert TOPIC in run.text
    bag = tmp_path / 'bags' / 'seam.bag'
    assert _count(bag) > 10
    shown = run_command(own_environment, 'rosrun', 'process_visualizer', 'cell', 'report',
                        '--json', str(bag))
    assert shown.returncode == 0 and '"complete": true' in shown.stdout, shown.stdout
    stored = run_command(own_environment, 'rosrun', 'process_visualizer', 'cell', 'configuration',
                         str(bag), '--output', str(tmp_path / 'stored'))
    assert stored.stdout.strip() == str(tmp_path / 'stored' / 'cell.xml')
    assert DEVICE in (tmp_path / 'stored' / 'cell.xml').read_text()
    assert record('--name', 'seam').wait() == 1


def test_the_master_dies_while_recording(record, master, tmp_path: Path):
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    master.kill()
    run.wait_for_line('the ROS master does not answer')
    active = tmp_path / 'bags' / 'seam.bag.active'
    _wait_until_written(active, active.stat().st_size + 10_000)  # what is connected goes on
    assert run.signal_and_wait(signal.SIGINT) == 0, run.text
    assert 'verdict: complete' in run.text
    assert _count(tmp_path / 'bags' / 'seam.bag') > 100


def test_the_driver_dies_while_recording(record, driver, tmp_path: Path):
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active', 10_000)
    driver.kill()
    run.wait_for_line(f'{TOPIC}: silent')
    assert run.signal_and_wait(signal.SIGINT) == 0


def test_the_launcher_is_killed_while_recording(record, own_environment, tmp_path: Path):
    own_environment['RECORDER_TEST'] = mark = tmp_path.name
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active')
    run.signal_and_wait(signal.SIGKILL)
    assert wait_until_alone(f'RECORDER_TEST={mark}') == []
    assert os.listdir(tmp_path / 'bags') == ['seam.bag']
    assert _count(tmp_path / 'bags' / 'seam.bag') > 50


def test_the_run_is_killed_while_its_recorder_records(own_environment, driver, write_config,
                                                      tmp_path: Path):
    own_environment['RECORDER_TEST'] = mark = tmp_path.name
    run = CellRun(['run', write_config(DEVICE), '--no-rviz'], own_environment)
    run.wait_for_line('/bag_recorder: running')
    bags = tmp_path / 'bags'
    started = run_command(own_environment, 'rosservice', 'call', '/bag_recorder/start',
                          f'{{folder: {bags}, name: seam}}')
    assert 'success: True' in started.stdout, started.stdout
    _wait_until_written(bags / 'seam.bag.active', 10_000)
    run.signal_and_wait(signal.SIGKILL)
    assert wait_until_alone(f'RECORDER_TEST={mark}') == []
    assert os.listdir(bags) == ['seam.bag']
    assert _count(bags / 'seam.bag') > 10


def test_the_recorder_is_killed_while_recording(record, own_environment, tmp_path: Path):
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    active = tmp_path / 'bags' / 'seam.bag.active'
    _wait_until_written(active)
    recorder = run_command(own_environment, 'rosnode', 'info',
                           next(name for name in run_command(
                               own_environment, 'rosnode', 'list').stdout.split()
                               if name.startswith('/bag_recorder'))).stdout
    pid = next(line.split()[-1] for line in recorder.splitlines() if line.startswith('Pid'))
    os.kill(int(pid), signal.SIGKILL)
    assert run.wait() == 1
    assert f'cell reindex {active}' in run.text
    refused = run_command(own_environment, 'rosrun', 'process_visualizer', 'cell', 'report',
                          str(active))
    assert refused.returncode == 1
    assert f'"rosrun process_visualizer cell reindex {active}"' in refused.stdout
    mended = run_command(own_environment, 'rosrun', 'process_visualizer', 'cell', 'reindex',
                         str(active))
    assert mended.returncode == 0, mended.stdout
    assert _count(tmp_path / 'bags' / 'seam.reindexed.bag') > 50


def test_a_mark_on_a_finished_bag(record, own_environment, tmp_path: Path):
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active', 10_000)
    run.signal_and_wait(signal.SIGINT)
    bag = tmp_path / 'bags' / 'seam.bag'
    before = bag.read_bytes()
    command = ['rosrun', 'process_visualizer', 'cell', 'mark', str(bag)]
    marked = run_command(own_environment, *command, '0.25', 'the seam tears')
    assert marked.returncode == 0, marked.stdout
    assert bag.read_bytes() == before
    late = run_command(own_environment, *command, '1000', 'never')
    assert late.returncode == 1 and 'goes from 0 to' in late.stdout
    shown = run_command(own_environment, 'rosrun', 'process_visualizer', 'cell', 'report', str(bag))
    assert 'mark at 0:00.250: the seam tears' in shown.stdout


def test_without_a_master(ros_environment, write_config, free_port: int):
    run = CellRun(['record', write_config(DEVICE)],
                  {**ros_environment, 'ROS_MASTER_URI': f'http://localhost:{free_port}'})
    assert run.wait() == 1
    assert 'there is no ROS master' in run.text
