# SPDX-License-Identifier: BSD-3-Clause
"""`cell record`, and the fate of a recording when the master or the launcher is killed."""
from __future__ import annotations

import os
import signal
import subprocess
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Dict, Iterator, NamedTuple

import pytest
import rosbag
from running import CELL, CellRun, run_command
from surroundings import free_port, wait_until_alone

TOPIC = '/robot/q_act'
DEVICE = """<device type="other" name="robot"><base frame="b" /><topic ns="robot" name="q_act" />
<topic ns="robot" name="silent" /><topic ns="robot" name="points" record="False" /></device>"""


class Surroundings(NamedTuple):
    """A master, a driver that publishes at 50 Hz, and the environment in which they run."""

    environment: Dict[str, str]
    master: 'subprocess.Popen[bytes]'
    driver: 'subprocess.Popen[bytes]'


def with_free_port(environment: Dict[str, str]) -> Dict[str, str]:
    """The same with a master's port that no other test uses."""
    return {**environment, 'ROS_MASTER_URI': f'http://localhost:{free_port()}'}


@contextmanager
def running(environment: Dict[str, str], *command: str) -> Iterator['subprocess.Popen[bytes]']:
    """Run a program, and kill it in the end."""
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def surrounded(environment: Dict[str, str]) -> Iterator[Surroundings]:
    """Run a master and a driver."""
    port = environment['ROS_MASTER_URI'].split(':')[-1]
    with running(environment, 'rosmaster', '--core', '-p', port) as master:
        _wait_for(environment, 'rosparam', 'list')
        with running(environment, 'rostopic', 'pub', '-r', '50', TOPIC,
                     'std_msgs/Float32MultiArray', 'data: [1.0]') as driver:
            _wait_for(environment, 'rostopic', 'echo', '-n', '1', TOPIC)
            yield Surroundings(environment, master, driver)


def _wait_for(environment: Dict[str, str], *command: str) -> None:
    """Run a command until it succeeds."""
    for _ in range(100):
        if run_command(environment, 'timeout', '10', *command).returncode == 0:
            return
    raise AssertionError(f'{command} never succeeded')


@pytest.fixture(scope='module')
def shared(ros_environment: Dict[str, str]) -> Iterator[Surroundings]:
    """The surroundings that no test may end."""
    with surrounded(with_free_port(ros_environment)) as surroundings:
        yield surroundings


@pytest.fixture
def mortal(ros_environment: Dict[str, str]) -> Iterator[Surroundings]:
    """The surroundings that a test may end."""
    with surrounded(with_free_port(ros_environment)) as surroundings:
        yield surroundings


@pytest.fixture
def own_environment(shared: Surroundings) -> Dict[str, str]:
    """An environment that a test may change."""
    return dict(shared.environment)


@pytest.fixture
def start_recording(write_config: 'object', tmp_path: Path) -> Iterator['object']:
    """Return a function that starts `cell record` into tmp_path/bags."""
    runs = []

    def start(environment: Dict[str, str], *options: str) -> CellRun:
        runs.append(CellRun(['record', write_config(DEVICE), '--folder', str(tmp_path / 'bags'),
                             *options], environment))
        return runs[-1]

    yield start
    for run in runs:
        run.end()


@pytest.fixture
def record(start_recording: 'object', own_environment: Dict[str, str]) -> 'object':
    """The same in the surroundings that tests share."""
    return partial(start_recording, own_environment)


def _count(path: Path) -> int:
    with rosbag.Bag(str(path)) as bag:
        return int(bag.get_message_count(TOPIC))


