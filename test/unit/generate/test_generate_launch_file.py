# SPDX-License-Identifier: BSD-3-Clause
"""The generated launch file, as roslaunch's own loader reads it."""
from __future__ import annotations

import shlex
from pathlib import Path
from typing import Callable
from xml.sax.saxutils import quoteattr

import pytest
from launch_cells import HERE, device, launch_text, loaded, one_node
from launch_loading import load_text, node_names, nodes, parameters
from roslaunch.config import ROSLaunchConfig

from process_visualizer.cell.model import Cell, Device, DeviceType, Mode, Topic
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.launch_file import LaunchFileBuilder, recorded_topics, urdf_file
from process_visualizer.generate.plan import PlanError, generated_notice

Build = Callable[..., ROSLaunchConfig]
NASTY = '<&>"\' ]]> \t ä €'

def test_what_a_user_sets_wins_over_what_is_generated(build: Build) -> None:
    config = build('<device type="robot" name="d"><rosparam ns="robot_proc">'
                   '{tool_frame: mine, arrows: {force: {max: 2.0}}}</rosparam>'
                   '<arrow quantity="force" max="1" min="0.5"/></device>')
    assert parameters(config, '/d/robot_proc') == {
        'base_frame': 'd/link0', 'tool_frame': 'mine', 'arrows/force/max': 2.0,
        'arrows/force/min': 0.5}


def test_program_parts_of_an_empty_cell(build: Build) -> None:
    config = build(device(''))
    assert node_names(config) == ['/cell_frames', '/scene_watch', '/view_relay']
    assert parameters(config) == {'cell_frames/frames': [], 'scene_watch/devices': [],
                                  'scene_watch/frame': 'world'}


@pytest.mark.parametrize('mode, bag', [(Mode.REALTIME, None), (Mode.PLAYBACK, '/a.bag')])
def test_what_records_or_plays_begins_at_the_rate_of_1(mode: Mode, bag: 'str | None',
                                                       build: Build) -> None:
    """The last player may have left another rate."""
    config = build(device(TOPICS), mode=mode, bag=bag)
    assert parameters(config)['process_visualizer/playback_rate'] == 1.0


def test_machine(build: Build) -> None:
    config = build('<machine name="far" address="pc &amp; co" env-loader="/opt/e.sh" user="u" '
                   'timeout="5" ssh-port="2222" default="never"/>'
                   + device('<node pkg="a" type="b" name="n" machine="far"/>'))
    far = config.machines['far']
    assert (far.address, far.env_loader, far.user, far.password, far.timeout, far.ssh_port,
            far.assignable) == ('pc & co', '/opt/e.sh', 'u', None, 5.0, 2222, False)
    assert one_node(config).machine_name == 'far'
    assert one_node(config, '/cell_frames').machine_name is None


@pytest.mark.parametrize('mode, bag, machine', [
    (Mode.REALTIME, None, 'far'), (Mode.PLAYBACK, '/a.bag', None)])
def test_the_nodes_of_a_device_run_on_its_machine_while_it_is_live(
        mode: Mode, bag: 'str | None', machine: 'str | None', build: Build) -> None:
    """Only this computer shows a recording: the other one may be off."""
    config = build(
        '<machine name="far" address="pc" env-loader="/e"/><machine name="b" address="b" '
        'env-loader="/e"/><device type="depth_sensor" name="s" machine="far">'
        '<base frame="s_base"/><topic name="points" type="pointcloud"/>'
        '<roi size="1 1 1"/><node pkg="a" type="b" name="own"/>'
        '<node pkg="a" type="b" name="elsewhere" machine="b"/></device>', mode=mode, bag=bag)
    machines = {node.namespace + node.name: node.machine_name for node in config.nodes}
    assert {name: found for name, found in machines.items() if name.startswith('/s/')} == {
        '/s/depth_proc': machine, '/s/roi_filter': machine, '/s/own': machine,
        '/s/elsewhere': 'b'}
    assert machines['/cell_frames'] is None and machines['/scene_watch'] is None


def test_every_attribute_of_a_node(build: Build) -> None:
    node = one_node(build(device(
        '<node pkg="a" type="b.py" name="n" args="-x \'a  b\'" output="log" respawn="true" '
        'respawn_delay="2.5" launch-prefix="nice -n 5" cwd="node" clear_params="true"/>')))
    assert (node.package, node.type, node.args, node.output, node.respawn, node.respawn_delay,
            node.launch_prefix, node.cwd, node.required) == (
                'a', 'b.py', "-x 'a  b'", 'log', True, 2.5, 'nice -n 5', 'node', False)


