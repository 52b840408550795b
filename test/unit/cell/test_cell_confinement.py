# SPDX-License-Identifier: BSD-3-Clause
"""Allowed content of a configuration that is data, with packages that the user trusts."""
from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from process_visualizer.cell.confinement import confined
from process_visualizer.cell.element_reader import read_xml
from process_visualizer.cell.file_edit import without
from process_visualizer.cell.model import Cell
from process_visualizer.cell.trust import (
    Origin,
    Provenance,
    set_trusted,
    trust_file,
    trusted_packages,
)
from process_visualizer.cell.values import plain_yaml
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main

TEXT = '''<visualizer>
  <machine name="pc" address="pc"/>
  <device type="other" name="machine" machine="pc">
    <node pkg="sewing_cell" type="sewing_machine.py" name="n" args="--é" launch-prefix='a "b">'>
      <param name="mesh" value="x"/>
      <rosparam>center: [1, 2]</rosparam>
      <env name="A" value="b"/>
    </node>
    <launch pkg="sewing_cell" type="a.launch"><arg name="prefix" value="sh"/></launch>
    <node pkg="tf" type="static_transform_publisher" name="m"/>
    <topic name="feed"/>
  </device>
</visualizer>
'''


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / 'cell.xml'
    found.write_text(TEXT, encoding='utf-8')
    return found


def parsed(path: Path, *packages: str) -> Cell:
    provenance = Provenance(Origin.BAG, str(path.parent), frozenset(packages))
    return XmlParser(provenance=provenance).parse(str(path))


def test_a_file_on_the_disk_says_what_it_wants(path: Path) -> None:
    cell = XmlParser().parse(str(path))
    assert [it.name for it in cell.devices[0].nodes] == ['n', 'm']
    assert cell.ignored == ()


def test_nothing_starts_without_trust(path: Path) -> None:
    cell = parsed(path)
    assert cell.devices[0].nodes == () and cell.devices[0].launch_files == ()
    assert [str(it) for it in cell.ignored][-1] == (
        f'{path}:10: <node>: is ignored in a recording: its package tf is not trusted; '
        '"rosrun process_visualizer cell trust tf" trusts it')


def test_a_trusted_package_starts_without_what_changes_it(path: Path) -> None:
    cell = parsed(path, 'sewing_cell')
    node, = cell.devices[0].nodes
    assert dict(node.attributes) == {'output': 'screen'}
    assert [it.tag for it in node.children] == ['param', 'rosparam']
    assert cell.devices[0].launch_files[0].arguments == ()
    assert [it.location.line for it in cell.ignored] == [2, 3, 4, 4, 7, 9, 10]


@pytest.mark.parametrize(('parameter', 'reason'), [
    ('<param name="a" command="sh"/>', '"command" would run a program or read a file'),
    ('<param name="a" textfile="/etc/passwd"/>', '"textfile" would run a program or read a file'),
    ('<param name="a" type="yaml" value="[1]"/>', 'its YAML is more than plain values'),
    ('<rosparam file="/etc/passwd"/>', '"file" would read or write a file'),
    ('<rosparam subst_value="true">a: 1</rosparam>', 'its YAML is more than plain values'),
    ('<param name="a" type="$(arg yaml)" value="[1]"/>', 'its YAML is more than plain values'),
    ('<param name="$(arg slash)a" value="1"/>', 'outside of the namespace of its device'),
    ('<rosparam ns="$(arg slash)a">b: 1</rosparam>', 'outside of the namespace of its device'),
    ('<rosparam param="$(arg slash)a">1</rosparam>', 'outside of the namespace of its device'),
    ('<rosparam param="~a">1</rosparam>', 'outside of the namespace of its device'),
    ('<rosparam>{a: {b: {/c: 1}}}</rosparam>', 'outside of the namespace of its device'),
    ('<rosparam>a: [</rosparam>', 'its YAML cannot be read'),
    ('<param name="robot_description" value="&lt;robot/&gt;"/>', 'a robot description in it'),
    ('<param name="a" value="$(arg less)robot/>"/>', 'a robot description in it'),
    ('<rosparam>a: [1, {b: "\\x3Crobot/\\x3E"}]</rosparam>', 'a robot description in it'),
    ('<param name="$(arg nothing)" value="1"/>', 'its arguments have no usable values')])
