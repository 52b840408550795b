# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: output and exit codes of check, show and generate."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Callable, List, Tuple

import pytest

from process_visualizer.commands.command_line import main
from process_visualizer.rviz.views import SavedViews

REPOSITORY = Path(__file__).resolve().parents[3]
Write = Callable[..., str]
Cell = Callable[..., Tuple[int, List[str], List[str]]]

TABLE = '''<device type="other" name="table">
  <node pkg="rosout" type="rosout" name="n"/>
  <topic name="height"/>
</device>'''


@pytest.fixture
def cell(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
         tmp_path: Path) -> Cell:
    """Runs the command in a separate folder: exit code, lines of output, lines of errors."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> Tuple[int, List[str], List[str]]:
        try:
            code = main(arguments)
        except SystemExit as end:  # as argparse exits
            code = int(end.code or 0)
        written = capsys.readouterr()
        return code, written.out.splitlines(), written.err.splitlines()
    return run


def test_check(cell: Cell, write: Write) -> None:
    path = write(TABLE)
    assert cell('check', path) == (0, [f'{path}: 1 device, no problem'], [])


def test_check_of_the_default_configuration(cell: Cell) -> None:
    path = str(REPOSITORY / 'sewing_cell' / 'devices' / 'simulated.xml')
    assert cell('check', path) == (0, [f'{path}: 6 devices, no problem'], [])


def test_check_reports_every_problem(cell: Cell, write: Write) -> None:
    path = write('<device type="robot" name="arm">\n<bas frame="a"/>\n<node pkg="a" type="b"/>\n'
                 '</device>')
    code, lines, errors = cell('check', path)
    assert (code, lines) == (1, [])
    assert [error.split(': ')[0] for error in errors] == [f'{path}:3', f'{path}:4']


def test_check_reports_what_this_computer_lacks(cell: Cell, write: Write) -> None:
    path = write('<device type="robot" name="arm">\n<model pkg="nope" path="a.urdf"/>\n'
                 '<node pkg="rosout" type="nope" name="n" ifstate="playback"/>\n'
                 '<launch pkg="rosout" type="nope.launch"/></device>')
    code, lines, errors = cell('check', path)
    assert (code, lines) == (1, [])
    assert [error.split(': ')[0] for error in errors] == [f'{path}:{line}' for line in (3, 4, 5)]


@pytest.mark.parametrize('model, problem', [
    ('<robot/>', 'not a valid URDF'), ('<robot name="a"><link name="l">', 'not well-formed XML')])
@pytest.mark.parametrize('command', ['check', 'run'])
def test_a_broken_model_is_found_before_anything_starts(
        command: str, model: str, problem: str, cell: Cell, write: Write, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'my_cell'
    folder.mkdir()
    (folder / 'package.xml').write_text('<package><name>my_cell</name></package>')
    (folder / 'a.urdf').write_text(model)
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder))
    code, lines, (error,) = cell(command, write(
        '<device type="robot" name="arm"><model pkg="my_cell" path="a.urdf"/></device>'))
    assert (code, lines) == (1, [])
    assert f'cell.xml:2: <model>: {folder}/a.urdf: {problem}' in error


def test_check_reports_at_once_what_is_wrong_in_the_file_and_on_this_computer(
        cell: Cell, write: Write) -> None:
    """A wrong type, wrong values and missing packages: none of these hides another."""
    code, lines, errors = cell('check', write('''<device type="robt" name="arm">
        <base frame="b" xyz="0 0"/>
        <model pkg="gone" path="a.urdf" prefx="x"/>
        <topic name="q" type="joint_state" msg="std_msgs/Float32Array"/>
        <topic name="p" type="tool_center_frame" msg="geometry_msgs/Pose"/>
        <node pkg="lost" type="driver" name="driver" respawn="often"/>
        <variable topic="t" frame="b" low="2" high="1" scale="x"/></device>
        <device name="a"><launch pkg="nowhere" type="a.launch"/></device>'''))
    assert (code, lines) == (1, [])
    expected = [(2, 'robot'), (3, '"xyz"'), (4, 'prefix'), (4, '"gone"'),
                (5, '"joint_states"'), (5, 'Float32MultiArray'), (6, 'PoseStamped'),
                (7, '"respawn"'), (7, '"lost"'), (8, '"scale"'), (8, 'swap'),
                (9, '"type" is missing'), (9, '"nowhere"')]
    assert len(errors) == len(expected), errors
    for line, word in expected:
        assert any(f'cell.xml:{line}: ' in error and word in error for error in errors), word


@pytest.fixture
def arm_cell(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a cell with an arm that has this content; its model is that of a UR5e."""
    folder = tmp_path / 'my_cell'
    folder.mkdir()
    (folder / 'package.xml').write_text('<package><name>my_cell</name></package>')
    model = REPOSITORY / 'test' / 'data' / 'ur5e.urdf'
    (folder / 'ur5e.urdf').write_text(model.read_text())
    (folder / 'd.launch').write_text(
        '<launch><node pkg="tf2_ros" type="static_transform_publisher" name="n" '
        'args="0 0 1 0 0 0 base_link shelf"/></launch>')
    monkeypatch.setenv('ROS_PACKAGE_PATH', f'{folder}:{os.environ["ROS_PACKAGE_PATH"]}')
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'home'))
    return lambda content, others='': write(
        '<device type="robot" name="arm"><base frame="base_link"/>'
        f'<model pkg="my_cell" path="ur5e.urdf"/>{content}</device>{others}')


