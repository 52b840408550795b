# SPDX-License-Identifier: BSD-3-Clause
"""The pose of a base frame is written into the file, and nothing else changes."""
from __future__ import annotations

import codecs
import errno
import math
import os
import stat
from pathlib import Path
from random import Random
from typing import Dict, List, Optional, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.file_edit import (
    PoseEditError,
    PoseEditor,
    number_text,
    with_last,
)
from process_visualizer.cell.model import Cell, Pose
from process_visualizer.cell.xml_parser import XmlParser

POSE = Pose((1.25, -0.5, 0.0), (0.1, 0.0, -3.141593))
ZERO = Pose()


def parsed(path: Path, arguments: Optional[Dict[str, str]] = None) -> Cell:
    return XmlParser(arguments).parse(str(path))


def written(folder: Path, text: str, encoding: str = 'utf-8') -> Path:
    path = folder / 'cell.xml'
    path.write_bytes(text.encode(encoding))
    return path


def saved_text(path: Path, device: str = 'a', pose: Pose = POSE) -> str:
    """The text of a file after a pose has been saved."""
    PoseEditor(parsed(path)).save(device, pose)
    with open(path, encoding='utf-8', newline='') as file:
        return file.read()


def document(base: str) -> str:
    return f'<visualizer><device type="other" name="a">{base}</device></visualizer>'


@pytest.mark.parametrize('before, after', [
    ('<base frame="f" xyz="0 0 0" rpy="0 0 0" />',
     '<base frame="f" xyz="1.25 -0.5 0" rpy="0.1 0 -3.141593" />'),
    ("<base ypr = '9 0.00 9'\n xyz\t=\t' 1.250  9\n 0e3 '   frame='f'/>",
     "<base ypr = '0.1 0.00 -3.141593'\n xyz\t=\t' 1.250  -0.5\n 0e3 '   frame='f'/>"),
    ('<base frame="f"/>', '<base frame="f" xyz="1.25 -0.5 0" ypr="0.1 0 -3.141593"/>'),
    ('<base frame="f"  ></base>',
     '<base frame="f" xyz="1.25 -0.5 0" ypr="0.1 0 -3.141593"  ></base>'),
    ('<!-- <base xyz="1 1 1"/> --><base\n  frame="f>"\n  rpy="0 0 0"\n/>'.replace('f>', 'f'),
     '<!-- <base xyz="1 1 1"/> --><base\n  frame="f"\n  rpy="0.1 0 -3.141593" '
     'xyz="1.25 -0.5 0"\n/>')])
def test_only_the_numbers_change(tmp_path: Path, before: str, after: str) -> None:
    path = written(tmp_path, document(before))
    assert saved_text(path) == document(after)
    base = parsed(path).device('a').base
    assert base is not None
    assert base.pose == POSE


def test_what_is_zero_is_not_added(tmp_path: Path) -> None:
    path = written(tmp_path, document('<base frame="f"/>'))
    assert PoseEditor(parsed(path)).save('a', ZERO) is None
    assert saved_text(path, pose=Pose((0, 0, 1), (-0.0, 1e-9, 0))) == document(
        '<base frame="f" xyz="0 0 1"/>')


def test_numbers_that_are_the_same_keep_their_digits(tmp_path: Path) -> None:
    path = written(tmp_path, document('<base frame="f" rpy="0 3.141592653589793 +1.50e0"/>'))
    assert saved_text(path, pose=Pose((0, 0, 0), (0.2, math.pi, 1.5))) == document(
        '<base frame="f" rpy="0.2 3.141592653589793 +1.50e0"/>')


@pytest.mark.parametrize('value, text', [
    (-0.0, '0'), (-1e-9, '0'), (1.0, '1'), (100.0, '100'), (0.1 + 0.2, '0.3'),
    (-1234.56789012, '-1234.56789'), (0.0000005, '0'), (0.000001, '0.000001')])
def test_numbers_are_short(value: float, text: str) -> None:
    assert number_text(value) == text


ENCODINGS = ('utf-8', 'iso-8859-1', 'utf-16', 'us-ascii', 'windows-1252')


@pytest.mark.parametrize('encoding, mark', [*((encoding, b'') for encoding in ENCODINGS),
                                            ('utf-8', codecs.BOM_UTF8)])
