# SPDX-License-Identifier: BSD-3-Clause
"""Expected objects of a sensor are added to the file, and nothing else changes."""
from __future__ import annotations

import codecs
import os
from pathlib import Path
from typing import List, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import Location
from process_visualizer.cell.file_edit import PoseEditError, PoseEditor
from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.cell.xml_parser import XmlParser

HERE = Location('cell.xml', 1)
BOXES = [RegionOfInterest('world', (0.5, -1.0, 0.125), (0.2, 0.3, 0.25), HERE),
         RegionOfInterest('table', (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), HERE)]
FIRST = '<expected xyz="0.5 -1 0.125" size="0.2 0.3 0.25" />'
SECOND = '<expected frame="table" xyz="0 0 0" size="1 1 1" />'


def document(objects: str) -> str:
    return ('<visualizer>\n<device type="depth_sensor" name="k"><!-- a --><topic name="c" '
            f'type="pointcloud"/>\n{objects}</device>\n</visualizer>')


def written(path: Path, text: str) -> PoseEditor:
    path.write_bytes(text.encode())
    return PoseEditor(XmlParser().parse(str(path)))


@pytest.mark.parametrize('before, after', [
    ('  <objects warn="1" />\n',
     f'  <objects warn="1">\n    {FIRST}\n    {SECOND}\n  </objects>\n'),
    ('    <objects/>\n', f'    <objects>\n        {FIRST}\n        {SECOND}\n    </objects>\n'),
    ('\r\n\t<objects/>\r\n',
     f'\r\n\t<objects>\r\n\t\t{FIRST}\r\n\t\t{SECOND}\r\n\t</objects>\r\n'),
    ('<topic name="d"/><objects\n/>', f'<topic name="d"/><objects>{FIRST}{SECOND}</objects>'),
    ('  <objects>\n      <!-- goods --><expected size="1 1 1"/>\n  </objects>',
     f'  <objects>\n      {FIRST}\n      {SECOND}\n      <!-- goods --><expected size="1 1 1"/>\n'
     '  </objects>'),
    ('  <objects> <!-- all -->\n  </objects>',
     f'  <objects> <!-- all -->\n    {FIRST}\n    {SECOND}\n  </objects>'),
    ('  <objects></objects>', f'  <objects>{FIRST}{SECOND}</objects>'),
])
def test_the_elements_are_added_in_the_style_of_the_file(before: str, after: str,
                                                         tmp_path: Path) -> None:
    path = tmp_path / 'cell.xml'
    path.write_bytes(document(before).encode())
    editor = PoseEditor(XmlParser().parse(str(path)))
    saved = editor.save_expected('k', BOXES)
    assert path.read_bytes().decode() == document(after)
    assert saved is not None and Path(saved.backup).read_bytes().decode() == document(before)
    editor.revert(saved)
    assert path.read_bytes().decode() == document(before)
    assert os.listdir(tmp_path) == ['cell.xml']


numbers = st.floats(-1e3, 1e3).map(lambda value: round(value, 4) + 0.0)
lengths = st.floats(0.001, 10.0).map(lambda value: round(value, 4))
boxes = st.builds(RegionOfInterest, st.just('world'), st.tuples(numbers, numbers, numbers),
                  st.tuples(lengths, lengths, lengths), st.just(HERE))


