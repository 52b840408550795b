# SPDX-License-Identifier: BSD-3-Clause
"""Every wrong file gets its messages, with file and line, all at once."""
import os
from pathlib import Path
from typing import Callable, List

import pytest
from bad_input import BAD_INPUT, Bad
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.xml_parser import XmlParser

Problems = Callable[..., List[str]]
MAX_LINE = 500


def messages(path: Path) -> List[str]:
    """The problems of the file, with paths relative to its folder."""
    with pytest.raises(ConfigurationError) as caught:
        XmlParser().parse(str(path))
    return [line.replace(f'{path.parent}/', '') for line in str(caught.value).splitlines()]


@pytest.mark.parametrize('bad', BAD_INPUT, ids=lambda bad: bad.name)
def test_table(bad: Bad, problems: Problems) -> None:
    lines = problems(bad.text)
    for line, expected in zip(lines, bad.problems):
        assert line.startswith(f'cell.xml:{expected}')
        assert len(line) < MAX_LINE
    assert len(lines) == len(bad.problems), lines


def test_missing_file(tmp_path: Path) -> None:
    (tmp_path / 'devices.xml').touch()
    assert messages(tmp_path / 'device.xml') == [
        'device.xml:1: there is no file "device.xml"; did you mean "devices.xml"?']


def test_missing_folder(tmp_path: Path) -> None:
    assert 'nor its folder' in messages(tmp_path / 'no' / 'a.xml')[0]


def test_folder(tmp_path: Path) -> None:
    assert messages(tmp_path)[0].endswith(':1: is a folder; name a file in it')


def test_pipe(tmp_path: Path) -> None:
    """Reading it would wait forever."""
    os.mkfifo(tmp_path / 'pipe.xml')
    assert messages(tmp_path / 'pipe.xml') == [
        'pipe.xml:1: is not a regular file; name an XML file']


def test_unreadable_file(tmp_path: Path) -> None:
    path = tmp_path / 'a.xml'
    path.symlink_to('a.xml')
    assert messages(path)[0].startswith('a.xml:1: ')


def test_too_large_file(tmp_path: Path) -> None:
    path = tmp_path / 'a.xml'
    with path.open('wb') as file:
        file.truncate(20_000_000)
    assert messages(path) == ['a.xml:1: is larger than 10 MB; this is not a configuration']


