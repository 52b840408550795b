# SPDX-License-Identifier: BSD-3-Clause
"""The position at which xacro stopped, found again in its files."""
from __future__ import annotations

from pathlib import Path
from typing import List
from xml.dom import minidom

import pytest

from process_visualizer.robot.xacro_child import XacroPlace, place_in_files

MAIN = '''<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="width" value="2"/>
  <link name="${prefix}base"/>
  <joint name="a" type="fixed"/>
  <joint name="b" type="fixed"/>
  <xacro:arm prefix="l" reach="${width}"/>
</robot>
'''
BROKEN = '<robot>\n  <gripper jaw="2"/>\n  <open\n'


@pytest.fixture
def files(tmp_path: Path) -> List[str]:
    names = []
    for name, text in (('main.xacro', MAIN), ('broken.xacro', BROKEN)):
        (tmp_path / name).write_text(text, encoding='utf-8')
        names.append(str(tmp_path / name))
    return names


@pytest.mark.parametrize(('element', 'file', 'line'), [
    ('<link name="left_base"/>', 0, 3),
    ('<joint name="b" type="fixed"/>', 0, 5),
    ('<xacro:arm xmlns:xacro="x" prefix="l" reach="2"/>', 0, 6),
    ('<gripper jaw="2"/>', 1, 2)])
def test_an_element_is_found_by_what_stays_of_it(files: List[str], element: str, file: int,
                                                 line: int) -> None:
    node = minidom.parseString(element).documentElement
    assert place_in_files(node, files, 'other') == XacroPlace(files[file], line)


@pytest.mark.parametrize('element', [
    '<joint type="fixed"/>', '<joint name="c" type="fixed"/>', '<joint name="a" limit="1"/>',
    '<sensor/>'])
def test_what_is_there_twice_or_not_at_all_has_no_line(files: List[str], element: str) -> None:
    node = minidom.parseString(element).documentElement
    assert place_in_files(node, files, 'other') == XacroPlace('other', 0)


def test_without_an_element_or_a_file_there_is_no_line(files: List[str], tmp_path: Path) -> None:
    assert place_in_files(None, files, 'other') == XacroPlace('other', 0)
    node = minidom.parseString('<joint name="b" type="fixed"/>').documentElement
    missing = str(tmp_path / 'missing.xacro')
    assert place_in_files(node, [missing], 'other') == XacroPlace('other', 0)
    assert place_in_files(node, [missing, *files], 'other') == XacroPlace(files[0], 5)
