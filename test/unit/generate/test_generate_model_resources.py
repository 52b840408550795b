# SPDX-License-Identifier: BSD-3-Clause
"""Models in any folder, with meshes next to them; missing files in RViz are reported."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Any, List
from urllib.parse import unquote

import pytest

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate
from process_visualizer.robot.description import describe_devices

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


@pytest.fixture(autouse=True)
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed package with a mesh."""
    folder = made_package(tmp_path / 'installed' / 'known')
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder.parent), prepend=':')
    return folder


def made_package(folder: Path) -> Path:
    (folder / 'meshes').mkdir(parents=True)
    (folder / 'package.xml').write_text(f'<package><name>{folder.name}</name></package>')
    (folder / 'meshes' / 'a.stl').write_text('solid a')
    return folder


def model(*meshes: str, root: str = 'base') -> str:
    shapes = ''.join(f'<visual><geometry><mesh filename="{it}"/></geometry></visual>'
                     for it in meshes)
    return f'<robot name="r" {XACRO}><link name="{root}">{shapes}</link></robot>'


def cell(folder: Path, path: str, base: str = 'base', rest: str = '', root: str = '') -> str:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / 'cell.xml'
    file.write_text(f'<visualizer{root}><device type="other" name="arm">\n<model path="{path}"'
                    f'{rest}/>\n<base frame="{base}"/></device></visualizer>')
    return str(file)


def checked(config: str, capsys: Any) -> List[str]:
    """The problems of a configuration, by element; empty if there are none."""
    capsys.readouterr()
    status = main(['check', config])
    lines = capsys.readouterr().err.replace(f'{config}:', '').splitlines()
    assert status == (1 if lines else 0)
    return lines


def meshes(config: str) -> List[str]:
    """The meshes in RViz's display."""
    descriptions, problems = describe_devices(XmlParser().parse(config).devices)
    assert problems == []
    return re.findall('<mesh filename="(.*?)"', descriptions['arm'].text)


@pytest.mark.parametrize('path', ['robot.urdf', '$(dirname)/robot.urdf', './robot.urdf',
                                  '{folder}/robot.urdf', 'models/robot.urdf',
                                  '../models/robot.urdf', '$(dirname)/../models/robot.urdf'])
def test_a_model_may_be_anywhere(tmp_path: Path, capsys: Any, path: str) -> None:
    folder = tmp_path / 'cell'
    config = cell(folder, path.format(folder=folder))
    for place in (folder, folder / 'models', tmp_path / 'models'):
        place.mkdir(exist_ok=True)
    (folder / path.format(folder=folder).replace('$(dirname)/', '')).write_text(model())
    assert checked(config, capsys) == []


def test_the_model_of_a_package_is_in_it(tmp_path: Path, capsys: Any) -> None:
    for path in ('/a.urdf', '../a.urdf'):
        config = cell(tmp_path, path, rest=' pkg="known"')
        assert checked(config, capsys)[0] == (
            f'2: <model>: attribute "path": "{path}" must be a path below the package, such as '
            '"urdf/robot.xacro", or leave "pkg" out')


@pytest.mark.parametrize('named, place', [
    ('meshes/a.stl', 'robot/urdf/meshes/a.stl'), ('meshes/a.stl', 'robot/meshes/a.stl'),
    ('../meshes/a.stl', 'robot/meshes/a.stl'), ('file://meshes/a.stl', 'robot/meshes/a.stl'),
    ('{folder}/meshes/a.stl', 'meshes/a.stl'), ('file://{folder}/a%20b.stl', 'a b.stl'),
    ('meshes/a &amp; b.stl', 'robot/meshes/a & b.stl'),
    ('package://robot/meshes/a.stl', 'robot/meshes/a.stl'),
    ('package://others/meshes/a.stl', 'others/meshes/a.stl'),
    ('package://described/a.stl', 'robot/a.stl'),  # according to its package.xml
    ('package://known/meshes/a.stl', 'installed/known/meshes/a.stl')])
@pytest.mark.parametrize('ending', ['urdf', 'urdf.xacro'])
def test_meshes_beside_a_model(tmp_path: Path, capsys: Any, named: str, place: str,
                               ending: str) -> None:
    mesh = tmp_path / place
    mesh.parent.mkdir(parents=True, exist_ok=True)
    mesh.write_text('solid a')
    (tmp_path / 'robot' / 'urdf').mkdir(parents=True, exist_ok=True)
    if 'described' in named:
        (tmp_path / 'robot' / 'package.xml').write_text('<package><name>described</name></package>')
    (tmp_path / 'robot' / 'urdf' / f'r.{ending}').write_text(model(named.format(folder=tmp_path)))
    config = cell(tmp_path / 'cell', f'../robot/urdf/r.{ending}')
    assert checked(config, capsys) == []
    found, = meshes(config)
    is_installed = 'known' in named
    assert unquote(found).replace('&amp;', '&') == (
        named if is_installed else f'file://{mesh}')