def test_defaults_of_a_node(build: Build) -> None:
    node = one_node(build(device('<node pkg="a" type="b" name="n"/>')))
    assert (node.args, node.output, node.respawn, node.required, node.launch_prefix, node.cwd,
            node.machine_name) == ('', 'screen', False, False, None, None, None)


def test_cleared_parameters(build: Build) -> None:
    """Also those of the watch: its observations in another run do not apply to this one."""
    config = build(device('<node pkg="a" type="b" name="n" clear_params="1"/>'))
    assert sorted(config.clear_params) == ['/d/n/', '/scene_watch/', '/view_relay/']


@pytest.mark.parametrize('text, value', [
    ('1', True), ('0', False), ('TRUE', True), ('False', False)])
def test_every_way_to_write_a_truth_value(text: str, value: bool, build: Build) -> None:
    """The configuration accepts 1 and 0, roslaunch does not."""
    config = build(device(f'<node pkg="a" type="b" name="n" required="{text}"/>'
                          f'<node pkg="a" type="b" name="m" respawn="{text}"/>'
                          f'<rosparam subst_value="{text}">a: b</rosparam>'))
    assert one_node(config).required is value
    assert one_node(config, '/d/m').respawn is value


@pytest.mark.parametrize('namespace, name', [
    ('', '/n'), ('/', '/n'), ('other', '/other/n'), ('/a/b', '/a/b/n'), ('a/b/', '/a/b/n'),
    ('d', '/d/n'), ('/d', '/d/n')])
def test_namespace(namespace: str, name: str, build: Build) -> None:
    config = build(device(f'<node pkg="a" type="b" name="n" ns="{namespace}">'
                          '<param name="p" value="1"/></node>'))
    assert node_names(config) == sorted(['/cell_frames', '/scene_watch', '/view_relay', name])
    assert config.params[f'{name}/p'].value == 1


@pytest.mark.parametrize('mode, expected', [
    (Mode.REALTIME, ['/cell_frames', '/d/always', '/d/live', '/scene_watch', '/view_relay']),
    (Mode.PLAYBACK, ['/cell_frames', '/d/always', '/d/old', '/scene_watch', '/view_relay'])])
def test_ifstate(mode: Mode, expected: 'list[str]', build: Build) -> None:
    config = build(device('<node pkg="a" type="b" name="always"/>'
                          '<node pkg="a" type="b" name="live" ifstate="realtime"/>'
                          '<node pkg="a" type="b" name="old" ifstate="playback"/>'), mode=mode)
    assert node_names(config) == expected


def test_parameters_of_device_and_node(build: Build, tmp_path: Path) -> None:
    (tmp_path / 'text.txt').write_text('from a file')
    found = parameters(build(device(
        '<param name="whole" value="3"/><param name="real" value="3.0"/>'
        '<param name="word" value="3" type="str"/><param name="yes" value="1" type="bool"/>'
        '<param name="list" value="[1, 2]" type="yaml"/><param name="/global" value="x"/>'
        f'<param name="file" textfile="{tmp_path}/text.txt"/>'
        '<param name="command" command="echo said"/>'
        '<node pkg="a" type="b" name="n"><param name="p" value="q"/><param name="~r" value="2"/>'
        '</node>')))
    assert found.pop('global') == 'x'
    found = {name[2:]: value for name, value in found.items() if name.startswith('d/')}
    assert found == {'whole': 3, 'real': 3.0, 'word': '3', 'yes': True, 'list': [1, 2],
                     'file': 'from a file', 'command': 'said\n', 'n/p': 'q', 'n/r': 2}


def test_rosparam_keeps_its_structure(build: Build) -> None:
    found = parameters(build(device('''
      <rosparam>
        a:
          b: 1
          c: [1, 2,
              3]

        text: |
          first
            indented

          last
      </rosparam>
      <node pkg="a" type="b" name="n"><rosparam param="only">5</rosparam>
        <rosparam ns="x/y">z: "&lt;&amp;&gt;"</rosparam></node>''')), '/d')
    assert found == {'a/b': 1, 'a/c': [1, 2, 3], 'text': 'first\n  indented\n\nlast\n',
                     'n/only': 5, 'n/x/y/z': '<&>'}


