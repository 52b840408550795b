# SPDX-License-Identifier: BSD-3-Clause
"""Bad input of a robot in a running cell: it is named, the last good state stays, nodes live on."""
from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Dict, Iterator, List, Set, Tuple

import pytest
import yaml
from running import CellRun, run_command

ARRAY, JOINTS, TEXT = 'std_msgs/Float32MultiArray', 'sensor_msgs/JointState', 'std_msgs/String'
POSE, WRENCH = 'geometry_msgs/PoseStamped', 'geometry_msgs/WrenchStamped'
GOOD = [0.1, -1.0, 1.5, -2.0, -1.5, 0.0]
CONFIGURATION = '''
<device type="robot" name="arm">
  <model pkg="sewing_cell" path="urdf/ur_rt_upper.urdf.xacro" />
  <base frame="ur_rt_upper/link0" />
  <topic ns="arm" name="q" type="joint_states" />
  <topic ns="arm" name="tcf" type="tool_center_frame" />
  <topic ns="arm" name="ft" type="force_sensor" />
  <force parentframe="ur_rt_upper/tool" frame="arm/force" xyz="0 0 0" rpy="0 0 0" />
</device>
<device type="robot" name="loose">
  <base frame="loose/link0" />
  <topic ns="loose" name="tcf" type="tool_center_frame" />
  <topic ns="loose" name="ft" type="force_sensor" />
  <force parentframe="loose/nowhere" frame="loose/force" xyz="0 0 0" rpy="0 0 0" />
</device>
<device type="robot" name="misfit">
  <model pkg="sewing_cell" path="urdf/ur_rt_lower.urdf.xacro" />
  <base frame="ur_rt_lower/link0" />
  <topic ns="misfit" name="q" type="joint_states" msg="sensor_msgs/JointState" />
</device>
<device type="other" name="oven">
  <base frame="oven/base" />
  <variable topic="/oven/heat" frame="oven/base" label="heat" />
</device>'''
SHOWN = ('v 0.000 m/s', 'F 20.0 N')
NODES = {'/arm/robot_proc', '/arm/joint_proc', '/arm/robot_state_publisher', '/loose/robot_proc',
         '/misfit/joint_proc', '/misfit/robot_proc', '/oven/variable_proc', '/cell_frames'}


def array(*values: object) -> str:
    return f'{{data: [{", ".join(map(str, values))}]}}'


Case = Tuple[str, str, str, str]
ROUNDS: List[List[Case]] = [
    [('/arm/q', ARRAY, array(*GOOD[:5]), '6 values are expected, one for each joint of'),
     ('/arm/tcf', ARRAY, array(1, 2, 3, 4), '3 values (x y z), 6 (with a rotation vector) or 7'),
     ('/arm/ft', ARRAY, array(1, 2), '3 values (a force) or 6'),
     ('/misfit/q', JOINTS, '{name: [j7, j8], position: [0.1, 0.2]}',
      'none of the names j7, j8 is a joint of the robot; its joints are ur_rt_lower/')],
    [('/arm/q', ARRAY, array(*GOOD, 0.5), '6 values are expected, one for each joint of'),
     ('/arm/tcf', ARRAY, array(0, 0, '.nan', 0, 0, 0), 'it holds NaN or infinity'),
     ('/arm/ft', ARRAY, array('.inf', 0, 0), 'it holds NaN or infinity'),
     ('/misfit/q', ARRAY, array(*GOOD), f'it carries {ARRAY}, and {JOINTS} is expected')],
    [('/arm/q', ARRAY, array('.nan', *GOOD[1:]), 'is NaN or infinite'),
     ('/arm/tcf', POSE, '{header: {frame_id: elsewhere}, pose: {orientation: {w: 1.0}}}',
      'its frame is elsewhere, which neither the model nor a static transform connects with the '
      'base frame ur_rt_upper/link0'),
     ('/arm/ft', TEXT, '{data: strong}', f'it carries {TEXT}, and {ARRAY} or {WRENCH}')],
    [('/arm/q', ARRAY, array('-.inf', *GOOD[1:]), 'is NaN or infinite'),
     ('/arm/tcf', POSE, '{pose: {orientation: {w: .nan}}}', 'it holds NaN or infinity'),
     ('/arm/ft', WRENCH, '{wrench: {force: {x: .nan}}}', 'it holds NaN or infinity')],
    [('/arm/q', TEXT, '{data: bent}', f'it carries {TEXT}, and {ARRAY} or {JOINTS}'),
     ('/arm/tcf', TEXT, '{data: there}', f'it carries {TEXT}, and {ARRAY} or {POSE}')],
]
"""Topic, type, content and what is said; those of a round at once, as warnings are throttled."""


