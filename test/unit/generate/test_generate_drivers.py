# SPDX-License-Identifier: BSD-3-Clause
"""Launch files of devices: missing ones are warnings, and the rest starts."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict, List, Tuple

import pytest

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import inspect_launch_files

Parse = Callable[[str], Cell]
Inspect = Callable[..., Tuple[List[str], List[str]]]


@pytest.fixture
def inspect(parse: Parse, package: Path, tmp_path: Path) -> Inspect:
    """Usable launch files, and warnings without their beginning, for a text in d.launch."""
    def look(text: str, inner: str = '', mode: Mode = Mode.REALTIME) -> Tuple[List[str], List[str]]:
        (package / 'launch' / 'd.launch').write_text(text, encoding='utf-8')
        cell = parse(f'<device type="other" name="d"><launch pkg="my_cell" type="d.launch">{inner}'
                     '</launch></device>')
        found = inspect_launch_files(Choice(cell, mode, cell.devices))
        begin = f'{tmp_path}/cell.xml:1: <launch>: device "d": '
        assert all(str(warning).startswith(begin) for warning in found.warnings)
        return list(found.paths.values()), [
            str(warning)[len(begin):].replace(f'{package}/', '') for warning in found.warnings]
    return look


def launch(content: str) -> str:
    return f'<launch>{content}</launch>'


def test_sound_file(inspect: Inspect, package: Path) -> None:
    assert inspect(launch('<arg name="a" default="1"/><param name="p" value="$(arg a)"/>'
                          '<node pkg="rosout" type="rosout" name="n"/>')) == (
        [str(package / 'launch' / 'd.launch')], [])


@pytest.mark.parametrize('mode', Mode)
def test_sewing_cell_without_drivers_has_no_warnings(mode: Mode, parse: Parse) -> None:
    cell = parse('<device type="other" name="d"><launch pkg="sewing_cell" type="openni_play.launch"'
                 '/></device>')
    found = inspect_launch_files(Choice(cell, mode, cell.devices))
    assert found.warnings == [] and len(found.paths) == 1


def test_file_in_the_package_itself(inspect: Inspect, package: Path, parse: Parse) -> None:
    (package / 'top.launch').write_text('<launch/>')
    cell = parse('<device type="other" name="d"><launch pkg="my_cell" type="top.launch"/></device>')
    found = inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices))
    assert list(found.paths.values()) == [str(package / 'top.launch')]


MISSING: Dict[str, Tuple[str, str]] = {
    'package': ('<node pkg="nope" type="a" name="n" ns="x"/>',
                'the node /x/n needs the package "nope", which is not installed'),
    'executable': ('<node pkg="rosout" type="nope" name="n"/>',
                   'the package "rosout" has no node "nope"'),
    'package of a loaded nodelet': (
        '<node pkg="nodelet" type="nodelet" name="n" args="load nope/A manager"/>',
        'the node /n needs the package "nope", which is not installed'),
    'package of a nodelet of its own': (
        '<node pkg="nodelet" type="nodelet" name="n" args="standalone nope/A --x"/>',
        'the node /n needs the package "nope", which is not installed'),
}


@pytest.mark.parametrize('element, message', MISSING.values(), ids=MISSING)
def test_missing_for_a_node(element: str, message: str, inspect: Inspect, package: Path) -> None:
    """The file is kept: its other nodes start."""
    paths, warnings = inspect(launch(element + '<node pkg="rosout" type="rosout" name="other"/>'))
    assert paths == [str(package / 'launch' / 'd.launch')]
    assert warnings == [f'd.launch: {message}; the device starts without it']


@pytest.mark.parametrize('element', [
    '<node pkg="nodelet" type="nodelet" name="n" args="manager"/>',
    '<node pkg="nodelet" type="nodelet" name="n" args="load A manager"/>',
    '<node pkg="nodelet" type="nodelet" name="n" args="unload nope/A manager"/>',
    '<node pkg="rosout" type="rosout" name="n" args="load nope/A"/>'])
def test_no_nodelet_to_look_for(element: str, inspect: Inspect) -> None:
    assert inspect(launch(element))[1] == []


def test_nodes_on_other_computers_are_not_looked_for(inspect: Inspect) -> None:
    assert inspect(launch('<machine name="m" address="a"/>'
                          '<node pkg="nope" type="a" name="n" machine="m"/>'))[1] == []


def test_each_thing_is_said_once(inspect: Inspect) -> None:
    assert len(inspect(launch('<node pkg="rosout" type="nope" name="a"/>'
                              '<node pkg="rosout" type="nope" name="b"/>'))[1]) == 1


UNUSABLE: Dict[str, Tuple[str, str]] = {
    'not XML': ('<launch', 'while processing launch/d.launch: Invalid roslaunch XML syntax: '),
    'empty': ('', 'while processing launch/d.launch: Invalid roslaunch XML syntax: no element'),
    'wrong root': ('<robot/>', 'while processing launch/d.launch: Invalid roslaunch XML syntax: no '
                               'root <launch> tag'),
    'package of an include': (launch('<include file="$(find nope)/a.launch"/>'),
                              'there is no package "nope"; install it or source'),
    'package in an argument': (launch('<arg name="a" default="$(find nope)/a"/>'),
                               'there is no package "nope"; install it or source'),
    'missing include': (launch('<include file="$(dirname)/gone.launch"/>'),
                        'while processing launch/gone.launch: Invalid roslaunch XML syntax: '),
    'circle': (launch('<include file="$(dirname)/d.launch"/>'),
               'while processing launch/d.launch: Invalid roslaunch XML syntax: maximum recursion'),
    'missing text file': (launch('<param name="p" textfile="/nope/x"/>'),
                          "[Errno 2] No such file or directory: '/nope/x'"),
    'missing command': (launch('<param name="p" command="/nope/x"/>'),
                        'while processing launch/d.launch: Invalid <param> tag: '),
    'expression': (launch('<param name="p" value="$(eval 1/0)"/>'), 'division by zero'),
    'expression of nothing': (launch('<param name="p" value="$(eval [][0])"/>'),
                              'list index out of range'),
    'environment': (launch('<param name="p" value="$(env NOT_SET_HERE)"/>'),
                    "environment variable 'NOT_SET_HERE' is not set"),
    'YAML': (launch('<rosparam>a: [</rosparam>'), 'error loading <rosparam> tag: Error within'),
    'attribute': (launch('<node pkg="a" name="n"/>'),
                  "while processing launch/d.launch: <node> tag is missing required attribute: "),
    'needed argument': (launch('<arg name="a"/><param name="p" value="$(arg a)"/>'),
                        "included file [launch/d.launch] requires the 'a' arg to be set"),
    'node twice': (launch('<node pkg="a" type="b" name="n"/>' * 2),
                   'roslaunch file contains multiple nodes named [/n]'),
}


@pytest.mark.parametrize('text, message', UNUSABLE.values(), ids=UNUSABLE)
def test_unusable_file(text: str, message: str, inspect: Inspect) -> None:
    paths, (warning,) = inspect(text)
    assert paths == []
    assert warning.startswith(f'd.launch is left out: {message}')
    assert '\n' not in warning and len(warning) < 400


ARGUMENT = '<arg name="a" value="x:=1  &lt;&quot;"/>'


def test_arguments_are_passed(inspect: Inspect) -> None:
    assert inspect(launch('<arg name="a"/><param name="p" value="$(arg a)"/>'), ARGUMENT)[1] == []


def test_argument_that_the_file_does_not_know(inspect: Inspect) -> None:
    """roslaunch would refuse the whole generated file."""
    paths, (warning,) = inspect(launch(''), ARGUMENT)
    assert paths == []
    assert warning == 'd.launch is left out: unused args [a] for include of [launch/d.launch]'


def test_missing_files_and_packages(parse: Parse, package: Path) -> None:
    cell = parse('<device type="other" name="d"><launch pkg="nope" type="a.launch"/>'
                 '<launch pkg="my_cell" type="a.launch"/></device>')
    found = inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices))
    assert found.paths == {}
    assert [warning.message for warning in found.warnings] == [
        'device "d": a.launch is left out: there is no package "nope"; install it or source the '
        'workspace that has it',
        'device "d": a.launch is left out: it is not in the package "my_cell"']


def test_only_what_is_chosen_is_looked_at(parse: Parse) -> None:
    cell = parse('<device type="other" name="a"><launch pkg="nope" type="a.launch"/></device>'
                 '<device type="other" name="b"><launch pkg="nope" type="a.launch" '
                 'ifstate="playback"/></device>')
    assert inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices[1:])).warnings == []
    assert len(inspect_launch_files(Choice(cell, Mode.PLAYBACK, cell.devices)).warnings) == 2


def test_node_that_two_launch_files_start(parse: Parse, package: Path) -> None:
    (package / 'a.launch').write_text(launch('<node pkg="rosout" type="rosout" name="n" ns="x"/>'))
    (package / 'b.launch').write_text(launch('<node pkg="rosout" type="rosout" name="m"/>'))
    cell = parse('<device type="other" name="one"><launch pkg="my_cell" type="a.launch"/></device>'
                 '<device type="other" name="two"><launch pkg="my_cell" type="a.launch"/>'
                 '<launch pkg="my_cell" type="b.launch"/></device>')
    found = inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices))
    assert list(found.paths.values()) == [str(package / 'a.launch'), str(package / 'b.launch')]
    assert [warning.message for warning in found.warnings] == [
        'device "two": a.launch is left out: its node /x/n is already started by a.launch '
        'of "one"']
    alone = inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices[1:]))
    assert len(alone.paths) == 2 and not alone.warnings


def test_node_that_a_device_starts_itself(parse: Parse, package: Path) -> None:
    (package / 'a.launch').write_text(launch('<node pkg="rosout" type="rosout" name="n" ns="d"/>'))
    cell = parse('<device type="other" name="d"><launch pkg="my_cell" type="a.launch"/>'
                 '<node pkg="rosout" type="rosout" name="n" ifstate="playback"/></device>')
    assert not inspect_launch_files(Choice(cell, Mode.REALTIME, cell.devices)).warnings
    (warning,) = inspect_launch_files(Choice(cell, Mode.PLAYBACK, cell.devices)).warnings
    assert 'its node /d/n is already started by "d"' in warning.message