@st.composite
def documents(draw: st.DrawFn) -> Tuple[bytes, int]:
    """A configuration of sensors d0, d1, … written in many ways, and their count."""
    encoding, mark = draw(st.sampled_from([
        ('utf-8', b''), ('utf-8', codecs.BOM_UTF8), ('iso-8859-1', b''), ('utf-16', b'')]))
    line_end = draw(st.sampled_from(['\n', '\r\n', '\r']))
    count = draw(st.integers(1, 3))
    parts: List[str] = [f'<?xml version="1.0" encoding="{encoding}"?>', '<visualizer>']
    for number in range(count):
        inner = draw(st.lists(st.sampled_from(
            ['<!-- größer > <objects/> -->', '    <expected size="1 1 1"/>', '\t', '']),
            max_size=3))
        indent = draw(st.sampled_from(['', '  ', '\t', '<!-- ä -->']))
        start = f'{indent}<objects' + draw(st.sampled_from(['', ' ', '\t', "  warn = '1'"]))
        parts += [f'<device type="depth_sensor" name="d{number}">',
                  f'<topic ns="c{number}" name="c" type="pointcloud"/>']
        parts += [f'{start}/>'] if draw(st.booleans()) else [f'{start}>', *inner, '</objects>']
        parts += ['</device>']
    return mark + line_end.join([*parts, '</visualizer>']).encode(encoding), count


@given(documents(), st.lists(boxes, min_size=1, max_size=3), st.data())
def test_every_other_element_and_byte_stays(tmp_path: Path, case: Tuple[bytes, int],
                                            added: List[RegionOfInterest],
                                            data: st.DataObject) -> None:
    content, count = case
    name = f'd{data.draw(st.integers(0, count - 1))}'
    path = tmp_path / 'cell.xml'
    path.write_bytes(content)
    before = XmlParser().parse(str(path))
    editor = PoseEditor(before)
    saved = editor.save_expected(name, added)
    after = XmlParser().parse(str(path))
    for old, new in zip(before.devices, after.devices):
        assert old.objects is not None and new.objects is not None
        wanted = [*(added if old.name == name else []), *old.objects.expected]
        assert [(it.frame, it.center, it.size) for it in new.objects.expected] == [
            (it.frame, it.center, it.size) for it in wanted]
        assert (new.objects.warn_m, new.topics[0].name) == (old.objects.warn_m, old.topics[0].name)
    changed = path.read_bytes()
    same = len(os.path.commonprefix([content, changed]))
    tail = len(os.path.commonprefix([content[same:][::-1], changed[same:][::-1]]))
    dropped = content[same:len(content) - tail].replace(b'\0', b'')
    assert dropped.strip() in (b'', b'/'), 'only the slash of an empty element is replaced'
    assert saved is not None
    editor.revert(saved)
    assert path.read_bytes() == content
    assert os.listdir(tmp_path) == ['cell.xml']


def test_without_boxes_nothing_is_written(tmp_path: Path) -> None:
    editor = written(tmp_path / 'cell.xml', document('<objects/>'))
    assert editor.save_expected('k', []) is None
    assert os.listdir(tmp_path) == ['cell.xml']


def test_a_sensor_that_seeks_no_objects(tmp_path: Path) -> None:
    editor = written(tmp_path / 'cell.xml', document(''))
    with pytest.raises(PoseEditError, match='"k" no longer has <objects>'):
        editor.save_expected('k', BOXES)


def test_a_file_that_was_changed_meanwhile_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / 'cell.xml'
    editor = written(path, document('<objects/>'))
    path.write_text(document('<objects warn="1"/>'))
    with pytest.raises(PoseEditError, match='has been changed since it was loaded'):
        editor.save_expected('k', BOXES)
    assert path.read_text() == document('<objects warn="1"/>')


def test_a_file_included_twice_is_refused(tmp_path: Path) -> None:
    main, part = tmp_path / 'main.xml', tmp_path / 'part.xml'
    main.write_text('<visualizer><include file="part.xml"><arg name="n" value="a"/></include>'
                    '<include file="part.xml"><arg name="n" value="b"/></include></visualizer>')
    text = ('<visualizer><arg name="n"/><device type="depth_sensor" name="$(arg n)">'
            '<topic ns="$(arg n)_c" name="c" type="pointcloud"/><objects/></device></visualizer>')
    part.write_text(text)
    with pytest.raises(PoseEditError, match='<objects> is shared by a and b'):
        PoseEditor(XmlParser().parse(str(main))).save_expected('a', BOXES)
    assert part.read_text() == text