def _wait_until_written(path: Path, size: int = 20_000) -> None:
    """Wait until the recorder has written this many bytes."""
    subprocess.run(['timeout', '120', 'sh', '-c',
                    f'until [ "$(stat -c %s "$0")" -gt {size} ]; do sleep 0.1; done', str(path)],
                   check=True)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_recording_its_report_and_a_mark(record, own_environment, tmp_path: Path, number: int):
    run = record('--name', 'seam', '--lz4')
    bag = tmp_path / 'bags' / 'seam.bag'
    run.wait_for_line(f'recording {bag}')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active', 6_000)
    assert run.signal_and_wait(number) == 0, run.text
    assert 'verdict: complete' in run.text
    assert TOPIC in run.text
    assert _count(bag) > 10
    if number == signal.SIGTERM:
        return
    stored = run_command(own_environment, CELL, 'configuration', str(bag), '--output',
                         str(tmp_path / 'stored'))
    assert stored.stdout.strip() == str(tmp_path / 'stored' / 'cell.xml')
    assert DEVICE in (tmp_path / 'stored' / 'cell.xml').read_text()
    assert record('--name', 'seam').wait() == 1
    _check_marking(own_environment, bag)


def _check_marking(environment: Dict[str, str], bag: Path) -> None:
    """A mark beside a finished bag, which the report shows."""
    before = bag.read_bytes()
    marked = run_command(environment, CELL, 'mark', str(bag), '0.25', 'the seam tears')
    assert marked.returncode == 0, marked.stdout
    assert bag.read_bytes() == before
    late = run_command(environment, CELL, 'mark', str(bag), '1000', 'never')
    assert late.returncode == 1 and 'goes from 0 to' in late.stdout
    shown = run_command(environment, CELL, 'report', str(bag))
    assert shown.returncode == 0 and 'mark at 0:00.250: the seam tears' in shown.stdout
    shown = run_command(environment, CELL, 'report', '--json', str(bag))
    assert shown.returncode == 0 and '"complete": true' in shown.stdout, shown.stdout


def test_the_master_dies_while_recording(start_recording, mortal, tmp_path: Path):
    run = start_recording(mortal.environment, '--name', 'seam')
    run.wait_for_line('recording ')
    mortal.master.kill()
    run.wait_for_line('the ROS master has stopped answering')
    active = tmp_path / 'bags' / 'seam.bag.active'
    _wait_until_written(active, active.stat().st_size + 10_000)  # existing connections continue
    assert run.signal_and_wait(signal.SIGINT) == 0, run.text
    assert 'verdict: complete' in run.text
    assert _count(tmp_path / 'bags' / 'seam.bag') > 100


def test_the_driver_dies_while_recording(start_recording, mortal, tmp_path: Path):
    run = start_recording(mortal.environment, '--name', 'seam')
    run.wait_for_line('recording ')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active', 10_000)
    mortal.driver.kill()
    run.wait_for_line(f'{TOPIC}: fell silent')
    assert run.signal_and_wait(signal.SIGINT) == 0


def test_the_launcher_is_killed_while_recording(record, own_environment, tmp_path: Path):
    own_environment['RECORDER_TEST'] = mark = tmp_path.name
    run = record('--name', 'seam')
    run.wait_for_line('recording ')
    _wait_until_written(tmp_path / 'bags' / 'seam.bag.active')
    run.signal_and_wait(signal.SIGKILL)
    wait_until_alone(f'RECORDER_TEST={mark}')
    assert os.listdir(tmp_path / 'bags') == ['seam.bag']
    assert _count(tmp_path / 'bags' / 'seam.bag') > 50