@pytest.mark.parametrize('line_end', ['\n', '\r\n', '\r'])
def test_bytes_around_the_numbers_stay(tmp_path: Path, encoding: str, line_end: str,
                                       mark: bytes) -> None:
    note = 'ascii' if encoding == 'us-ascii' else 'größer'
    lines = [f'<?xml version="1.0" encoding="{encoding}"?>', f'<!-- {note} -->', '<visualizer>',
             f'<device type="other" name="a"><!-- {note} --><base xyz="{{}}" frame="f"/>',
             '</device>', '</visualizer>', '']
    template = line_end.join(lines)
    path = tmp_path / 'cell.xml'
    path.write_bytes(mark + template.format('0 0 0').encode(encoding))
    PoseEditor(parsed(path)).save('a', Pose((1.5, 0, 0)))
    assert path.read_bytes() == mark + template.format('1.5 0 0').encode(encoding)


numbers = st.floats(-1e4, 1e4).map(lambda value: round(value, 6) + 0.0)
poses = st.builds(Pose, st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers, numbers))
blanks = st.sampled_from([' ', '  ', '\n', '\r\n  ', '\t'])


@st.composite
def devices(draw: st.DrawFn) -> Tuple[str, int]:
    """A configuration of devices d0, d1, … with bases written in many ways, and their count."""
    count = draw(st.integers(1, 4))
    parts: List[str] = []
    for number in range(count):
        attributes = [f'frame="f{number}"']
        for name in draw(st.sampled_from([(), ('xyz',), ('rpy',), ('ypr', 'xyz'),
                                          ('rpy', 'xyz')])):
            quote = draw(st.sampled_from('\'"'))
            words = [repr(draw(numbers)) for _ in range(3)]
            attributes.append(f'{name}{draw(blanks)}={quote}{draw(blanks).join(words)}{quote}')
        inner = ''.join(draw(blanks) + it for it in draw(st.permutations(attributes)))
        note = draw(st.sampled_from(['', '<!-- ä <base/> -->', '\n', '\r\n', '<topic name="t"/>']))
        parts.append(f'<device type="other" name="d{number}">{note}<base{inner}'
                     f'{draw(st.sampled_from(["/>", " />", "></base>"]))}</device>'
                     + draw(st.sampled_from(['', '\n', ' '])))
    return f'<visualizer>{"".join(parts)}</visualizer>', count


@given(devices(), poses, st.randoms(use_true_random=False))
def test_every_other_device_and_byte_stays(tmp_path: Path, case: Tuple[str, int], pose: Pose,
                                           random: Random) -> None:
    text, count = case
    number = random.randrange(count)
    path = written(tmp_path, text)
    before, data = parsed(path), path.read_bytes()
    editor = PoseEditor(before)
    saved = editor.save(f'd{number}', pose)
    after = parsed(path)
    for device in range(count):
        old, new = before.devices[device], after.devices[device]
        assert old.base is not None and new.base is not None
        if device != number:
            assert new == old
        else:
            assert new.base.location == old.base.location
            assert new.base.pose.xyz == pytest.approx(pose.xyz, abs=5.1e-7)
            assert new.base.pose.ypr == pytest.approx(pose.ypr, abs=5.1e-7)
    if saved is not None:
        assert Path(saved.backup).read_bytes() == data
        _check_outside(data, path.read_bytes(), number)
        editor.revert(saved)
        assert path.read_bytes() == data
        assert os.listdir(tmp_path) == ['cell.xml']


def _check_outside(before: bytes, after: bytes, number: int) -> None:
    """Assert that the text before and after the element is unchanged."""
    mark = f'name="d{number}"'.encode()
    begin = before.index(b'<base', before.index(mark))
    if b'<!-- \xc3\xa4 <base/> -->' in before[before.index(mark):before.index(mark) + 40]:
        begin = before.index(b'<base', begin + 5)
    behind = before[before.index(b'>', begin):]
    assert after.startswith(before[:begin])
    assert after.endswith(behind)


def test_the_file_that_is_included_is_edited(tmp_path: Path) -> None:
    main = tmp_path / 'main.xml'
    main.write_text('<visualizer><include file="part/a.xml"/></visualizer>')
    (tmp_path / 'part').mkdir()
    part = tmp_path / 'part' / 'a.xml'
    part.write_text(document('<base frame="f"/>'))
    before = main.read_bytes()
    saved = PoseEditor(parsed(main)).save('a', POSE)
    assert saved is not None
    assert (saved.file, saved.backup) == (str(part), f'{part}.bak')
    assert main.read_bytes() == before
    base = parsed(main).device('a').base
    assert base is not None and base.pose == POSE


def test_a_file_included_twice_is_refused(tmp_path: Path) -> None:
    main, part = tmp_path / 'main.xml', tmp_path / 'part.xml'
    main.write_text('<visualizer><include file="part.xml"><arg name="n" value="a"/></include>'
                    '<include file="part.xml"><arg name="n" value="b"/></include></visualizer>')
    part.write_text('<visualizer><arg name="n"/><device type="other" name="$(arg n)">'
                    '<base frame="$(arg n)/base"/></device></visualizer>')
    with pytest.raises(PoseEditError, match='shared by a and b'):
        PoseEditor(parsed(main)).save('a', POSE)