JOINTS = '<topic name="q" type="joint_states"/>'


def test_check_warns_of_frames_that_nothing_has(cell: Cell, arm_cell: Write) -> None:
    code, _, warnings = cell('check', arm_cell(JOINTS + '''<tool frame="tol0"/>
        <variable topic="t" frame="wrist_3_joint"/>
        <variable topic="u" frame="hot/air"/>
        <variable topic="v" frame="shelf"/><launch pkg="my_cell" type="d.launch"/>'''))
    assert code == 0
    assert [warning.partition('cell.xml:')[2] for warning in warnings] == [
        '2: <tool>: warning: no model, <base>, <tool> or <force> has the frame "tol0"; did you '
        'mean "tool0"?',
        '3: <variable>: warning: "wrist_3_joint" is a joint, not a frame; did you mean its link '
        '"wrist_3_link"?',
        '4: <variable>: warning: no model, <base>, <tool> or <force> has the frame "hot/air"; it '
        'is not shown unless a driver publishes the frame in tf']


def test_check_believes_that_a_driver_brings_the_frame_of_a_tf_topic(cell: Cell,
                                                                     arm_cell: Write) -> None:
    path = arm_cell(JOINTS + '<topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" '
                    'frame="tool0_controller"/><variable topic="t" frame="tool0_controller"/>')
    assert cell('check', path)[2] == []


def test_check_warns_of_a_robot_that_nothing_moves(cell: Cell, arm_cell: Write) -> None:
    code, _, (warning,) = cell('check', arm_cell(''))
    assert code == 0
    assert 'no topic of "arm" has the type "joint_states", so its model does not move' in warning
    assert cell('check', arm_cell(JOINTS))[2] == []


@pytest.mark.parametrize('command', ['check', 'generate'])
def test_a_base_that_is_a_link_of_another_model_is_refused(command: str, cell: Cell,
                                                           arm_cell: Write) -> None:
    code, _, (error,) = cell(command, arm_cell(
        JOINTS, '\n<device type="other" name="lamp"><base frame="tool0"/></device>'))
    assert code == 1
    assert error.endswith('cell.xml:3: <base>: the frame "tool0" is a link of the model of "arm", '
                          'which determines its place; choose another name')


def test_two_devices_with_one_base_frame_are_refused(cell: Cell, arm_cell: Write) -> None:
    code, _, (error,) = cell('check', arm_cell(
        JOINTS, '\n<device type="other" name="lamp"><base frame="/base_link"/></device>'))
    assert (code, 'the frame "base_link" already exists' in error) == (1, True)


def test_check_warns_of_a_chosen_view_without_a_device(cell: Cell, arm_cell: Write,
                                                       tmp_path: Path) -> None:
    path = arm_cell(JOINTS, '<device type="other" name="lamp"><base frame="l"/></device>')
    assert cell('generate', path)[0] == 0
    SavedViews(path, ['arm', 'lamp']).save('mine', str(tmp_path / 'cell.rviz'))
    assert cell('check', path)[2] == []
    path = arm_cell(JOINTS, '\n<device type="other" name="lamp"><base frame="l" xyz="9 9 0"/>'
                            '</device>')
    (warning,) = cell('check', path)[2]
    assert 'cell.xml:3: <device>: warning: "lamp" is not visible in the chosen ' \
           'view "mine"' in warning


