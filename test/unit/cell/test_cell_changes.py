# SPDX-License-Identifier: BSD-3-Clause
"""Differences between two versions of a configuration."""
from __future__ import annotations

from pathlib import Path
from typing import Callable

import pytest

from process_visualizer.cell.model import Cell, Changes, changes
from process_visualizer.cell.xml_parser import XmlParser

Parse = Callable[..., Cell]
REPOSITORY = Path(__file__).resolve().parents[3]
ARM = '''<device type="robot" name="arm">
  <base frame="arm/base" xyz="0 0 1" />
  <node pkg="p" type="t" name="n"><param name="a" value="1" /></node>
  <topic name="q" type="joint_states" />
  <rviz type="Grid"><property name="Color" value="1; 2; 3" /></rviz>
</device>'''
BOX = '<device type="other" name="box" />'
NONE = Changes((), (), (), ('arm', 'box'), False)


@pytest.fixture
def parse(tmp_path: Path) -> Parse:
    """Parses the content of a <visualizer>, each time as a new file."""
    def parse_text(text: str, attributes: str = '') -> Cell:
        path = tmp_path / f'{len(list(tmp_path.iterdir()))}.xml'
        path.write_text(f'<visualizer {attributes}>{text}</visualizer>')
        return XmlParser().parse(str(path))
    return parse_text


def test_nothing(parse: Parse) -> None:
    found = changes(parse(ARM + BOX), parse('\n\n<!-- another place -->' + ARM + '\n' + BOX))
    assert found == NONE
    assert not found


def test_layout_and_written_defaults_do_not_count(parse: Parse) -> None:
    written = ARM.replace('xyz="0 0 1"', 'rpy="0 0 0" xyz="0.0  0.0 1.0"').replace('\n', ' ')
    assert changes(parse(ARM + BOX), parse(written + BOX)) == NONE


@pytest.mark.parametrize('old, new', [
    ('0 0 1', '0 0 2'), ('name="a" value="1"', 'name="a" value="2"'), ('1; 2; 3', '1; 2; 4'),
    ('type="t"', 'type="t2"'), ('name="q"', 'name="q2"'), (' type="joint_states"', ''),
    ('"Grid"', '"Axes"')])
def test_changed_device(old: str, new: str, parse: Parse) -> None:
    assert old in ARM
    found = changes(parse(ARM + BOX), parse(ARM.replace(old, new) + BOX))
    assert found == Changes((), (), ('arm',), ('box',), False)
    assert found


def test_new_and_gone_devices(parse: Parse) -> None:
    assert changes(parse(ARM + BOX), parse(BOX + BOX.replace('box', 'can'))) == Changes(
        ('can',), ('arm',), (), ('box',), False)


def test_other_order(parse: Parse) -> None:
    assert changes(parse(ARM + BOX), parse(BOX + ARM)) == Changes(
        (), (), (), ('box', 'arm'), False)


@pytest.mark.parametrize('text, attributes', [
    (ARM + BOX, 'frame="map"'), (ARM + BOX + '<machine name="pc" address="pc"/>', '')])
def test_what_belongs_to_no_device(text: str, attributes: str, parse: Parse) -> None:
    found = changes(parse(ARM + BOX), parse(text, attributes))
    assert found == Changes((), (), (), ('arm', 'box'), True)
    assert found


def test_real_cell_with_itself() -> None:
    file = str(REPOSITORY / 'sewing_cell' / 'devices' / 'variables.xml')
    one, two = XmlParser().parse(file), XmlParser().parse(file)
    assert not changes(one, two)
    assert changes(one, two).same == tuple(device.name for device in one.devices)
