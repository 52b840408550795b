# SPDX-License-Identifier: BSD-3-Clause
"""Marks in the bag and next to it; the configuration that a bag contains."""
from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any, Sequence

import pytest
import rosbag
from genpy import Time
from std_msgs.msg import String, UInt32

from process_visualizer.bagio import marks
from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.marks import (
    Mark,
    add_mark,
    added_marks,
    mark_at,
    marks_path,
    read_marks,
)
from process_visualizer.bagio.recorder_topics import (
    ACCOUNT,
    CONFIGURATION,
    MARKS,
    recorded_configuration,
)
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import as_json, as_text, make_report
from process_visualizer.cell.stored_configuration import (
    StoredConfiguration,
    configuration_text,
    write_configuration,
)
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main


def bag_with(path: Path, topic: str, *texts: str) -> str:
    """A bag with a text every second."""
    with rosbag.Bag(str(path), 'w') as bag:
        for second, text in enumerate(texts, 1):
            bag.write(topic, String(text), Time(second, 0))
    return str(path)


def test_marks_of_the_bag_and_added_ones(tmp_path: Path) -> None:
    bag = bag_with(tmp_path / 'a.bag', MARKS, 'one', 'zwei ü')
    before = Path(bag).read_bytes()
    add_mark(bag, Mark(1_500_000_000, 'between'))
    add_mark(bag, Mark(0, 'first'))
    with Recording([bag]) as recording:
        assert [mark.label for mark in read_marks(recording)] == [
            'first', 'one', 'between', 'zwei ü']
    assert Path(bag).read_bytes() == before