def test_warnings_do_not_fail_the_check(cell: Cell, write: Write, tmp_path: Path,
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'my_cell'
    folder.mkdir()
    (folder / 'package.xml').write_text('<package><name>my_cell</name></package>')
    (folder / 'd.launch').write_text('<launch><node pkg="nope" type="a" name="n"/></launch>')
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder))
    path = write('<device type="other" name="d"><launch pkg="my_cell" type="d.launch"/></device>')
    assert cell('check', path) == (
        0, [f'{path}: 1 device, no problem, 1 warning'],
        [f'{path}:2: <launch>: warning: device "d": d.launch: the node /n needs the package '
         '"nope", which is not installed; the device starts without it'])


@pytest.mark.parametrize('command', ['check', 'show', 'generate', 'run'])
def test_missing_configuration(command: str, cell: Cell) -> None:
    code, lines, (error,) = cell(command, 'gone.xml')
    assert (code, lines) == (1, [])
    assert error.startswith('gone.xml:1: there is no file "gone.xml"')


@pytest.mark.parametrize('command', ['generate', 'run'])
def test_nothing_is_written_for_a_broken_configuration(command: str, cell: Cell, write: Write,
                                                       tmp_path: Path) -> None:
    path = write('<device type="robot" name="arm"><node pkg="nope" type="a" name="b"/></device>')
    code, lines, errors = cell(command, path, '--output', 'made')
    assert (code, lines, len(errors)) == (1, [], 1)
    assert not (tmp_path / 'made').exists()


def test_show(cell: Cell, write: Write) -> None:
    path = write('''<device type="robot" name="arm">
        <base frame="arm/base" xyz="1 -0.5 0" rpy="0 3.14159265 0"/>
        <model pkg="my_cell" path="urdf/arm.xacro"/>
        <node pkg="a" type="b.py" name="n"/><node pkg="a" type="c" name="m" ifstate="realtime"/>
        <launch pkg="a" type="d.launch" ifstate="playback"/>
        <topic ns="arm" name="q" type="joint_states"/>
        <topic name="x" record="false"/><topic name="y"/>
        <topic name="f" type="force_sensor" record="false"/></device>''' + TABLE)
    code, lines, errors = cell('show', path)
    assert (code, errors) == (0, [])
    assert lines == [
        path, 'global frame: world', '', 'arm (robot)',
        '  base frame  arm/base  xyz 1 -0.5 0 m  yaw pitch roll 0 3.14159 0 rad',
        '  model       my_cell/urdf/arm.xacro',
        '  tool frame  not known, as the model cannot be used (see cell check)',
        '  node        a/b.py',
        '  node        a/c  (realtime only)', '  launch      a/d.launch  (playback only)',
        '  topic       /arm/q  (joint_states)', '  topic       /x  (not recorded)',
        '  topic       /y', '  topic       /f  (force_sensor, not recorded)', '',
        'table (other)', '  node        rosout/rosout', '  topic       /height']


@pytest.mark.parametrize('element, shown', [
    ('', 'arm/tool  (there is no model to choose from)'),
    ('<tool frame="tip"/>', 'tip  (as configured)'),
    ('<tool frame="tip" xyz="0 0 0.1"/>', 'arm/tool_center_frame  in tip  xyz 0 0 0.1 m  '
                                          'yaw pitch roll 0 0 0 rad  (as configured)')])
def test_show_tool_frame(element: str, shown: str, cell: Cell, write: Write) -> None:
    lines = cell('show', write(f'<device type="robot" name="arm">{element}</device>'))[1]
    assert f'  tool frame  {shown}' in lines


@pytest.mark.parametrize('attributes, shown', [
    ('msg="tf2_msgs/TFMessage" frame="tip"', 'tool_center_frame, tip in arm/base'),
    ('msg="tf2_msgs/TFMessage"', 'tool_center_frame, arm/tool in arm/base'),
    ('parentframe="foot"', 'tool_center_frame, in foot'), ('', 'tool_center_frame')])