@pytest.mark.parametrize('base, reason', [
    ('<base frame="f" xyz="0 0 $(arg height)"/>', 'substitution argument'),
    ('<base frame="f" rpy="$(arg height) 0 0"/>', 'substitution argument'),
    ('<base frame="f" xyz="0&#32;0 0"/>', 'three plain numbers')])
def test_what_is_no_plain_number_is_refused(tmp_path: Path, base: str, reason: str) -> None:
    text = document(base).replace('<visualizer>', '<visualizer><arg name="height" value="2"/>')
    path = written(tmp_path, text)
    with pytest.raises(PoseEditError, match=reason) as caught:
        PoseEditor(parsed(path)).save('a', POSE)
    assert str(caught.value).startswith(f'{path}:1: <base>: ')
    assert path.read_text() == text
    assert os.listdir(tmp_path) == ['cell.xml']


def test_a_base_that_shares_its_line_is_found_by_its_device(tmp_path: Path) -> None:
    two = ('<visualizer><device type="other" name="a"><base frame="f"/></device>'
           '<device type="other" name="b"><base frame="g"/></device></visualizer>')
    path = written(tmp_path, two)
    assert saved_text(path, 'b', Pose((0, 0, 1), (0, 0, 0))) == two.replace(
        '<base frame="g"/>', '<base frame="g" xyz="0 0 1"/>')


def test_a_device_without_a_base_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, document(''))
    with pytest.raises(PoseEditError, match=r'has no <base>; add <base frame="a/base" />'):
        PoseEditor(parsed(path)).save('a', POSE)


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_numbers_have_to_be_finite(tmp_path: Path, bad: float) -> None:
    path = written(tmp_path, document('<base frame="f"/>'))
    with pytest.raises(PoseEditError, match='finite'):
        PoseEditor(parsed(path)).save('a', Pose((0, bad, 0)))


def test_a_file_that_was_changed_meanwhile_is_not_touched(tmp_path: Path) -> None:
    path = written(tmp_path, document('<base frame="f"/>'))
    editor = PoseEditor(parsed(path))
    path.write_text(document('<base frame="g"/>'))
    with pytest.raises(PoseEditError, match='has been changed since it was loaded'):
        editor.save('a', POSE)
    path.unlink()
    with pytest.raises(PoseEditError, match='cannot be read'):
        editor.save('a', POSE)


def test_poses_can_be_saved_again_and_taken_back(tmp_path: Path) -> None:
    path = written(tmp_path, document('<base frame="f"/>'))
    first = path.read_bytes()
    (tmp_path / 'cell.xml.bak').write_text("somebody's own")
    editor = PoseEditor(parsed(path))
    saved = [editor.save('a', Pose((float(number), 0, 0))) for number in (1, 2)]
    assert [it and it.backup for it in saved] == [f'{path}.bak1', f'{path}.bak2']
    assert saved[0] is not None and saved[1] is not None
    with pytest.raises(PoseEditError, match='since it was saved'):
        editor.revert(saved[0])
    editor.revert(saved[1])
    editor.revert(saved[0])
    assert path.read_bytes() == first
    assert (tmp_path / 'cell.xml.bak').read_text() == "somebody's own"
    assert editor.save('a', POSE) is not None


def test_permissions_and_links_stay(tmp_path: Path) -> None:
    target = written(tmp_path, document('<base frame="f"/>'))
    target.chmod(0o640)
    link = tmp_path / 'link.xml'
    link.symlink_to('cell.xml')
    saved = PoseEditor(parsed(link)).save('a', POSE)
    assert link.is_symlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert saved is not None
    assert saved.backup == f'{target}.bak'
    assert stat.S_IMODE(os.stat(saved.backup).st_mode) == 0o640
    assert 'xyz' in target.read_text()


def test_a_file_with_the_longest_name_is_edited(tmp_path: Path) -> None:
    path = written(tmp_path, document('<base frame="f"/>')).rename(tmp_path / f'{"ä" * 123}.xml')
    assert PoseEditor(parsed(path)).save('a', POSE) is not None
    assert 'xyz' in path.read_text()