@contextmanager
def running(environment: Dict[str, str], *command: str, **options: object
            ) -> 'Iterator[subprocess.Popen[bytes]]':
    """Run a program meanwhile."""
    process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL,
                               **{'stdout': subprocess.DEVNULL, **options})  # type: ignore
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def sending(environment: Dict[str, str], topic: str, message_type: str, content: str):
    """Publish a message 20 times a second meanwhile."""
    return running(environment, 'rostopic', 'pub', '-r', '20', topic, message_type, content)


@contextmanager
def sending_all(environment: Dict[str, str], *messages: Tuple[str, str, str]) -> Iterator[None]:
    """Publish several messages meanwhile: topic, type, content of each."""
    with ExitStack() as stack:
        processes = [stack.enter_context(sending(environment, *message)) for message in messages]
        try:
            yield
        finally:
            for process in processes:  # all at once: each takes its time
                process.terminate()


def simulated_clock(environment: Dict[str, str], begin_s: float, speed: float):
    script = str(Path(__file__).with_name('simulated_clock.py'))
    return running(environment, sys.executable, script, str(begin_s), str(speed))


GOOD_DATA = (('/arm/q', ARRAY, array(*GOOD)), ('/arm/tcf', ARRAY, array(0.5, 0, 0.2, 0, 0, 0)),
             ('/arm/ft', ARRAY, array(0, 0, 20)))


def assert_shown(environment: Dict[str, str], device: str, *texts: str) -> None:
    """Look at markers until all the texts are beside a device; the arrays have not always texts."""
    shown: Set[str] = set()
    for _ in range(5):
        echo = run_command(environment, 'timeout', '20', 'rostopic', 'echo', '-n', '12',
                           f'/{device}/marker_array').stdout
        shown = {marker['text'].strip() for array_of_markers in yaml.safe_load_all(echo)
                 for marker in (array_of_markers or {}).get('markers', [])}
        if all(any(one.startswith(text) for one in shown) for text in texts):
            return
    raise AssertionError(f'{texts} are expected beside {device}, and not {shown}')


def problem_line(topic: str, problem: str) -> str:
    device = topic.split('/')[1]
    return f'{device}: a message on {topic} is left out: {problem}'


def assert_alive(run: CellRun, environment: Dict[str, str], nodes: Set[str] = NODES) -> None:
    assert nodes <= set(run_command(environment, 'rosnode', 'list').stdout.split())
    assert 'exited' not in run.text and 'Traceback' not in run.text, run.text


@contextmanager
def noted_joint_states(environment: Dict[str, str], path: Path) -> Iterator[None]:
    """Write the positions of every joint state into a file meanwhile."""
    with path.open('w') as file, running(environment, 'rostopic', 'echo', '-p',
                                         '/arm/joint_states/position', stdout=file):
        yield


def assert_named(run: CellRun, environment: Dict[str, str], cases: List[Case]) -> None:
    """Send what is bad until it is named; meanwhile the robot is shown as without data."""
    with sending_all(environment, *(case[:3] for case in cases)):
        for topic, _, _, problem in cases:
            run.wait_for_line(problem_line(topic, problem))
        assert_shown(environment, 'arm', 'v no data for', 'F no data for', 'joints no data for')