def test_the_run_is_killed_while_its_recorder_records(own_environment, write_config,
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
    wait_until_alone(f'RECORDER_TEST={mark}')
    assert os.listdir(bags) == ['seam.bag']
    assert _count(bags / 'seam.bag') > 10


def test_the_recorder_is_killed_while_recording(start_recording, mortal, tmp_path: Path):
    environment = mortal.environment
    run = start_recording(environment, '--name', 'seam')
    run.wait_for_line('recording ')
    active = tmp_path / 'bags' / 'seam.bag.active'
    _wait_until_written(active)
    recorder = run_command(environment, 'rosnode', 'info',
                           next(name for name in run_command(
                               environment, 'rosnode', 'list').stdout.split()
                                if name.startswith('/bag_recorder'))).stdout
    pid = next(line.split()[-1] for line in recorder.splitlines() if line.startswith('Pid'))
    os.kill(int(pid), signal.SIGKILL)
    assert run.wait() == 1
    assert f'cell reindex {active}' in run.text
    refused = run_command(environment, CELL, 'report', str(active))
    assert refused.returncode == 1
    assert f'"rosrun process_visualizer cell reindex {active}"' in refused.stdout
    mended = run_command(environment, CELL, 'reindex', str(active))
    assert mended.returncode == 0, mended.stdout
    assert _count(tmp_path / 'bags' / 'seam.reindexed.bag') > 50


@pytest.fixture
def record_without(own_environment: Dict[str, str]) -> Iterator['object']:
    """Return a function that starts `cell record` without a configuration."""
    runs = []

    def start(*options: str) -> CellRun:
        runs.append(CellRun(['record', *options], own_environment))
        return runs[-1]

    yield start
    for run in runs:
        run.end()


def test_as_rosbag_record_all_topics_for_a_time(record_without, tmp_path: Path):
    bag = tmp_path / 'new' / 'all.bag'
    run = record_without('-a', '-x', '/rosout.*', '-O', str(bag), '--duration', '2')
    assert run.wait() == 0, run.text
    assert f'recording {bag}' in run.text and 'verdict: ' in run.text
    assert _count(bag) > 0
    with rosbag.Bag(str(bag)) as content:
        assert set(content.get_type_and_topic_info().topics) == {
            TOPIC, '/process_visualizer/recording'}


def test_all_topics_are_those_too_that_come_later(record_without, own_environment,
                                                  tmp_path: Path):
    run = record_without('-e', '/robot/.*', '/later/.*', '-O', str(tmp_path / 'a'), '--split',
                         '--size', '100')
    run.wait_for_line('recording ')
    with running(own_environment, 'rostopic', 'pub', '-r', '50', '/later/one', 'std_msgs/Int8',
                 '1'):
        _wait_until_recorded(own_environment, '/later/one')
        assert run.signal_and_wait(signal.SIGINT) == 0, run.text
    with rosbag.Bag(str(tmp_path / 'a_0.bag')) as content:
        assert content.get_message_count('/later/one') > 5
        assert content.get_message_count(TOPIC) > 5


def _wait_until_recorded(environment: Dict[str, str], topic: str) -> None:
    """Wait until a recorder counts ten messages of a topic."""
    recorder = next(name for name in run_command(environment, 'rosnode', 'list').stdout.split()
                    if name.startswith('/bag_recorder_'))
    for _ in range(100):
        state = run_command(environment, 'timeout', '10', 'rostopic', 'echo', '-n', '1',
                            f'{recorder}/state').stdout
        after = state.partition(f'name: "{topic}"')[2].partition('messages: ')[2]
        if after and int(after.split()[0]) >= 10:
            return
    raise AssertionError(f'{topic} is not recorded: {state}')


def test_what_a_node_subscribes_to_until_a_size(record_without, own_environment, tmp_path: Path):
    with running(own_environment, 'rostopic', 'hz', TOPIC, '__name:=listener'), \
            running(own_environment, 'rostopic', 'pub', '-r', '100', '/other', 'std_msgs/String',
                    'x' * 20_000):
        _wait_for(own_environment, 'sh', '-c', f'rostopic info {TOPIC} | grep /listener')
        run = record_without('/other', '--node', 'listener', '-O', str(tmp_path / 'a.bag'),
                             '--size', '2', '-q', '-b', '0')
        assert run.wait() == 0, run.text
        assert run.text.strip() == ''
    assert 2 << 20 <= (tmp_path / 'a.bag').stat().st_size < 20 << 20
    assert _count(tmp_path / 'a.bag') > 1


def test_a_node_that_is_not_there(record_without, tmp_path: Path):
    run = record_without('--node', 'nobody', '--folder', str(tmp_path))
    assert run.wait() == 1
    assert '/nobody subscribes to no topic' in run.text


def test_without_a_master(ros_environment, start_recording):
    run = start_recording(with_free_port(ros_environment))
    assert run.wait() == 1
    assert 'there is no ROS master' in run.text