def test_a_parameter_of_data_is_a_plain_value(tmp_path: Path, parameter: str, reason: str
                                              ) -> None:
    path = tmp_path / 'cell.xml'
    path.write_text('<visualizer><arg name="slash" default="/"/><arg name="yaml" value="yaml"/>'
                    '<arg name="less" default="&lt;"/>'
                    '<device type="other" name="m"><node pkg="sewing_cell" '
                    f'type="sewing_machine.py" name="n">{parameter}<param name="b" value="c"/>'
                    '</node></device></visualizer>', encoding='utf-8')
    cell = parsed(path, 'sewing_cell')
    assert [it.attributes['name'] for it in cell.devices[0].nodes[0].children] == ['b']
    assert len(cell.ignored) == 1 and reason in str(cell.ignored[0])


def test_a_display_of_data_takes_no_endless_memory(tmp_path: Path) -> None:
    """RViz creates as many lines, or keeps as many messages, as a display asks for."""
    path = tmp_path / 'cell.xml'
    path.write_text('<visualizer><device type="other" name="m"><rviz type="Group">'
                    '<rviz type="Grid"><property name="Plane Cell Count" value="1e9"/>'
                    '<property name="Offset"><property name="Length" value="2000"/>'
                    '<property name="X" value="1"/></property>'
                    '<property name="Cell Size" value="1e9"/></rviz>'
                    '<rviz type="Path" topic="p"><property name="Buffer Length" value="5"/></rviz>'
                    '</rviz></device></visualizer>', encoding='utf-8')
    cell = parsed(path)
    grid, shown_path = cell.devices[0].displays[0].children
    assert [it.name for it in grid.properties] == ['Offset', 'Cell Size']
    assert [it.name for it in grid.properties[0].children] == ['X']
    assert [it.value for it in shown_path.properties] == ['5']
    assert [str(it).split(': ', 2)[2] for it in cell.ignored] == [
        f'is ignored in a recording: "{name}" may be at most 1000; write it into a configuration '
        'of your own, and name that with --config' for name in ('Plane Cell Count', 'Length')]
    assert len(XmlParser().parse(str(path)).devices[0].displays[0].children[0].properties) == 3


def test_the_text_without_it_says_what_stood_there(path: Path) -> None:
    provenance = Provenance(Origin.BAG, str(path.parent), frozenset(['sewing_cell']))
    found = confined(read_xml(str(path)), provenance, {})
    path.write_bytes(without(path.read_bytes(), found.removals))
    text = path.read_text(encoding='utf-8')
    assert '<node pkg="sewing_cell" type="sewing_machine.py" name="n">' in text
    assert '<!-- left out, as it was in a recording: <node pkg="tf" type="static' in text
    assert confined(read_xml(str(path)), provenance, {}).ignored == ()
    XmlParser().parse(str(path))


def test_packages_are_trusted_by_a_list(path: Path, tmp_path: Path,
                                        monkeypatch: pytest.MonkeyPatch,
                                        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv('XDG_CONFIG_HOME', str(tmp_path / 'config'))
    assert main(['trust']) == 0 and trusted_packages() == frozenset()
    assert trust_file() in capsys.readouterr().err
    assert main(['trust', 'sewing_cell', 'rviz']) == 0
    assert capsys.readouterr().out.split() == ['rviz', 'sewing_cell']
    assert main(['trust', 'sewing_sell']) == 1
    assert 'did you mean "sewing_cell"' in capsys.readouterr().err
    assert main(['trust', '--remove', 'rviz']) == 0
    assert trusted_packages() == {'sewing_cell'}
    with pytest.raises(ValueError, match='not a valid package name'):
        set_trusted('a b', True)


@pytest.mark.parametrize(('text', 'value'), [
    ('deg(90)', math.pi / 2), ('rad(2*pi - 1)', 2 * math.pi - 1), ('!degrees 180', math.pi),
    ('!radians -pi/4', -math.pi / 4), ('rad', 'rad')])
def test_angles_are_calculated(text: str, value: object) -> None:
    assert plain_yaml(f'a: {text}') == {'a': pytest.approx(value)
                                        if isinstance(value, float) else value}


@pytest.mark.parametrize('text', ['rad(1/0)', '!radians open("x")', '!radians pi.real',
                                  'rad(9**9)', '!degrees x', f'!radians {"-" * 300}1'])
def test_what_is_no_angle_is_refused(text: str) -> None:
    with pytest.raises((ValueError, yaml.YAMLError)):
        plain_yaml(f'a: {text}')


def test_a_configuration_that_is_checked_runs_nothing(tmp_path: Path) -> None:
    config, canary = tmp_path / 'cell.xml', tmp_path / 'canary'
    config.write_text('<visualizer><device type="other" name="a"><rosparam>x: !radians '
                      'open("canary", "w")</rosparam></device></visualizer>')
    done = subprocess.run(
        [sys.executable, '-c', 'import sys; from process_visualizer.commands.command_line import '
         'main; sys.exit(main())', 'check', str(config)], stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1 and 'is not an angle' in done.stdout
    assert not canary.exists()
