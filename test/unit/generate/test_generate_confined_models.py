# SPDX-License-Identifier: BSD-3-Clause
"""Models that are data: makers' models are read as usual, and nothing else is."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
import rospkg

from process_visualizer.robot.description import (
    ModelError,
    RobotDescription,
    load_robot_description,
)

PACKAGE = Path(rospkg.RosPack().get_path('process_visualizer'))
_ROBOT = ('<robot xmlns:xacro="http://ros.org/wiki/xacro" name="r">{}<link name="a"/>'
          '<link name="x${{{}}}"/><joint name="j" type="fixed"><parent link="a"/>'
          '<child link="x${{{}}}"/></joint></robot>')


def links(tmp_path: Path, expression: str, before: str = '') -> 'tuple[str, ...]':
    path = tmp_path / 'r.xacro'
    path.write_text(_ROBOT.format(before, expression, expression), encoding='utf-8')
    return load_robot_description(str(path), confined_to=str(tmp_path)).links


@pytest.mark.parametrize('model', ['sewing_cell/urdf/ur_rt_upper.urdf.xacro',
                                   'sewing_cell/urdf/ur_rt_lower.urdf.xacro'])
def test_models_of_packages_are_as_ever(model: str, tmp_path: Path) -> None:
    path = str(PACKAGE / model)
    confined = load_robot_description(path, confined_to=str(tmp_path))
    free = load_robot_description(path)
    assert ElementTree.canonicalize(confined.text) == ElementTree.canonicalize(free.text)
    assert replace(confined, text=free.text) == free


@pytest.mark.parametrize('expression', [
    '1 + 2', 'radians(180) > 3', '"a".upper()', '[1, 2][-1]', 'd["k"]', 'd.k', 'len(range(3))',
    'sorted([3, 1])[0]', '"b" if True and not False else "c"', '[i for i in range(2)][1]',
    'y["k"]', 'y.k'])
def test_calculations_and_files_beside_it(expression: str, tmp_path: Path) -> None:
    (tmp_path / 'y.yaml').write_text('k: 7\n')
    before = ('<xacro:property name="d" value="${dict(k=3)}"/>'
              f'<xacro:property name="y" value="${{xacro.load_yaml(\'{tmp_path}/y.yaml\')}}"/>')
    if expression == 'd.k':
        before = before.replace('dict(k=3)', 'xacro.dotify(dict(k=3))')
    assert len(links(tmp_path, expression.replace('"', '&quot;'), before)) == 2


@pytest.mark.parametrize('expression', [
    'vars(type)', 'python.vars', '(x for x in [1]).gi_frame', 'str.__class__', 'str._x',
    '"a".format(1)', '(lambda: 1)()', 'type.mro(type(1))', 'f"1"'])
def test_what_reaches_into_python(expression: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match='only calculate'):
        links(tmp_path, expression.replace('"', '&quot;'))


def urdf(tmp_path: Path, content: str) -> RobotDescription:
    path = tmp_path / 'r.urdf'
    path.write_text(f'<robot name="r"><link name="a"/>{content}</robot>', encoding='utf-8')
    return load_robot_description(str(path), confined_to=str(tmp_path))


def link(name: str, parent: str = 'a', inner: str = '', attributes: str = '') -> str:
    return (f'<link name="{name}"{attributes}>{inner}</link><joint name="j_{name}" type="fixed">'
            f'<parent link="{parent}"/><child link="{name}"/></joint>')


_SHAPE = '<{}visual{}><geometry><mesh filename="http://127.0.0.1:9/a.dae"/></geometry></{}visual>'


@pytest.mark.parametrize('content', [
    link('b', inner=_SHAPE.format('', ' xmlns="x"', '')),
    link('b', inner=f'<x xmlns="x">{_SHAPE.format("", "", "")}</x>'),
    link('b', inner=_SHAPE.format('', '', '').replace('<mesh', '<mesh xmlns="x"')),
    '<material name="m" xmlns="x"><texture filename="http://127.0.0.1:9/a.png"/></material>',
    f'<!-- {_SHAPE.format("", "", "")} -->'], ids=['visual', 'above', 'mesh', 'texture', 'comment'])
def test_no_namespace_hides_what_rviz_would_fetch(content: str, tmp_path: Path) -> None:
    """RViz's XML reader ignores namespaces: an element in one is like any other."""
    model = urdf(tmp_path, content)
    assert '127.0.0.1' not in model.text
    assert bool(model.ignored) == ('<!--' not in content)


def test_a_mesh_that_cannot_be_a_path_is_ignored(tmp_path: Path) -> None:
    uri = 'package://sewing_cell/%00.dae'
    shape = _SHAPE.format('', '', '').replace('http://127.0.0.1:9/a.dae', uri)
    assert urdf(tmp_path, link('b', inner=shape)).ignored == (uri,)


@pytest.mark.parametrize(('content', 'told'), [
    ('<gazebo>' + '<a>' * 100_000 + '</a>' * 100_000 + '</gazebo>', 'more than 100 deep'),
    (''.join(link(f'l{number}') for number in range(1000)), 'more than 1000 links'),
    ('<gazebo>' + 10_000_000 * 'x' + '</gazebo>', 'more than 10000000 characters')],
    ids=['deep', 'links', 'characters'])
def test_what_asks_too_much_is_refused(content: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=told):
        urdf(tmp_path, content)


def test_so_is_what_xacro_makes_too_long(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match='more than 10000000 characters'):
        links(tmp_path, '1', '<xacro:property name="p" value="${\'x\' * 20000000}"/>${p}')
    with pytest.raises(ModelError) as caught:
        links(tmp_path, 'xacro.fatal(&quot;x&quot; * 20000000)')
    assert len(str(caught.value)) < 10_000


def test_what_a_model_prints_does_not_reach_the_terminal(
        tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    links(tmp_path, '1', '<xacro:property name="p" value="'
          '${xacro.message(&quot;\\x1b]0;title&quot;)}"/>${p}')
    assert capfd.readouterr() == ('', '')


def test_a_module_elsewhere_is_a_file_like_any_other(tmp_path: Path) -> None:
    (tmp_path / 'here').mkdir()
    for name in ('settings.py', 'package.xml'):
        (tmp_path / name).write_text('k: 7\n')
        with pytest.raises(ModelError, match='may not read'):
            links(tmp_path / 'here', '1', '<xacro:property name="y" value="'
                  f'${{xacro.load_yaml(\'{tmp_path}/{name}\')[\'k\']}}"/>${{y}}')


def test_files_elsewhere(tmp_path: Path) -> None:
    (tmp_path / 'here').mkdir()
    (tmp_path / 'y.yaml').write_text('k: 7\n')
    for name in (f'{tmp_path}/y.yaml', '/etc/passwd', '../y.yaml'):
        with pytest.raises(ModelError, match='may not read'):
            links(tmp_path / 'here', '1', '<xacro:property name="y" value="'
                  f'${{xacro.load_yaml(\'{name}\')[\'k\']}}"/>${{y}}')