def test_a_mark_by_the_command_is_within_the_bag(tmp_path: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    bag = bag_with(tmp_path / 'a.bag', '/a', 'x', 'y', 'z')
    assert main(['mark', bag, '1.5', 'thread breaks']) == 0
    for position in ('2.1', '-0.1', 'nan'):
        assert main(['mark', bag, position, 'nowhere']) == 1
        assert 'a.bag goes from 0 to 2.000 s' in capsys.readouterr().err
    assert added_marks(bag) == [Mark(2_500_000_000, 'thread breaks')]
    assert main(['mark', bag, '2', 'x:=y']) == 0
    assert added_marks(bag)[1] == Mark(3_000_000_000, 'x:=y')


def test_the_last_mark_at_a_time() -> None:
    marks = [Mark(10, 'a'), Mark(20, 'b'), Mark(20, 'c')]
    found = [mark_at(marks, time_ns) for time_ns in (9, 10, 19, 20, 99)]
    assert [mark and mark.label for mark in found] == [None, 'a', 'a', 'c', 'c']


@pytest.mark.parametrize('text', [
    '', '{}x', '[{"label": "a"}]', '[3]', '3', pytest.param('[' * 100_000, id='deep'),
    *(f'[{{"time_ns": {time_ns}, "label": "a"}}]' for time_ns in (
        'Infinity', 'NaN', '1e400', '-1', '"1"', 'true', '1' + '0' * 400)),
    '[{"time_ns": 1, "label": ["a"]}]', '[{"time_ns": 1, "label": "\\ud800"}]'])
def test_a_broken_file_of_marks_is_named_and_kept(tmp_path: Path, text: str) -> None:
    bag = str(tmp_path / 'a.bag')
    Path(marks_path(bag)).write_text(text)
    with pytest.raises(BagError, match='a.bag.marks.json'):
        add_mark(bag, Mark(0, 'x'))
    assert Path(marks_path(bag)).read_text() == text


def test_marks_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(BagError, match='cannot be written'):
        add_mark(str(tmp_path / 'no' / 'a.bag'), Mark(0, 'x'))
    assert added_marks(str(tmp_path / 'no' / 'a.bag')) == []


def test_a_configuration_comes_back_with_the_files_it_names(tmp_path: Path) -> None:
    files = {'cell.xml': '<visualizer><arg name="a"/><include file="parts/robot.xml"/></visualizer>'
                         '<!-- Näher -->'.encode(),
             'parts/robot.xml': '<?xml version="1.0" encoding="iso-8859-1"?>\r\n<visualizer>'
                                '<device type="other" name="x"><!-- Näher -->'
                                '<model path="models/x.urdf" /></device></visualizer>'
                                .encode('latin-1'),
             'parts/models/x.urdf': b'<robot name="x"><link name="y" /></robot>'}
    for name, content in files.items():
        path = tmp_path / 'was' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    text = configuration_text(XmlParser({'a': '1'}).parse(str(tmp_path / 'was' / 'cell.xml')))
    with Recording([bag_with(tmp_path / 'a.bag', CONFIGURATION, text)]) as recording:
        stored = recorded_configuration(recording)
    assert stored is not None and stored.arguments == {'a': '1'}
    main = write_configuration(stored, str(tmp_path / 'is'))
    assert main == str(tmp_path / 'is' / 'cell.xml')
    for name, content in files.items():
        assert (tmp_path / 'is' / name).read_bytes() == content
    with pytest.raises(FileExistsError):
        write_configuration(stored, str(tmp_path / 'is'))


def test_paths_of_a_bag_cannot_leave_the_folder(tmp_path: Path) -> None:
    text = json.dumps({'file': '/a/b/../../../x.xml', 'arguments': {},
                       'files': {'/a/b/../../../x.xml': '', '/a/../../y.xml': ''}})
    with Recording([bag_with(tmp_path / 'a.bag', CONFIGURATION, text)]) as recording:
        stored = recorded_configuration(recording)
    assert stored is not None
    write_configuration(stored, str(tmp_path / 'is'))
    assert {path.name for path in (tmp_path / 'is').iterdir()} == {'x.xml', 'y.xml'}


def stored_files(folder: Path, names: Sequence[str]) -> StoredConfiguration:
    """The stored configuration of a bag, with empty files of these names; the first is its cell."""
    text = json.dumps({'file': names[0], 'arguments': {}, 'files': dict.fromkeys(names, '')})
    with Recording([bag_with(folder / 'a.bag', CONFIGURATION, text)]) as recording:
        stored = recorded_configuration(recording)
    assert stored is not None
    return stored


def test_a_configuration_of_a_bag_is_not_written_into_a_hidden_folder(tmp_path: Path) -> None:
    """The desktop would read a file in ~/.config in the home folder and run commands from it."""
    stored = stored_files(tmp_path, ('/h/cell.xml', '/h/.config/openbox/menu.xml'))
    with pytest.raises(OSError, match='hidden folder'):
        write_configuration(stored, str(tmp_path / 'is'))
    assert not (tmp_path / 'is').exists()


def test_a_configuration_may_be_recorded_from_a_hidden_folder(tmp_path: Path) -> None:
    stored = stored_files(tmp_path, ('/h/.cells/cell.xml', '/h/.cells/parts/a.xml'))
    assert write_configuration(stored, str(tmp_path / 'is')) == str(tmp_path / 'is' / 'cell.xml')


def configuration_with(file: str = '/a', text: object = '') -> str:
    return json.dumps({'file': file, 'files': {file: text}, 'arguments': {}})


@pytest.mark.parametrize('text', [
    '', '[]', '{}', '{"file": 1, "files": {}, "arguments": {}}',
    json.dumps({'file': '/0.xml', 'arguments': {},
                'files': {f'/{number}.xml': '' for number in range(1001)}}),
    '{"file": "/a", "files": 3, "arguments": {}}', pytest.param('{"a":' * 100_000, id='deep'),
    configuration_with('/a\0'),
    configuration_with(text='\ud800'), configuration_with('/\ud800'), configuration_with(text=[3])])
def test_a_configuration_that_is_none(tmp_path: Path, text: str) -> None:
    path = bag_with(tmp_path / 'a.bag', CONFIGURATION, text)
    with Recording([path]) as recording:
        assert recorded_configuration(recording) is None
        (gap,) = recording.gaps
    assert (gap.file, gap.topics) == (path, (CONFIGURATION,))
    assert 'it is not a configuration' in gap.reason
    assert read_catalog([path]).problems == (str(gap),)


def bag_with_bytes(path: Path, topic: str, data: bytes, kind: Any = String) -> str:
    """A bag with a message of invalid bytes, and a valid one on another topic."""
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/good', String('x'), Time(1, 0))
        bag.write(topic, (kind._type, data, kind._md5sum, kind), Time(2, 0), raw=True)
    return str(path)


@pytest.mark.parametrize('topic', [MARKS, CONFIGURATION, ACCOUNT])
@pytest.mark.parametrize('data, kind', [
    (b'', String), (b'abc', String), (b'\xff\xff\xff\xff', String), (b'\5\0\0\0abc', String),
    (b'\1\0\0\0abc', String), (bytes(4), UInt32), (b'\1\0\0\0' + b'[', String)])
def test_odd_messages_of_the_recorder_s_topics_are_told_and_left_out(
        tmp_path: Path, topic: str, data: bytes, kind: Any) -> None:
    path = bag_with_bytes(tmp_path / 'a.bag', topic, data, kind)
    with Recording([path]) as recording:
        report = make_report(recording)
        recorded_configuration(recording)
        damage = [str(gap) for gap in recording.gaps]
    is_good = topic == MARKS and data.endswith(b'[')
    assert [(path in text, topic in text) for text in damage] == [(True, True)] * (not is_good)
    assert as_text(report) and as_json(report)
    catalog = read_catalog([path])
    assert catalog.topic_names == ('/good',)
    assert len(catalog.problems) == (not is_good and topic != ACCOUNT)


def test_many_odd_messages_are_told_once(tmp_path: Path) -> None:
    with Recording([bag_with(tmp_path / 'a.bag', ACCOUNT, *['x'] * 500)]) as recording:
        make_report(recording)
        assert len(recording.gaps) == 1


def test_a_mark_of_a_bag_on_a_read_only_disk_is_kept_by_the_user(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('XDG_DATA_HOME', str(tmp_path / 'data'))
    bag = str(tmp_path / 'a.bag')
    write = marks._write

    def refuse(path: str, added: Any) -> None:
        if path == marks_path(bag):
            raise OSError(errno.EROFS, 'Read-only file system')
        write(path, added)

    monkeypatch.setattr(marks, '_write', refuse)
    path = add_mark(bag, Mark(5, 'thread breaks'))
    assert path.startswith(str(tmp_path / 'data' / 'process_visualizer' / 'marks' / 'a.bag-'))
    add_mark(bag, Mark(7, 'seam ends'))
    assert added_marks(bag) == [Mark(5, 'thread breaks'), Mark(7, 'seam ends')]
    assert added_marks(str(tmp_path / 'other' / 'a.bag')) == []
