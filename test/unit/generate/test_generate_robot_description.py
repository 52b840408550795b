# SPDX-License-Identifier: BSD-3-Clause
"""Models: xacro is expanded, the URDF is checked, and every message names the broken file."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Callable, Dict, Iterable, List, Tuple

import pytest

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import BaseFrame, Cell, Device, DeviceType, Model, Pose
from process_visualizer.robot.description import (
    ModelError,
    RobotDescription,
    describe_device,
    describe_devices,
    load_robot_description,
    model_path,
)

HERE = Location('cell.xml', 7)
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def links(*names: str) -> str:
    return ''.join(f'<link name="{name}"/>' for name in names)


def joint(name: str, parent: str, child: str, kind: str = 'fixed', inner: str = '') -> str:
    limit = '<limit lower="0" upper="1" effort="1" velocity="1"/>' \
        if kind in ('revolute', 'prismatic') else ''
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{child}"/>{limit}{inner}</joint>')


def robot(content: str) -> str:
    return f'<robot name="r" {XACRO}>{content}</robot>'


GOOD = robot(links('base', 'tool') + joint('j', 'base', 'tool'))


def loaded(content: str, folder: Path) -> RobotDescription:
    path = folder / 'model.urdf'
    path.write_text(robot(content), encoding='utf-8')
    return load_robot_description(str(path))


def error_of(path: Path) -> str:
    """The message on one line, with paths relative to the file's folder."""
    with pytest.raises(ModelError) as caught:
        load_robot_description(str(path))
    message = str(caught.value)
    assert '\n' not in message
    return message.replace(f'{path.parent}/', '')


BROKEN_URDF: Dict[str, Tuple[str, str]] = {
    'empty file': ('', 'model.urdf: not well-formed XML: no element found: line 1, column 0'),
    'not XML': ('robot: {}', 'model.urdf: not well-formed XML: syntax error: line 1, column 0'),
    'unclosed': ('<robot>\n<link>', 'model.urdf: not well-formed XML: no element found: line 2'),
    'wrong root': ('<sdf/>', 'model.urdf: a URDF begins with <robot>, not <sdf>'),
    'no name': ('<robot><link name="a"/></robot>', 'model.urdf: not a valid URDF: '),
    'no link': (robot(''), 'model.urdf: not a valid URDF: No link elements found'),
    'link without name': (robot('<link/>'), 'model.urdf: not a valid URDF: a link has no name'),
    'two roots': (robot(links('a', 'b')), 'model.urdf: not a valid URDF: Failed to find root link: '
                                          'Two root links found: [a] and [b]'),
    'missing link': (robot(links('a') + joint('j', 'a', 'b')),
                     'model.urdf: not a valid URDF: Failed to build tree: child link [b] of joint '
                     '[j] not found'),
    'unknown joint type': (robot(links('a', 'b') + joint('j', 'a', 'b', 'wheel')),
                           'model.urdf: not a valid URDF: Joint [j] has no known type [wheel]'),
    'link twice': (robot(links('a', 'a')), "model.urdf: not a valid URDF: link 'a' is not unique"),
    'joint twice': (robot(links('a', 'b', 'c') + joint('j', 'a', 'b') + joint('j', 'a', 'c')),
                    "model.urdf: not a valid URDF: joint 'j' is not unique"),
    'joint twice, with a sign for terminals': (
        robot(links('a', 'b', 'c') + joint('j&#x9b;', 'a', 'b') + joint('j&#x9b;', 'a', 'c')),
        "model.urdf: not a valid URDF: joint 'j\\x9b' is not unique"),
    'nested': (robot('<a>' * 100 + '</a>' * 100), 'model.urdf: elements are nested more than 100'),
    'no limits': (robot(links('a', 'b') + joint('j', 'a', 'b', 'revolute').replace('<limit', '<x')),
                  'model.urdf: not a valid URDF: Joint [j] is of type REVOLUTE but it does not'),
    'bad number': (robot(links('a', 'b') + joint('j', 'a', 'b', inner='<origin xyz="0 0"/>')),
                   'model.urdf: not a valid URDF: Parser found 2 elements but 3 expected'),
    'name like an error': (robot(links('mirror', 'terror')), 'model.urdf: not a valid URDF: Failed '
                           'to find root link: Two root links found: [mirror] and [terror]'),
    'two parents': (robot(links('a', 'b', 'c') + joint('i', 'a', 'b') + joint('j', 'a', 'c')
                          + joint('k', 'b', 'c')),
                    'model.urdf: not a valid URDF: the link "c" has two parents'),
    'circle': (robot(links('a', 'b', 'c') + joint('i', 'b', 'c') + joint('j', 'c', 'b')),
               'model.urdf: not a valid URDF: the link "c" is not connected to the root link "a"'),
    'own parent': (robot(links('a', 'b') + joint('i', 'b', 'b')),
                   'model.urdf: not a valid URDF: the link "b" is not connected to the root'),
}


