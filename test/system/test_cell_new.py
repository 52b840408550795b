# SPDX-License-Identifier: BSD-3-Clause
"""``cell new`` beside running drivers: its configuration passes ``cell check``, and runs."""
from __future__ import annotations

import re
import signal
import subprocess
from pathlib import Path
from typing import Callable, Dict, Iterator, Set

import pytest
import rosgraph
from running import CELL, CellRun, run_command
from surroundings import wait_until

from process_visualizer.cell.model import TopicFunction
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.launching.ros_api import CALLER_ID
from process_visualizer.launching.ros_master import RosMaster

DESCRIPTION = '''<robot name="lower"><link name="low/base" /><link name="low/tool" />
<joint name="j" type="continuous"><parent link="low/base" /><child link="low/tool" /></joint>
</robot>'''


@pytest.fixture
def drivers(master: RosMaster, ros_environment: Dict[str, str]) -> Iterator[None]:
    """Run the simulated drivers, tf for one robot's base, and a description of something else."""
    commands = (
        ['sewing_cell', 'simulator', '_image_rate:=2', '_joint_rate:=20', '_force_rate:=20'],
        ['tf2_ros', 'static_transform_publisher', *'0 1 0.5 0 0 0 table ur_rt_upper/link0'.split()])
    processes = [subprocess.Popen(['rosrun', *command], env=ros_environment)
                 for command in commands]
    rosgraph.Master(CALLER_ID).setParam('/low/robot_description', DESCRIPTION)
    wait_for_topics('/ur_rt_lower/tcf', '/camera/rgb/image_color', '/tf_static')
    yield
    for process in processes:
        process.terminate()
        process.wait()


def wait_for_topics(*names: str) -> None:
    def topics() -> Set[str]:
        return {name for name, _ in rosgraph.Master(CALLER_ID).getTopicTypes()}

    wait_until(lambda: set(names) <= topics(), f'all of {names}', instead=topics)


def test_a_configuration_for_what_runs(drivers: None, ros_environment: Dict[str, str],
                                       run_cell: Callable[..., CellRun], tmp_path: Path) -> None:
    config = str(tmp_path / 'cell.xml')
    made = run_command(ros_environment, CELL, 'new', '-o', config)
    assert made.returncode == 0, made.stdout
    assert made.stdout.splitlines()[:2] == [config, str(tmp_path / 'low_device.urdf')]
    assert '2 robots, 1 depth sensor, 2 other devices' in made.stdout
    checked = run_command(ros_environment, CELL, 'check', config)
    assert (checked.returncode, checked.stdout) == (0, f'{config}: 5 devices, no problem\n')
    is_what_runs(config)
    run = run_cell(config, '--no-rviz')
    run.wait_for_line('/ur_rt_upper/robot_proc: running')
    run.wait_for_line('/camera/depth_proc: running')
    run.wait_for_line('/bag_recorder: running')
    is_the_cell_that_runs(ros_environment, config, tmp_path / 'beside.xml')
    assert run.signal_and_wait(signal.SIGINT) == 0
    again = run_command(ros_environment, CELL, 'new', '-o', str(tmp_path / 'again.xml'))
    assert '2 robots, 1 depth sensor, 2 other devices' in again.stdout


_NODE = re.compile('<node .*</node>', re.DOTALL)
_LEFT_OUT = re.compile('<!-- left out, as it was in a recording: <node .*? -->')


def is_the_cell_that_runs(environment: Dict[str, str], config: str, path: Path) -> None:
    """While a cell runs, its configuration is written, without its models beside the drivers'."""
    made = run_command(environment, CELL, 'new', '-o', str(path))
    assert '2 robots, 1 depth sensor, 2 other devices' in made.stdout
    text = path.read_text(encoding='utf-8')
    assert 'from the cell running at' in text
    devices = Path(config).read_text(encoding='utf-8').partition('<visualizer')[2]
    own = _NODE.search(devices)  # of the configuration; those of a running cell are data
    assert own is not None and 'its package nodelet is not trusted' in ' '.join(text.split())
    assert _LEFT_OUT.sub('', text.partition('<visualizer')[2]) == devices.replace(own[0], '')


def is_what_runs(config: str) -> None:
    cell = XmlParser().parse(config)
    upper, low = cell.device('ur_rt_upper'), cell.device('low_device')
    assert cell.frame == 'table' and upper.base is not None
    assert (upper.base.frame, upper.base.pose.xyz) == ('ur_rt_upper/link0', (0.0, 1.0, 0.5))
    assert upper.model is not None and upper.model.package == 'sewing_cell'
    assert {function: getattr(upper.topic_for(function), 'name', '')
            for function in (TopicFunction.JOINT_STATES, TopicFunction.FORCE_SENSOR)} == {
        TopicFunction.JOINT_STATES: '/ur_rt_upper/q_act',
        TopicFunction.FORCE_SENSOR: '/ft_upper/ft'}
    assert low.model is not None and low.model.package == ''
