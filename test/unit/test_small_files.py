# SPDX-License-Identifier: BSD-3-Clause
"""Other file types in place of settings and state files: they are reported, and not opened."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Callable, Dict

import pytest

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.marks import Mark, add_mark, added_marks, marks_path
from process_visualizer.bagio.recording_calibration import calibration_path, saved_poses
from process_visualizer.cell.trust import set_trusted, trust_file, trusted_packages
from process_visualizer.commands.command_line import main
from process_visualizer.launching import run_record
from process_visualizer.rviz.views import SavedViewError, SavedViews, read_view
from process_visualizer.whole_file import MAX_SMALL_BYTES, small_file, write_small_file


def _huge(path: Path) -> None:
    with path.open('wb') as file:
        file.truncate(1 << 40)  # nothing of it is on the disk


IN_ITS_PLACE: Dict[str, Callable[[Path], None]] = {
    'a pipe': os.mkfifo,
    'a device': lambda path: path.symlink_to('/dev/zero'),
    'a folder': Path.mkdir,
    'a huge file': _huge,
}


@pytest.fixture(params=IN_ITS_PLACE)
def put(request: pytest.FixtureRequest, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    """Puts something else in the place of a file; the user's folders belong to the test."""
    for variable in ('XDG_CONFIG_HOME', 'XDG_DATA_HOME', 'ROS_HOME'):
        monkeypatch.setenv(variable, str(tmp_path))

    def put_there(path: str) -> str:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        IN_ITS_PLACE[request.param](Path(path))
        return path
    return put_there


def test_the_list_of_trusted_packages(put: Callable[[str], str],
                                      capsys: pytest.CaptureFixture[str]) -> None:
    path = put(trust_file())
    for words in ([], ['rviz'], ['--remove', 'rviz']):
        assert main(['trust', *words]) == 1
        told = capsys.readouterr().err
        assert path in told and ('is not a regular file' in told or 'is larger than' in told)
    with pytest.raises(OSError):
        trusted_packages()
    with pytest.raises(OSError):
        set_trusted('rviz', True)


def test_marks_and_poses_beside_a_bag(put: Callable[[str], str], tmp_path: Path) -> None:
    bag = str(tmp_path / 'a.bag')
    path = put(marks_path(bag))
    with pytest.raises(BagError, match=path):
        added_marks(bag)
    with pytest.raises(BagError, match=path):
        add_mark(bag, Mark(1, 'a'))
    with pytest.raises(BagError, match=put(calibration_path(bag))):
        saved_poses(bag)


def test_views_of_rviz(put: Callable[[str], str], tmp_path: Path) -> None:
    views = SavedViews('cell.xml', ['arm'])
    put(str(views.folder / 'mine.rviz'))
    put(str(views.folder / 'chosen.txt'))
    assert views.chosen() is None
    with pytest.raises(SavedViewError, match='the view "mine" cannot be read: is '):
        views.load('mine')
    with pytest.raises(OSError):
        read_view(put(str(tmp_path / 'other.rviz')))


def test_the_record_of_a_run(put: Callable[[str], str], tmp_path: Path) -> None:
    put(str(tmp_path / 'process_visualizer' / 'runs' / 'a.json'))
    assert run_record.folder_of_run(1) == ''


def test_nothing_is_written_into_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(OSError, match='is not a regular file'):
        write_small_file(str(tmp_path / 'pipe'), b'a')


def test_a_list_that_is_no_text_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv('XDG_CONFIG_HOME', str(tmp_path))
    Path(trust_file()).parent.mkdir()
    Path(trust_file()).write_bytes(b'\xff\xfe')
    assert main(['trust']) == 1
    assert f'{trust_file()}: ' in capsys.readouterr().err


def test_a_record_nested_too_deeply_is_none(tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    folder = tmp_path / 'process_visualizer' / 'runs'
    folder.mkdir(parents=True)
    (folder / 'a.json').write_text('[' * 100_000)
    assert run_record.folder_of_run(1) == ''


def test_a_file_of_the_greatest_size_is_read(tmp_path: Path) -> None:
    path = str(tmp_path / 'file')
    write_small_file(path, json.dumps([1]).encode().ljust(MAX_SMALL_BYTES))
    assert json.loads(small_file(path)) == [1]


@pytest.mark.parametrize('name', ['針' * 85, b'\xff'.decode('utf-8', 'surrogateescape') * 255])
def test_a_file_with_the_longest_name_is_written(tmp_path: Path, name: str) -> None:
    path = str(tmp_path / name)
    write_small_file(path, b'a')
    assert small_file(path) == b'a' and os.listdir(tmp_path) == [name]