def test_rosparam_with_substitution(parse: Callable[[str], Cell], tmp_path: Path) -> None:
    cell = parse('<arg name="rate" default="25"/>' + device(
        '<rosparam subst_value="True">rate: $(arg rate)\nhere: $(dirname)</rosparam>'
        '<rosparam>text: "$(arg unknown)"</rosparam>'))
    assert parameters(loaded(cell), '/d') == {
        'rate': 25, 'here': str(tmp_path), 'text': '$(arg unknown)'}


def test_rosparam_from_a_file(build: Build, tmp_path: Path) -> None:
    path = tmp_path / "it's <here>.yaml"
    path.write_text('a: {b: 1}')
    assert parameters(build(device(f'<rosparam file={quoteattr(str(path))} ns="x"/>')), '/d') == {
        'x/a/b': 1}


def test_rosparam_commands(build: Build) -> None:
    config = build(device('<rosparam command="delete" param="old"/>'
                          '<rosparam command="dump" file="/tmp/x.yaml"/>'))
    assert [tuple(it.args) for it in config.executables] == [
        ('delete', '/d/old'), ('dump', '/tmp/x.yaml', '/d/')]


def test_remap_and_environment(build: Build) -> None:
    node = one_node(build(device(
        '<node pkg="a" type="b" name="n"><remap from="~in" to="/out"/><remap from="x" to="y/z"/>'
        f'<env name="E" value={quoteattr(NASTY)}/></node>')))
    assert [tuple(pair) for pair in node.remap_args] == [('~in', '/out'), ('x', 'y/z')]
    assert [tuple(pair) for pair in node.env_args] == [('E', NASTY)]


def test_include_with_arguments(parse: Callable[[str], Cell], tmp_path: Path) -> None:
    path = tmp_path / "driver's <file>.launch"
    path.write_text('<launch><arg name="a"/><arg name="b" default="0"/>'
                    '<param name="a" value="$(arg a)"/><param name="b" value="$(arg b)"/></launch>')
    cell = parse(device('<launch pkg="p" type="f.launch">'
                        f'<arg name="a" value={quoteattr(NASTY)}/></launch>'))
    (launch_file,) = cell.devices[0].launch_files
    found = parameters(loaded(cell, included={launch_file: str(path)}))
    assert (found['a'], found['b']) == (NASTY.strip(), 0)


def test_unusable_launch_file_is_a_comment(parse: Callable[[str], Cell]) -> None:
    cell = parse(device('<launch pkg="p" type="f--g.launch"/>'))
    text = launch_text(cell)
    assert '<!-- left out, cannot be loaded: p f- -g.launch (' in text
    assert node_names(loaded(cell)) == ['/cell_frames', '/scene_watch', '/view_relay']


def test_launch_file_of_the_other_mode_is_not_mentioned(parse: Callable[[str], Cell]) -> None:
    cell = parse(device('<launch pkg="p" type="f.launch" ifstate="playback"/>'))
    assert 'f.launch' not in launch_text(cell)


def test_comments_tell_where_the_parts_come_from(parse: Callable[[str], Cell]) -> None:
    text = launch_text(parse('\n\n' + device('<node pkg="a" type="b" name="n"/>')))
    assert '<!-- d (other), from ' in text and 'cell.xml:3 -->' in text
    assert 'mode realtime' in text.splitlines()[3]


def test_notice_marks_a_file_as_ours() -> None:
    assert generated_notice('a.xml', 'playback').startswith('Generated by process_visualizer from')


TOPICS = '<topic ns="d" name="q"/><topic name="secret" record="False"/><topic name="p"/>'


@pytest.mark.parametrize('bag', [
    '/a/b.bag', '/a b/c  d.bag', "/it's/a.bag", '/say "x"/a.bag', '/a\\b.bag', '/ä/<&>;|*?.bag',
    '/-x --topics.bag', '/a$b/$HOME.bag', '/tab\there.bag', '/#.bag'])
def test_bag_player(bag: str, build: Build) -> None:
    config = build(device(TOPICS), mode=Mode.PLAYBACK, bag=bag)
    player = one_node(config, '/bag_player')
    assert (player.package, player.type) == ('process_visualizer', 'bag_player')
    assert shlex.split(player.args) == [bag, '--keep-alive', '--quiet', '--others', 'pause',
                                        '--topics', '/d/q', '/p']