def test_a_file_that_cannot_be_written_stays(tmp_path: Path,
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_arguments: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = written(tmp_path, document('<base frame="f"/>'))
    editor, before = PoseEditor(parsed(path)), path.read_bytes()
    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(PoseEditError, match='cell.xml: cannot be written: No space'):
        editor.save('a', POSE)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ['cell.xml']


def test_the_configurations_that_come_with_the_package(tmp_path: Path) -> None:
    repository = Path(__file__).resolve().parents[3]
    path = tmp_path / 'devices.xml'
    data = (repository / 'devices.xml').read_bytes()
    path.write_bytes(data)
    PoseEditor(parsed(path)).save('kinect', Pose((-0.53, 0.1, 1.9), (0.0, 1.55, 0.0)))
    assert path.read_bytes() == data.replace(b'xyz="-0.53 0.09 1.90"', b'xyz="-0.53 0.1 1.90"')


@pytest.mark.parametrize('before, after', [
    ('<v>\n  <device type="robot" name="a">\n      <base frame="f"/>\n  </device>\n</v>',
     '<v>\n  <device type="robot" name="a">\n      {}\n      <base frame="f"/>\n  </device>\n</v>'),
    ('<v>\r\n<device type="robot"\r\n name="a"> <!-- the left one -->\r\n<!-- its place -->\r\n'
     '\t<base frame="f"/></device>\r\n</v>',
     '<v>\r\n<device type="robot"\r\n name="a"> <!-- the left one -->\r\n  {}\r\n'
     '<!-- its place -->\r\n\t<base frame="f"/></device>\r\n</v>'),
    ('<v>\r\n<device type="robot" name="a">\r\n    <base frame="f"/></device>\r\n</v>',
     '<v>\r\n<device type="robot" name="a">\r\n    {}\r\n    <base frame="f"/></device>\r\n</v>'),
    ('<v><device type="robot" name="a"/></v>', '<v><device type="robot" name="a">{}</device></v>'),
    ('<v><device type="robot" name="a"><base frame="f"/></device></v>',
     '<v><device type="robot" name="a">{}<base frame="f"/></device></v>')])
def test_a_tool_is_added_and_nothing_else_changes(tmp_path: Path, before: str, after: str
                                                  ) -> None:
    before, after = (text.replace('v>', 'visualizer>') for text in (before, after))
    path = written(tmp_path, before)
    editor = PoseEditor(parsed(path))
    saved = editor.save_tool('a', 'tool0', ZERO)
    assert path.read_bytes().decode() == after.format('<tool frame="tool0" />')
    tool = parsed(path).device('a').tool
    assert tool is not None and (tool.frame, tool.pose) == ('tool0', ZERO)
    editor.revert(saved)
    editor.save_tool('a', 'hand', POSE)
    tool = parsed(path).device('a').tool
    assert tool is not None and (tool.frame, tool.pose) == ('hand', POSE)


@pytest.mark.parametrize('text, problem', [
    ('<device type="robot" name="a"><tool frame="t"/></device>', 'has a <tool>'),
    ('<device type="robot" name="a"></device><device type="robot" name="b"></device>',
     'several devices')])
def test_a_tool_that_is_not_added(tmp_path: Path, text: str, problem: str) -> None:
    path = written(tmp_path, f'<visualizer>{text}</visualizer>')
    with pytest.raises(PoseEditError, match=problem):
        PoseEditor(parsed(path)).save_tool('a', 'tool0', ZERO)
    assert path.read_text() == f'<visualizer>{text}</visualizer>'


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16', 'latin-1'])
@pytest.mark.parametrize('end', ['</v>', '</v >\n', '</v\t><!-- </v> -->', '</v><?v </v>?>'])
def test_an_element_is_added_at_the_end_of_the_root(end: str, encoding: str) -> None:
    head = f'<?xml version="1.0" encoding="{encoding.replace("-sig", "")}"?>\n<v>\n'
    before = f'{head}<!-- </v> --><a><![CDATA[</v>]]>ü</a>\n{end}'.encode(encoding)
    after = with_last(before, '  <b name="é"/>\n').decode(encoding)
    assert after == before.decode(encoding).replace(f'\n{end}', f'\n  <b name="é"/>\n{end}')


def test_a_letter_that_the_encoding_does_not_have_is_written_as_a_number() -> None:
    head = '<?xml version="1.0" encoding="latin-1"?>'
    assert with_last(f'{head}<v></v>'.encode(), '<b name="λ"/>') == \
        f'{head}<v><b name="&#955;"/></v>'.encode()


@pytest.mark.parametrize('text', ['<v/>', '<v />', '<v></w>', ''])
def test_a_root_without_an_end_gets_no_element(text: str) -> None:
    with pytest.raises(ValueError, match='no end tag|not well-formed'):
        with_last(text.encode(), '<b/>')