@pytest.mark.parametrize('content, expected', [
    (b'<visualizer>\0</visualizer>', '1: not well-formed XML'),
    (b'\0' * 100, '1: not well-formed XML'),
    (b'\x7fELF\x02\x01\x01', '1: not well-formed XML'),
    ('<visualizer>\n<!-- ö --></visualizer>'.encode('latin-1'), '2: not well-formed XML'),
    (b'<?xml version="1.0" encoding="klingon"?>\n<visualizer/>', '1: '),
    (b'<?xml version="1.0" encoding="utf-7"?>\n<visualizer/>', '1: '),
    (b'<?xml version="1.0" encoding="shift_jis"?>\n<visualizer/>', '1: '),
], ids=['NUL', 'NULs', 'binary', 'not UTF-8', 'unknown encoding', 'utf-7', 'multi-byte'])
def test_bytes(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / 'cell.xml'
    path.write_bytes(content)
    lines = messages(path)
    assert len(lines) == 1 and lines[0].startswith(f'cell.xml:{expected}')


@pytest.mark.parametrize('declarations, reference', [
    ('<!ENTITY x SYSTEM "file:///etc/passwd">', '&x;'),
    ('<!ENTITY x SYSTEM "http://localhost:1/x">', '&x;'),
    ('<!ENTITY a "ha">' + ''.join(f'<!ENTITY {name} "{f"&{previous};" * 10}">'
                                  for previous, name in zip('abcdefghij', 'bcdefghijk')),
     '&k;'),
    ('<!ENTITY % x SYSTEM "file:///etc/passwd"> %x;', ''),
    ('', '')], ids=['local file', 'network', 'billion laughs', 'parameter entity', 'nothing'])
def test_document_types_are_refused(problems: Problems, declarations: str,
                                    reference: str) -> None:
    assert problems(f'<?xml version="1.0"?>\n<!DOCTYPE visualizer [{declarations}]>\n'
                    f'<visualizer>{reference}</visualizer>') == [
        'cell.xml:2: a DOCTYPE declaration and its entities are not allowed; remove it']


def test_external_document_type(problems: Problems) -> None:
    assert 'DOCTYPE' in problems('<!DOCTYPE visualizer SYSTEM "x.dtd"><visualizer/>')[0]


@pytest.mark.parametrize('tag', ['property name="a"', 'rviz type="Group"', 'x'])
def test_deep_nesting(problems: Problems, tag: str) -> None:
    depth = 20_000
    lines = problems('<visualizer>\n' + f'<{tag}>\n' * depth + f'</{tag.split()[0]}>' * depth
                     + '</visualizer>')
    assert lines == ['cell.xml:51: elements are nested more than 50 deep']


def test_billion_laughs_of_arguments(problems: Problems) -> None:
    lines = ['<arg name="a0" value="ha"/>']
    lines += [f'<arg name="a{level}" value="{f"$(arg a{level - 1})" * 10}"/>'
              for level in range(1, 20)]
    text = '<visualizer>\n' + '\n'.join(lines) + '<device type="other" name="d"/></visualizer>'
    assert [line.split(' is longer')[1] for line in problems(text)] == [' than 65536 characters']


def test_values_for_arguments(problems: Problems) -> None:
    text = ('<visualizer>\n<arg name="speed" default="1"/>\n<arg name="fixed" value="1"/>\n'
            '<device type="other" name="$(arg speed)"/></visualizer>')
    assert problems(text, sped='2', fixed='3', speed='$( )') == [
        'cell.xml:1: <visualizer>: there is no argument "sped"; did you mean "speed"?',
        'cell.xml:3: <arg>: "fixed" has a fixed value and cannot be given another; write default '
        'instead of value',
        'cell.xml:4: <device>: attribute "name": "$(arg speed)": a value in it holds "$( )"; '
        'remove that']
    assert problems(text, speed='a b')[0].startswith('cell.xml:4: <device>: attribute "name": '
                                                     '"a b" is not a valid name')


class TestIncludes:
    """Problems of included files and of the inclusion itself."""

    @staticmethod
    def include(name: str, arguments: str = '') -> str:
        return f'<visualizer>\n<include file="{name}">{arguments}</include>\n</visualizer>'

    def test_missing(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'camera.xml').touch()
        assert problems(self.include('camra.xml')) == [
            'cell.xml:2: <include>: there is no file "camra.xml"; did you mean "camera.xml"?']

    def test_folder(self, problems: Problems) -> None:
        assert problems(self.include('.'))[0].endswith('is a folder; name a file in it')

    def test_broken(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer>\n<device></visualizer>')
        assert problems(self.include('a.xml')) == [
            'a.xml:2: not well-formed XML: mismatched tag (column 11)']

    def test_wrong_root(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<launch/>')
        assert problems(self.include('a.xml'))[0].startswith('a.xml:1: <launch>: a configuration')

    def test_problems_of_both_files(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer>\n\n\n<device/></visualizer>')
        lines = problems('<visualizer x="1">\n<include file="a.xml"/>\n<devise/></visualizer>')
        assert [line.split(': ')[0] for line in lines] == [
            'cell.xml:1', 'cell.xml:3', 'a.xml:4', 'a.xml:4']

    def test_cycle(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text(self.include('cell.xml'))
        assert problems(self.include('a.xml')) == [
            'a.xml:2: <include>: includes itself: cell.xml -> a.xml -> cell.xml']

    def test_cycle_through_a_link(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'here').symlink_to('.')
        assert 'includes itself' in problems(self.include('here/cell.xml'))[0]

    def test_files_that_multiply(self, problems: Problems, tmp_path: Path) -> None:
        for level in range(20):
            twice = f'<include file="{level + 1}.xml"/>\n' * 2
            (tmp_path / f'{level}.xml').write_text(f'<visualizer>{twice}</visualizer>')
        (tmp_path / '20.xml').write_text('<visualizer/>')
        lines = problems(self.include('0.xml'))
        assert 'is one of more than 100 includes' in lines[0]

    def test_two_global_frames(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer frame="map"/>')
        assert problems('<visualizer frame="world"><include file="a.xml"/></visualizer>') == [
            'a.xml:1: <visualizer>: the global frame is already "world", not "map"; write the '
            'same name']

    def test_duplicate_names(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer>\n<device type="other" name="d"/>'
                                        '</visualizer>')
        assert problems('<visualizer><include file="a.xml"/><device type="robot" name="d"/>'
                        '</visualizer>') == [
            'cell.xml:1: <device>: a device named "d" already exists (a.xml:2); choose another '
            'name']

    def test_arguments(self, problems: Problems, tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer>\n<arg name="needed"/></visualizer>')
        assert problems(self.include('a.xml', '\n<arg name="neded" value="1"/>')) == [
            'cell.xml:3: <arg>: there is no argument "neded"; did you mean "needed"?',
            'a.xml:2: <arg>: no value for "needed"; give needed:=… or a default']

    def test_arguments_of_the_command_line_stay_outside(self, problems: Problems,
                                                        tmp_path: Path) -> None:
        (tmp_path / 'a.xml').write_text('<visualizer><arg name="x"/></visualizer>')
        assert 'no value for "x"' in '\n'.join(problems(
            '<visualizer><arg name="x"/><include file="a.xml"/></visualizer>', x='1'))


def test_problems_of_a_broken_argument_are_not_repeated(problems: Problems) -> None:
    assert problems('<visualizer>\n<arg name="x" default="$(arg y)"/>\n'
                    '<arg name="z" default="$(arg x)"/>\n'
                    '<device type="other" name="$(arg z)"><base frame="$(arg x)"/></device>'
                    '</visualizer>') == [
        'cell.xml:2: <arg>: attribute "default": "$(arg y)": there is no argument "y"; no <arg> '
        'is declared']


@settings(max_examples=150)
@given(st.one_of(
    st.binary(max_size=200),
    st.lists(st.sampled_from([
        '<visualizer>', '</visualizer>', '<device type="other" name="a">', '</device>', '<arg ',
        'name="', '$(arg x)', '$(', ')', '"', '/>', '<base frame="f"/>', '&#0;', '<![CDATA[',
        ']]>', '<?pi ?>', '<!--', '-->', '<include file="', '\n', 'xmlns="a"', '&amp;',
    ]), max_size=15).map(lambda parts: ''.join(parts).encode())))
def test_nothing_but_problems_is_raised(tmp_path_factory: pytest.TempPathFactory,
                                        content: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / 'fuzz.xml'
    path.write_bytes(content)
    try:
        XmlParser().parse(str(path))
    except ConfigurationError as error:
        assert all(problem.location.line >= 1 and problem.message for problem in error.problems)