def test_show_the_frames_of_a_tool(attributes: str, shown: str, cell: Cell, write: Write) -> None:
    lines = cell('show', write(f'''<device type="robot" name="arm">
        <base frame="arm/base" xyz="0 0 0"/>
        <topic name="tf" type="tool_center_frame" {attributes}/></device>'''))[1]
    assert f'  topic       /tf  ({shown})' in lines


@pytest.mark.parametrize('names, shown', [
    ('table', ['table']), ('arm,table', ['arm', 'table']), ('table,arm,', ['arm', 'table'])])
def test_show_some_devices(names: str, shown: List[str], cell: Cell, write: Write) -> None:
    path = write('<device type="robot" name="arm"/>' + TABLE)
    lines = cell('show', path, '--devices', names)[1]
    assert [line.split()[0] for line in lines if line.endswith(('(robot)', '(other)'))] == shown


@pytest.mark.parametrize('names, message', [
    ('tabel', 'cell: there is no device "tabel"; did you mean "table"?'),
    ('', 'cell: no device is chosen; expected one of: table'),
    (',', 'cell: no device is chosen; expected one of: table')])
def test_wrong_devices(names: str, message: str, cell: Cell, write: Write) -> None:
    assert cell('show', write(TABLE), '--devices', names) == (1, [], [message])


@pytest.mark.parametrize('word', ['speed', ':=5', '=5', 'speed=5'])
def test_what_is_not_a_value(word: str, cell: Cell, write: Write) -> None:
    assert cell('show', write(TABLE), word) == (
        1, [], [f'cell: "{word}" is not an argument; write NAME:=VALUE'])


ARGUMENTS = '''<arg name="kind" default="table"/><arg name="topic" default="t"/>
<device type="other" name="$(arg kind)"><topic name="$(arg topic)"/></device>'''


@pytest.mark.parametrize('order', [
    ['CONFIG', 'kind:=chair', 'topic:=u', '--devices', 'chair'],
    ['CONFIG', '--devices', 'chair', 'kind:=chair', 'topic:=u'],
    ['kind:=chair', 'CONFIG', 'topic:=u', '--devices', 'chair'],
    ['--devices', 'chair', 'topic:=u', 'CONFIG', 'kind:=chair'],
    ['CONFIG', 'kind:=chair', '--devices', 'chair', 'topic:=u']])
def test_values_may_stand_anywhere(order: List[str], cell: Cell, write: Write) -> None:
    path = write(ARGUMENTS)
    code, lines, errors = cell('show', *(path if word == 'CONFIG' else word for word in order))
    assert (code, lines[-2:], errors) == (0, ['chair (other)', '  topic       /u'], [])


def test_value_may_hold_anything(cell: Cell, write: Write) -> None:
    path = write('<arg name="a"/><device type="other" name="d"><param name="p" value="$(arg a)"/>'
                 '</device>')
    assert cell('generate', path, 'a:=b:=c = "d"')[0] == 0
    assert "value='b:=c = \"d\"'" in Path('cell.launch').read_text()


def test_value_that_nobody_asks_for(cell: Cell, write: Write) -> None:
    code, _, (error,) = cell('check', write(ARGUMENTS), 'knd:=chair')
    assert code == 1
    assert error.endswith('there is no argument "knd"; did you mean "kind"?')


def test_generate(cell: Cell, write: Write, tmp_path: Path) -> None:
    assert cell('generate', write(TABLE)) == (
        0, ['./cell.launch', './cell.rviz', './configuration.json'], [])
    assert (tmp_path / 'cell.launch').is_file() and (tmp_path / 'cell.rviz').is_file()


def test_generate_elsewhere(cell: Cell, write: Write, tmp_path: Path) -> None:
    assert cell('generate', write(TABLE), '--output', 'a b/c', '--no-rviz') == (
        0, ['a b/c/cell.launch', 'a b/c/cell.rviz', 'a b/c/configuration.json'], [])
    assert 'type="rviz"' not in (tmp_path / 'a b' / 'c' / 'cell.launch').read_text()


def test_generate_over_files_of_others(cell: Cell, write: Write, tmp_path: Path) -> None:
    (tmp_path / 'cell.rviz').write_text('mine')
    code, lines, (error,) = cell('generate', write(TABLE))
    assert (code, lines) == (1, [])
    assert error == ('cell: "cell.rviz" was not generated by this program; remove it or choose '
                     'another folder')
    assert (tmp_path / 'cell.rviz').read_text() == 'mine'


