# SPDX-License-Identifier: BSD-3-Clause
"""Models that are data: those of makers are read as ever, and nothing else is."""
from __future__ import annotations

from pathlib import Path

import pytest
import rospkg

from process_visualizer.robot.description import ModelError, load_robot_description

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
    assert load_robot_description(path, confined_to=str(tmp_path)) == load_robot_description(path)


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


def test_files_elsewhere(tmp_path: Path) -> None:
    (tmp_path / 'here').mkdir()
    (tmp_path / 'y.yaml').write_text('k: 7\n')
    for name in (f'{tmp_path}/y.yaml', '/etc/passwd', '../y.yaml'):
        with pytest.raises(ModelError, match='may not read'):
            links(tmp_path / 'here', '1', '<xacro:property name="y" value="'
                  f'${{xacro.load_yaml(\'{name}\')[\'k\']}}"/>${{y}}')