class TestWhileOneCellRuns:
    """What is bad for one device must not end any node, so all of it is sent to one cell."""

    @pytest.fixture(scope='class')
    def run(self, ros_environment, tmp_path_factory) -> Iterator[CellRun]:
        path = tmp_path_factory.mktemp('bad_input') / 'cell.xml'
        path.write_text(f'<visualizer>{CONFIGURATION}</visualizer>')
        cell = CellRun(['run', str(path), '--no-rviz'], ros_environment)
        for node in NODES:
            cell.wait_for_line(f'{node}: running')
        yield cell
        assert cell.signal_and_wait(signal.SIGINT) == 0

    def test_bad_input_is_named_and_the_last_good_state_stays(self, run, ros_environment, tmp_path):
        path = tmp_path / 'joint_states.txt'
        with noted_joint_states(ros_environment, path):
            with sending_all(ros_environment, *GOOD_DATA):
                assert_shown(ros_environment, 'arm', *SHOWN)
            for cases in ROUNDS:
                assert_named(run, ros_environment, cases)
            with sending_all(ros_environment, *GOOD_DATA):
                assert_shown(ros_environment, 'arm', *SHOWN)
        assert_alive(run, ros_environment)
        states = {line.partition(',')[2] for line in path.read_text().splitlines()[1:]}
        assert len(states) == 1, states
        assert [round(float(value), 6) for value in states.pop().split(',')] == GOOD

    def test_frames_that_are_not_there_are_named(self, run, ros_environment):
        before = len(run.text)
        with sending_all(ros_environment, *GOOD_DATA,
                         ('/loose/tcf', ARRAY, array(0.5, 0, 0.2, 0, 0, 0)),
                         ('/loose/ft', ARRAY, array(0, 0, 20))):
            run.wait_for_line('loose: the data of /loose/ft is not drawn, as tf does not '
                              'connect the frame loose/force with loose/link0')
            assert_alive(run, ros_environment)
        assert 'arm: what' not in run.text[before:]
        assert '/loose/tcf brings' not in run.text  # it is drawn at the reported position

    def test_variables_take_bad_input_too(self, run, ros_environment):
        heat = 'oven: field data of /oven/heat is not shown: '
        with running(ros_environment, 'rostopic', 'echo', '/oven/marker_array'):
            with sending(ros_environment, '/oven/heat', 'std_msgs/Float32', '{data: 0.5}'):
                assert_shown(ros_environment, 'oven', 'heat 0.500')
            with sending(ros_environment, '/oven/heat', 'std_msgs/Float32', '{data: .nan}'):
                run.wait_for_line(heat + 'its value is nan')
            with sending(ros_environment, '/oven/heat', TEXT, '{data: hot}'):
                run.wait_for_line(heat + 'data is a text')
                assert_shown(ros_environment, 'oven', 'heat no data for')
            with sending(ros_environment, '/oven/heat', 'std_msgs/Float64', '{data: 0.25}'):
                assert_shown(ros_environment, 'oven', 'heat 0.250')
        assert_alive(run, ros_environment)


def test_time_that_stands_still_or_goes_back(run_cell, write_config, ros_environment):
    simulated = CONFIGURATION.replace('<base frame="oven/base" />',
                                      '<base frame="oven/base" />'
                                      '<param name="/use_sim_time" value="true" />')
    run = run_cell(write_config(simulated), '--no-rviz')
    for node in ('/arm/robot_proc', '/arm/joint_proc', '/arm/robot_state_publisher'):
        run.wait_for_line(f'{node}: running')
    with sending_all(ros_environment, *GOOD_DATA):
        with simulated_clock(ros_environment, 100.0, 0.0):
            for topic in ('/arm/q', '/arm/tcf', '/arm/ft'):
                run.wait_for_line(f'arm: a message on {topic} is shown, but ROS time stands still')
        with simulated_clock(ros_environment, 200.0, 1.0):
            assert_shown(ros_environment, 'arm', *SHOWN)
        with simulated_clock(ros_environment, 50.0, 1.0):
            for topic in ('/arm/q', '/arm/tcf', '/arm/ft'):
                run.wait_for_line(f'arm: a message on {topic} is shown, but ROS time has gone back')
            assert_shown(ros_environment, 'arm', *SHOWN)
            assert_alive(run, ros_environment)
    assert run.signal_and_wait(signal.SIGINT) == 0