def test_what_is_named_well_stays_as_it_is(tmp_path: Path) -> None:
    text = ('<?xml version="1.0"?>\n<!-- mine -->\n<robot  name="r">\n <link name="base"/>\n'
            '<gazebo><plugin filename="libodd.so"/></gazebo></robot>\n')
    (tmp_path / 'r.urdf').write_text(text)
    descriptions, _ = describe_devices(XmlParser().parse(cell(tmp_path, 'r.urdf')).devices)
    assert descriptions['arm'].text == text


def test_xacro_finds_packages_beside_the_file(tmp_path: Path, capsys: Any) -> None:
    folder = made_package(tmp_path / 'robot_description')
    (folder / 'parts.xacro').write_text(model('package://robot_description/meshes/a.stl'))
    (folder / 'r.xacro').write_text(f'<robot name="r" {XACRO}><xacro:include '
                                    'filename="$(find robot_description)/parts.xacro"/></robot>')
    config = cell(tmp_path / 'cell', '../robot_description/r.xacro')
    assert checked(config, capsys) == []
    assert meshes(config) == [f'file://{folder}/meshes/a.stl']


@pytest.mark.parametrize('names, told', [
    (['package://zzyzx/a.stl', 'package://zzyzx/b.stl', 'package://zzyzx/b.stl'],
     ['2 meshes of the model cannot be shown: there is no package "zzyzx"; install it or source '
      'the workspace that has it, or put its folder beside the model']),
    (['package://knwon/a.stl'],
     ['1 mesh of the model cannot be shown: there is no package "knwon"; did you mean "known"? '
      'Otherwise install it or source the workspace that has it, or put its folder beside the '
      'model']),
    (['package://known/meshes/b.stl'],
     ['a mesh of the model cannot be shown: "package://known/meshes/b.stl": there is no file '
      '"{tmp}/installed/known/meshes/b.stl"; did you mean "{tmp}/installed/known/meshes/a.stl"?']),
    (['a.stl'], ['a mesh of the model cannot be shown: "file://{tmp}/a.stl": there is no file '
                 '"{tmp}/a.stl"; check the path']),
    (['model://arm/a.stl'], ['a mesh of the model cannot be shown: "model://arm/a.stl": RViz opens '
                             'package:// and file:// only']),
    (['https://example.com/a.stl'], [])])
def test_what_rviz_will_not_find_is_told(tmp_path: Path, capsys: Any, names: List[str],
                                         told: List[str]) -> None:
    """The cell runs anyway."""
    (tmp_path / 'r.urdf').write_text(model(*names))
    config = cell(tmp_path, 'r.urdf')
    wanted = [f'2: <model>: {it.format(tmp=tmp_path)}' for it in told]
    assert checked(config, capsys) == wanted
    read = XmlParser().parse(config)
    warnings = generate(Choice(read, Mode.REALTIME, read.devices)).warnings
    assert [str(it).replace(f'{config}:', '') for it in warnings] == wanted


def test_a_few_of_many_are_named(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / 'r.urdf').write_text(model(*(f'{number}.stl' for number in range(9))))
    lines = checked(cell(tmp_path, 'r.urdf'), capsys)
    assert len(lines) == 4
    assert lines[-1] == '2: <model>: 6 more meshes of the model cannot be shown'


def test_another_link_that_is_called_like_the_global_frame(tmp_path: Path, capsys: Any) -> None:
    """The whole cell would be attached to it."""
    (tmp_path / 'r.urdf').write_text(
        '<robot name="r"><link name="base"/><link name="world"/><joint name="j" type="fixed">'
        '<parent link="base"/><child link="world"/></joint></robot>')
    assert checked(cell(tmp_path, 'r.urdf'), capsys) == [
        '2: <model>: the link "world" of the model has the name of the global frame; write '
        'prefix="arm_" in <model>, and the same before the frame in <base>, or rename the global '
        'frame: <visualizer frame="cell">']
    assert checked(cell(tmp_path, 'r.urdf', 'arm_base', ' prefix="arm_"'), capsys) == []
    assert checked(cell(tmp_path, 'r.urdf', root=' frame="cell"'), capsys) == []


def test_a_root_link_that_is_called_like_the_global_frame(tmp_path: Path, capsys: Any) -> None:
    """As in many makers' models; both suggested ways solve the problem."""
    (tmp_path / 'r.urdf').write_text(model(root='world'))
    way = ('as that is the global frame, write prefix="arm_" in <model> and frame="arm_world" in '
           '<base>, or rename the global frame: <visualizer frame="cell">')
    assert checked(cell(tmp_path, 'r.urdf', 'base_0'), capsys) == [
        '2: <model>: the base frame "base_0" is not the root link of the model, which is "world"; '
        f'{way}']
    assert checked(cell(tmp_path, 'r.urdf', 'world'), capsys) == [
        '3: <base>: "world" is the global frame; choose another name; if it is the root link of '
        f'the model, {way}']
    assert checked(cell(tmp_path, 'r.urdf', 'arm_world', ' prefix="arm_"'), capsys) == []
    assert checked(cell(tmp_path, 'r.urdf', 'world', root=' frame="cell"'), capsys) == []
    assert checked(cell(tmp_path, 'r.urdf', 'odd', root=' frame="cell"'), capsys) == [
        '2: <model>: the base frame "odd" is not the root link of the model, which is "world"; '
        'write this name in <base>']