def test_generate_below_a_file(cell: Cell, write: Write) -> None:
    path = write(TABLE)
    assert cell('generate', path, '--output', path) == (
        1, [], [f'cell: cannot write to "{path}": File exists; choose another folder'])


def test_generate_for_playback(cell: Cell, write: Write, tmp_path: Path) -> None:
    (tmp_path / "it's.bag").write_text('')
    assert cell('generate', write(TABLE), '--mode', 'playback', '--bag', "it's.bag")[0] == 0
    text = (tmp_path / 'cell.launch').read_text()
    assert 'mode playback' in text and 'name="bag_player"' in text and f'{tmp_path}/it' in text


@pytest.mark.parametrize('options, message', [
    (['--bag', 'a.bag'], '--bag needs --mode playback'),
    (['--mode', 'realtime', '--bag', 'a.bag'], '--bag needs --mode playback'),
    (['--mode', 'playback', '--bag', 'gone.bag'], 'there is no file "gone.bag"'),
    (['--mode', 'playback', '--bag', '.'], 'there is no file "."')])
@pytest.mark.parametrize('command', ['generate', 'run'])
def test_wrong_bag(command: str, options: List[str], message: str, cell: Cell, write: Write,
                   tmp_path: Path) -> None:
    (tmp_path / 'a.bag').write_text('')
    assert cell(command, write(TABLE), *options) == (1, [], [f'cell: {message}'])


@pytest.mark.parametrize('name', ['$(x).bag', 'a\nb.bag', 'a\udcff.bag'])
def test_bag_that_no_launch_file_can_name(name: str, cell: Cell, write: Write,
                                          tmp_path: Path) -> None:
    (tmp_path / name).write_text('')
    code, _, (error,) = cell('generate', write(TABLE), '--mode', 'playback', '--bag', name)
    assert code == 1
    assert error == (f'cell: roslaunch cannot pass on the path {str(tmp_path / name)!a}; '
                     'rename it')


@pytest.mark.parametrize('arguments', [
    [], ['nope'], ['check'], ['check', 'a.xml', '--nope'], ['check', 'a.xml', '--mode', 'realtime'],
    ['generate', 'a.xml', '--mode', 'sometimes'], ['show', 'a.xml', '--output', 'x']])
def test_usage(arguments: List[str], cell: Cell) -> None:
    code, lines, errors = cell(*arguments)
    assert (code, lines) == (2, [])
    assert errors[0].startswith('usage: cell')


def test_help(cell: Cell) -> None:
    code, lines, errors = cell('--help')
    assert (code, errors) == (0, [])
    assert all(any(word in line for line in lines) for word in ('check', 'show', 'generate', 'run'))


def test_run_without_a_folder_for_its_record(cell: Cell, write: Write, tmp_path: Path,
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'file'))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    code, _, errors = cell('run', write(TABLE), '--no-rviz', '--output', 'made')
    assert code == 1
    assert errors[-1].startswith('cell: [Errno 20] Not a directory: ')


def test_repeated_words_may_stand_between_options(cell: Cell) -> None:
    code, lines, errors = cell('record', 'a.xml', '-O', 'name', 'b.xml')
    assert (code, lines) == (1, [])
    assert errors == ['cell: one configuration is recorded at a time, not a.xml and b.xml']


def test_an_unknown_option_is_none_of_them(cell: Cell) -> None:
    code, _, errors = cell('record', 'a.xml', '--fast', '/topic')
    assert (code, errors[-1]) == (2, 'cell: error: unrecognized arguments: --fast /topic')


@pytest.mark.parametrize('words, reason', [
    (('report', 'x:=1'), 'x:=1'), (('new', 'x:=1'), 'x:=1'), (('trust', 'x:=1'), 'x:=1'),
    (('runs', 'a.bag', 'x:=1'), '"x:=1" is a value for a configuration; name its file too'),
    (('record', '/topic', 'x:=1'), '"x:=1" is a value for a configuration; name its file too')])
def test_values_that_nothing_would_use_are_refused(cell: Cell, words: Tuple[str, ...],
                                                   reason: str) -> None:
    code, lines, errors = cell(*words)
    assert (code, lines) == (1, [])
    assert reason in errors[-1]