@pytest.mark.parametrize('bag', ['/$(eval 1).bag', "/it's $(env HOME).bag", '/a:=b.bag'])
def test_a_bag_whose_path_roslaunch_would_read_is_refused(bag: str, build: Build) -> None:
    for bags in ((bag,), ('/a.bag', bag)):
        with pytest.raises(PlanError, match='cannot pass on the path'):
            build(device(TOPICS), mode=Mode.PLAYBACK, bag=bags[0], further_bags=bags[1:])


def test_bag_player_of_a_split_recording(build: Build) -> None:
    config = build(device(TOPICS), mode=Mode.PLAYBACK, bag='/a 0.bag',
                   further_bags=('/a 1.bag', '/a 2.bag'))
    assert shlex.split(one_node(config, '/bag_player').args)[:4] == [
        '/a 0.bag', '/a 1.bag', '/a 2.bag', '--keep-alive']


def test_a_replay_begins_paused_and_has_no_ghost(build: Build) -> None:
    config = build(device(TOPICS), mode=Mode.PLAYBACK, bag='/a.bag', is_replay=True)
    assert '--pause' in shlex.split(one_node(config, '/bag_player').args)
    assert '/ghost' not in nodes(config)


@pytest.mark.parametrize('mode, bag', [(Mode.REALTIME, '/a.bag'), (Mode.PLAYBACK, None)])
def test_no_bag_player(mode: Mode, bag: 'str | None', build: Build) -> None:
    assert '/bag_player' not in nodes(build(device(TOPICS), mode=mode, bag=bag))


def test_recorder(build: Build) -> None:
    config = build(device(TOPICS))
    recorder = one_node(config, '/bag_recorder')
    assert (recorder.package, recorder.type) == ('process_visualizer', 'bag_recorder')
    assert parameters(config, '/bag_recorder')['topics'] == ['/d/q', '/p']
    assert 'folder' not in parameters(config, '/bag_recorder')


def test_the_recorder_may_use_the_folder_that_the_operator_has_chosen(build: Build) -> None:
    config = build(device(TOPICS), bag_folder='/data/bags')
    assert parameters(config, '/bag_recorder')['folder'] == '/data/bags'


@pytest.mark.parametrize('mode, topics', [
    (Mode.PLAYBACK, TOPICS), (Mode.REALTIME, '<topic name="secret" record="False"/>')])
def test_no_recorder(mode: Mode, topics: str, build: Build) -> None:
    assert '/bag_recorder' not in nodes(build(device(topics), mode=mode, bag='/a'))


def test_nothing_to_play(build: Build) -> None:
    """The player would refuse --topics without any topic."""
    config = build(device('<topic name="secret" record="False"/>'), mode=Mode.PLAYBACK, bag='/a')
    assert '/bag_player' not in nodes(config)


def test_recorded_topics_are_named_once() -> None:
    def topic(name: str, record: bool = True) -> Topic:
        return Topic(name, None, None, record, HERE)
    devices = [Device(DeviceType.OTHER, 'a', HERE, topics=(topic('/x'), topic('/y', False))),
               Device(DeviceType.OTHER, 'b', HERE, topics=(topic('/x'), topic('/z')))]
    assert recorded_topics(devices) == ['/x', '/z']


@pytest.mark.parametrize('start, required', [
    (RvizStart.OPTIONAL, False), (RvizStart.REQUIRED, True)])
def test_rviz(start: RvizStart, required: bool, build: Build, tmp_path: Path) -> None:
    node = one_node(build(device(''), rviz=start), '/rviz')
    assert node.required is required
    assert shlex.split(node.args) == ['-d', str(tmp_path / 'cell.rviz'), '-s', '']
    assert [tuple(pair) for pair in node.env_args] == [('DISABLE_ROS1_EOL_WARNINGS', '1')]


def test_no_rviz(build: Build) -> None:
    assert '/rviz' not in nodes(build(device(''), rviz=RvizStart.NONE))


def test_rviz_in_a_folder_with_spaces(parse: Callable[[str], Cell], tmp_path: Path) -> None:
    folder = tmp_path / "my cell's  files"
    folder.mkdir()
    cell = parse(device(''))
    text = LaunchFileBuilder(Choice(cell, Mode.REALTIME, cell.devices), {}, {}).text()
    assert shlex.split(one_node(load_text(text, folder), '/rviz').args) == [
        '-d', str(folder / 'cell.rviz'), '-s', '']


def test_name_of_a_model() -> None:
    assert urdf_file(Device(DeviceType.ROBOT, 'arm', HERE)) == 'arm.urdf'
