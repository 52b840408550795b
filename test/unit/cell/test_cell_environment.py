# SPDX-License-Identifier: BSD-3-Clause
"""Requirements of a cell that this computer does not meet."""
import os
from pathlib import Path
from typing import Callable, List, Optional

import pytest

from process_visualizer.cell.environment import check_environment, find_launch_file
from process_visualizer.cell.model import Cell, Mode

Check = Callable[..., List[str]]


def executable(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text('#!/bin/sh\n')
    path.chmod(0o755)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package "my_cell", found through ROS_PACKAGE_PATH."""
    folder = tmp_path / 'packages' / 'my_cell'
    for name in ('launch', 'urdf', 'nodes'):
        (folder / name).mkdir(parents=True)
    (folder / 'package.xml').write_text('<package><name>my_cell</name></package>')
    (folder / 'launch' / 'camera.launch').write_text('<launch/>')
    (folder / 'top.launch').write_text('<launch/>')
    (folder / 'urdf' / 'arm.urdf').write_text('<robot name="arm"/>')
    (folder / 'nodes' / 'source.py').write_text('')
    executable(folder / 'nodes' / 'driver')
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder.parent))
    return folder


@pytest.fixture
def check(parse: Callable[..., Cell], package: Path, tmp_path: Path) -> Check:
    """The problems of a device "d" with the elements, which are in line 2."""
    def find(elements: str, mode: Optional[Mode] = None) -> List[str]:
        cell = parse('<visualizer><machine name="m" address="h"/><device type="robot" name="d">\n'
                     f'{elements}</device></visualizer>')
        found = [str(problem) for problem in check_environment(cell, mode)]
        return [line.replace(f'{tmp_path}/', '') for line in found]
    return find


def test_everything_is_there(check: Check, package: Path) -> None:
    assert check('<model pkg="my_cell" path="urdf/arm.urdf"/>'
                 '<node pkg="my_cell" type="driver" name="n"/>'
                 '<launch pkg="my_cell" type="camera.launch"/>'
                 '<launch pkg="my_cell" type="top.launch"/>'
                 f'<rosparam file="{package}/package.xml"/>') == []


@pytest.mark.parametrize('element', [
    '<model pkg="my_cel" path="a.urdf"/>', '<node pkg="my_cel" type="a" name="b"/>',
    '<launch pkg="my_cel" type="a.launch"/>'])
def test_missing_package(check: Check, element: str) -> None:
    tag = element[1:].split()[0]
    assert check(element) == [
        f'cell.xml:2: <{tag}>: there is no package "my_cel"; did you mean "my_cell"? Otherwise '
        'install it or source the workspace that has it']


def test_missing_model(check: Check) -> None:
    assert check('<model pkg="my_cell" path="urdf/arms.urdf"/>') == [
        'cell.xml:2: <model>: there is no file "packages/my_cell/urdf/arms.urdf"; did you mean '
        '"packages/my_cell/urdf/arm.urdf"?']


def test_missing_folder_of_a_model(check: Check) -> None:
    assert check('<model pkg="my_cell" path="models/arm.urdf"/>') == [
        'cell.xml:2: <model>: there is no file "packages/my_cell/models/arm.urdf", nor its '
        'folder; check the path']


def test_missing_launch_file(check: Check) -> None:
    assert check('<launch pkg="my_cell" type="camra.launch"/>') == [
        'cell.xml:2: <launch>: there is no file "packages/my_cell/launch/camra.launch"; did you '
        'mean "packages/my_cell/launch/camera.launch"?']


@pytest.mark.parametrize('name, advice', [
    ('drivr', 'did you mean "driver"? Otherwise build'), ('zzqx', 'build'),
    ('source.py', 'build')])
def test_missing_executable(check: Check, name: str, advice: str) -> None:
    """A source file that was not built yet does not count as one."""
    assert check(f'<node pkg="my_cell" type="{name}" name="n"/>') == [
        f'cell.xml:2: <node>: the package "my_cell" has no executable "{name}"; {advice} its '
        'workspace (catkin_make) and source it']


def test_missing_parameter_files(check: Check) -> None:
    lines = check('<rosparam file="/no/a.yaml"/>\n<rosparam command="dump" file="/no/b.yaml"/>\n'
                  '<param name="a" textfile="/no/c.txt"/>\n'
                  '<node pkg="my_cell" type="driver" name="n"><param name="x" binfile="/no/d"/>'
                  '</node>')
    assert [line.split(', nor')[0] for line in lines] == [
        'cell.xml:2: <rosparam>: there is no file "/no/a.yaml"',
        'cell.xml:4: <param>: there is no file "/no/c.txt"',
        'cell.xml:5: <param>: there is no file "/no/d"']


def test_problems_are_in_the_order_of_the_file(check: Check) -> None:
    lines = check('<launch pkg="a1" type="a"/>\n<node pkg="a2" type="a" name="a"/>\n'
                  '<model pkg="a3" path="a.urdf"/>')
    assert [line.split(': ')[0] for line in lines] == ['cell.xml:2', 'cell.xml:3', 'cell.xml:4']


def test_only_what_starts_in_the_mode(check: Check) -> None:
    elements = ('<node pkg="a" type="a" name="a" ifstate="realtime"/>\n'
                '<launch pkg="a" type="a" ifstate="playback"/>')
    assert len(check(elements)) == 2
    assert '<node>' in check(elements, Mode.REALTIME)[0]
    assert '<launch>' in check(elements, Mode.PLAYBACK)[0]


def test_nodes_on_other_machines_are_not_looked_for(check: Check) -> None:
    assert check('<node pkg="a" type="a" name="a" machine="m"/>') == []


def test_nodes_of_a_device_on_another_machine_are_looked_for_in_playback_only(
        parse: Callable[..., Cell], package: Path) -> None:
    cell = parse('<visualizer><machine name="m" address="h"/>'
                 '<device type="other" name="d" machine="m">\n'
                 '<node pkg="other_a" type="a" name="a"/>\n'
                 '<node pkg="other_b" type="b" name="b" ifstate="realtime"/>\n'
                 '<node pkg="other_c" type="c" name="c" ifstate="playback"/></device></visualizer>')
    assert [it.location.line for it in check_environment(cell)] == [4]
    assert check_environment(cell, Mode.REALTIME) == []
    assert [it.location.line for it in check_environment(cell, Mode.PLAYBACK)] == [2, 4]


def test_files_for_parameters_are_read_here_for_other_machines_too(check: Check) -> None:
    problem, = check('<node pkg="a" type="a" name="a" machine="m"><rosparam file="/none/a"/>'
                     '</node>')
    assert 'there is no file "/none/a"' in problem


def test_only_chosen_devices(parse: Callable[..., Cell], package: Path) -> None:
    cell = parse('<visualizer>'
                 '<device type="other" name="a"><launch pkg="x1" type="a"/></device>'
                 '<device type="other" name="b"><launch pkg="x2" type="a"/></device></visualizer>')
    assert len(check_environment(cell)) == 2
    assert '"x2"' in check_environment(cell, devices=['b'])[0].message
    with pytest.raises(KeyError):
        check_environment(cell, devices=['c'])


def test_the_launch_folder_comes_first(package: Path) -> None:
    executable(package / 'camera.launch')
    assert find_launch_file(str(package), 'camera.launch') == os.path.join(
        package, 'launch', 'camera.launch')
    assert find_launch_file(str(package), 'no.launch') is None


def test_model_beside_the_configuration(check: Check, tmp_path: Path) -> None:
    assert check('<model path="models/arm.urdf"/>') == [
        'cell.xml:2: <model>: there is no file "models/arm.urdf", nor its folder; check the path']
    (tmp_path / 'models').mkdir()
    (tmp_path / 'models' / 'arm.urdf').write_text('<robot name="arm"/>')
    assert check('<model path="models/arm.urdf"/>') == []