@pytest.mark.parametrize('text, message', BROKEN_URDF.values(), ids=BROKEN_URDF)
def test_broken_urdf(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / 'model.urdf'
    path.write_text(text, encoding='utf-8')
    assert error_of(path).startswith(message)


def test_file_that_is_not_text(tmp_path: Path) -> None:
    path = tmp_path / 'model.urdf'
    path.write_bytes(b'\xff\xfe<robot/>')
    assert error_of(path).startswith('model.urdf: cannot be read: ')


@pytest.mark.parametrize('name', ['gone.urdf', 'folder.urdf'])
def test_file_that_cannot_be_read(name: str, tmp_path: Path) -> None:
    (tmp_path / 'folder.urdf').mkdir()
    assert error_of(tmp_path / name).startswith(f'{name}: cannot be read: ')


BROKEN_XACRO: Dict[str, Tuple[str, str]] = {
    'not XML': ('<robot', 'xacro: unclosed token: line 1, column 0'),
    'unknown macro': (robot('<xacro:arm/>'), 'xacro: unknown macro name: xacro:arm'),
    'undefined property': (robot('<link name="${a}"/>'), "xacro: name 'a' is not defined"),
    'division by zero': (robot('<link name="${1/0}"/>'), 'xacro: division by zero'),
    'missing include': (robot('<xacro:include filename="gone.xacro"/>'),
                        'xacro: No such file or directory: gone.xacro'),
    'unknown package': (robot('<xacro:include filename="$(find nope_nope)/a.xacro"/>'),
                        'xacro: there is no package "nope_nope"; install it or source'),
    'missing parameter': (robot('<xacro:macro name="m" params="p"/><xacro:m/>'),
                          r'xacro: Undefined parameters \[p\]'),
    'undefined argument': (robot('<link name="$(arg a)"/>'),
                           'xacro: the argument "a" has no value; write <arg name="a" value='),
    'recursion': (robot('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>'),
                  'xacro: maximum recursion depth exceeded'),
    'circular property': (robot('<xacro:property name="a" value="${b}"/>'
                                '<xacro:property name="b" value="${a}"/><link name="${a}"/>'),
                          'xacro: (recursive|circular) variable definition'),
    'exit': (robot('<link name="${exit()}"/>'), "xacro: name 'exit' is not defined"),
}


@pytest.mark.parametrize('text, message', BROKEN_XACRO.values(), ids=BROKEN_XACRO)
def test_broken_xacro(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / 'model.xacro'
    path.write_text(text, encoding='utf-8')
    assert re.match(f'model.xacro(:1)?: {message}.* \\(xacro [0-9].* in /.*\\)$', error_of(path))


@pytest.mark.parametrize('text, message', BROKEN_XACRO.values(), ids=BROKEN_XACRO)
def test_broken_file_is_named_when_it_is_included(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / 'inner.xacro').write_text(text, encoding='utf-8')
    (tmp_path / 'middle.xacro').write_text(robot('<xacro:include filename="inner.xacro"/>'))
    path = tmp_path / 'model.xacro'
    path.write_text(robot('<xacro:include filename="middle.xacro"/>'))
    assert re.match(f'inner.xacro(:1)?: {message}', error_of(path))


def test_line_of_an_error_in_a_macro_of_another_file(tmp_path: Path) -> None:
    (tmp_path / 'inner.xacro').write_text(robot(
        '\n<xacro:macro name="m" params="n">\n<link name="${n}">\n'
        '<visual name="${1 / n}"/>\n</link>\n</xacro:macro>'))
    path = tmp_path / 'model.xacro'
    path.write_text(robot('<xacro:include filename="inner.xacro"/>\n\n<xacro:m n="0"/>'))
    assert error_of(path).startswith('inner.xacro:4: xacro: division by zero')


def test_no_line_where_two_are_alike(tmp_path: Path) -> None:
    path = tmp_path / 'model.xacro'
    path.write_text(robot('<link name="${a}"/>\n<link name="${a}"/>'))
    assert error_of(path).startswith("model.xacro: xacro: name 'a' is not defined")


def test_error_after_an_include_is_one_of_the_file_itself(tmp_path: Path) -> None:
    (tmp_path / 'inner.xacro').write_text(robot(links('a')))
    path = tmp_path / 'model.xacro'
    path.write_text(robot('<xacro:include filename="inner.xacro"/><link name="${a}"/>'))
    assert error_of(path).startswith('model.xacro:1: xacro: ')


def test_earlier_error_is_not_remembered(tmp_path: Path) -> None:
    test_broken_file_is_named_when_it_is_included(*BROKEN_XACRO['division by zero'], tmp_path)
    path = tmp_path / 'second.xacro'
    path.write_text('<robot')
    assert error_of(path).startswith('second.xacro:1: xacro: unclosed token')
    assert error_of(tmp_path / 'gone.xacro').startswith('gone.xacro: xacro: No such file')


def test_expanded_file_that_is_no_model(tmp_path: Path) -> None:
    path = tmp_path / 'model.xacro'
    path.write_text(robot('<xacro:property name="n" value="a"/><link name="${n}"/>' + links('b')))
    assert error_of(path).startswith('model.xacro: not a valid URDF: Failed to find root link')


def test_expanded_file(tmp_path: Path) -> None:
    (tmp_path / 'inner.xacro').write_text(robot(
        '<xacro:macro name="arm" params="n"><link name="${n}/tool"/></xacro:macro>'))
    path = tmp_path / 'model.urdf.xacro'
    path.write_text(robot('<xacro:include filename="inner.xacro"/><xacro:arm n="ä"/>'))
    description = load_robot_description(str(path))
    assert (description.links, description.root_link) == (('ä/tool',), 'ä/tool')
    assert 'xacro:' not in description.text.replace('xmlns:xacro', '')


def test_description(tmp_path: Path) -> None:
    description = loaded(links('end', 'base', 'middle') + joint('j', 'base', 'middle')
                         + joint('k', 'middle', 'end', 'revolute'), tmp_path)
    assert description.links == ('end', 'base', 'middle')
    assert description.root_link == 'base'
    assert description.parents == {'middle': 'base', 'end': 'middle'}
    assert description.joints == {'k': 'revolute'}
    assert description.ancestors('end') == ['middle', 'base']


def test_comments_that_xml_forbids_and_urdfdom_reads(tmp_path: Path) -> None:
    """As in the model of a PR2 from 2012, which RViz shows."""
    content = '<!-- a.STL\nwas b--coarse.STL --><link name="base"/><!-- good --><!-- a --->'
    description = loaded(content, tmp_path)
    assert description.links == ('base',)
    assert description.text == robot('\n<link name="base"/><!-- good -->')


def test_movable_joints_in_file_order(tmp_path: Path) -> None:
    kinds = ('prismatic', 'fixed', 'continuous', 'revolute', 'floating', 'planar')
    content = links('base', 'm', *(f'l{i}' for i in range(len(kinds))))
    for i, kind in enumerate(kinds):
        content += joint(f'j{9 - i}', 'base', f'l{i}', kind)
    content += joint('follower', 'base', 'm', 'revolute', '<mimic joint="j9"/>')
    assert list(loaded(content, tmp_path).joints.items()) == [
        ('j9', 'prismatic'), ('j7', 'continuous'), ('j6', 'revolute')]


def branch(*names: str) -> str:
    """A chain of links below "base"."""
    pairs = zip(('base', *names), names)
    return links(*names) + ''.join(joint(f'j_{b}', a, b) for a, b in pairs)


def test_links_that_are_drawn_and_those_for_collisions_only(tmp_path: Path) -> None:
    description = loaded(
        '<link name="base"><visual><geometry><sphere radius="1"/></geometry></visual>'
        '<collision><geometry><sphere radius="1"/></geometry></collision></link>'
        '<link name="hull"><collision><geometry><sphere radius="1"/></geometry></collision></link>'
        + links('bare') + joint('h', 'base', 'hull') + joint('b', 'base', 'bare'), tmp_path)
    assert (description.drawn, description.collision_only) == ({'base'}, {'hull'})
    assert description.children('base') == ['hull', 'bare']


def device(path: str, name: str = 'd', package: str = 'my_cell', base: str = '') -> Device:
    frame = BaseFrame(base, Pose(), HERE) if base else None
    return Device(DeviceType.ROBOT, name, Location('cell.xml', 6), base=frame,
                  model=Model(package, path, HERE))


def describe(devices: Iterable[Device]) -> Tuple[List[str], List[str]]:
    """Names of the described devices, and the problems."""
    found, problems = describe_devices(tuple(devices))
    return list(found), [str(problem) for problem in problems]


def test_model_of_a_package(package: Path) -> None:
    (package / 'urdf' / 'arm.urdf').write_text(GOOD)
    assert model_path(Model('my_cell', 'urdf/arm.urdf', HERE)) == str(package / 'urdf/arm.urdf')
    assert describe([device('urdf/arm.urdf', base='base')]) == (['d'], [])


def test_model_beside_the_configuration(parse: Callable[[str], Cell], tmp_path: Path) -> None:
    cell = parse('<device type="robot" name="arm"><model path="arm.urdf" />'
                 '<base frame="base" /></device>')
    where = tmp_path / 'arm.urdf'
    [problem] = describe_devices(cell.devices)[1]
    assert str(problem).endswith(f'<model>: there is no file "{where}"; check the path')
    where.write_text(GOOD)
    model = cell.devices[0].model
    assert model is not None and model_path(model) == str(where)
    assert list(describe_devices(cell.devices)[0]) == ['arm']


def test_missing_file(package: Path) -> None:
    assert describe([device('urdf/arm.urdf')]) == (
        [], [f'cell.xml:7: <model>: there is no file "urdf/arm.urdf" in the package "my_cell" '
             f'({package})'])


def test_unknown_package_with_advice(package: Path) -> None:
    assert describe([device('a.urdf', package='my_cel')]) == (
        [], ['cell.xml:7: <model>: there is no package "my_cel"; did you mean "my_cell"? '
             'Otherwise install it or source the workspace that has it'])


def test_device_without_model() -> None:
    assert describe_device(Device(DeviceType.OTHER, 'd', HERE)) is None
    assert describe([Device(DeviceType.OTHER, 'd', HERE)]) == ([], [])


def test_base_frame_is_the_root_link(package: Path) -> None:
    (package / 'arm.urdf').write_text(GOOD)
    assert describe([device('arm.urdf', base='tool')]) == (
        [], ['cell.xml:7: <model>: the base frame "tool" is not the root link of the model, which '
             'is "base"; write this name in <base>'])


def test_robots_with_equal_links(package: Path) -> None:
    (package / 'a.urdf').write_text(GOOD)
    (package / 'b.urdf').write_text(robot(links('other', 'tool') + joint('j', 'other', 'tool')))
    (package / 'c.urdf').write_text(robot(links('other')))
    found, problems = describe([device('a.urdf', 'a'), device('b.urdf', 'b'),
                                device('c.urdf', 'c')])
    assert found == ['a', 'c']  # refused models reserve no names
    assert problems == ['cell.xml:7: <model>: the link "tool" is also in the model of "a"; link '
                        'names must differ: write prefix="b/" in <model>, and the same before the '
                        'frames in <base>, <tool>, <force>']


def test_every_broken_model_is_reported(package: Path) -> None:
    (package / 'good.urdf').write_text(GOOD)
    (package / 'bad.urdf').write_text('<sdf/>')
    found, problems = describe([device('bad.urdf', 'a'), device('good.urdf', 'b'),
                                device('gone.urdf', 'c')])
    assert found == ['b']
    assert len(problems) == 2 and f'{package}/bad.urdf: a URDF begins' in problems[0]


def test_check_urdf_is_not_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(ModelError, match='check_urdf is not installed; install liburdfdom-tools'):
        loaded(links('base'), tmp_path)


def test_models_of_the_sewing_cell(parse: Callable[[str], Cell]) -> None:
    cell = parse(''.join(
        f'<device type="robot" name="{name}"><model pkg="sewing_cell" '
        f'path="urdf/{name}.urdf.xacro"/></device>' for name in ('ur_rt_upper', 'ur_rt_lower')))
    found, problems = describe_devices(cell.devices)
    assert problems == []
    for name, description in found.items():
        assert description.root_link == f'{name}/link0'
        assert f'{name}/tool' in description.links
        assert len(description.joints) == 6
