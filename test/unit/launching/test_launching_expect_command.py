# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell expect``: its output, the written file, and refusals."""
from __future__ import annotations

import queue
from pathlib import Path
from typing import Callable, List, Tuple

import pytest

from process_visualizer.commands import expect_command
from process_visualizer.commands.command_line import main
from process_visualizer.msg import DetectedObject, DetectedObjects

Run = Callable[..., Tuple[int, List[str], List[str]]]
CELL = ('<visualizer>\n  <device type="depth_sensor" name="kinect">\n'
        '    <topic name="c" type="pointcloud"/>\n    <objects warn="0.4" />\n  </device>\n'
        '</visualizer>\n')
ELEMENT = '<expected xyz="1 2 0.5" size="0.46 0.26 0.16" />'


def objects(*there: DetectedObject, frame: str = 'world') -> DetectedObjects:
    message = DetectedObjects(objects=list(there))
    message.header.frame_id = frame
    return message


def thing(number: int, **other: object) -> DetectedObject:
    made = DetectedObject(number=number, is_seen=True, is_confirmed=True, link='arm/hand',
                          distance=0.31)
    made.pose.position.x, made.pose.position.y, made.pose.position.z = 1.0, 2.0, 0.5
    made.pose.orientation.w = 1.0
    made.size.x, made.size.y, made.size.z = 0.4, 0.2, 0.1
    for name, value in other.items():
        setattr(made, name, value)
    return made


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / 'cell.xml'
    made.write_text(CELL)
    return made


@pytest.fixture
def expect(path: Path, capsys: pytest.CaptureFixture[str],
           monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the command with these sensor messages: exit code, lines of output and of errors."""
    def run(*arguments: str, sent: Tuple[DetectedObjects, ...] = ()) -> Tuple[
            int, List[str], List[str]]:
        monkeypatch.setattr(expect_command, '_listen', lambda _sensor: list(sent))
        code = main(['expect', str(path), *arguments])
        said = capsys.readouterr()
        return code, said.out.splitlines(), said.err.splitlines()
    return run


def test_it_prints_what_would_be_added(expect: Run, path: Path) -> None:
    assert expect('kinect', sent=(objects(thing(1), thing(2, is_seen=False)),)) == (0, [
        "object 1: 40 × 20 × 10 cm, 0.31 m from arm's hand", f'  {ELEMENT}',
        "left out: object 2 is hidden: 40 × 20 × 10 cm, 0.31 m from arm's hand",
        'dry run; --write adds it to the file'], [])
    assert path.read_text() == CELL


def test_it_writes(expect: Run, path: Path) -> None:
    code, lines, errors = expect('--write', 'kinect', sent=(objects(thing(1)),))
    assert (code, errors) == (0, [])
    assert lines[-1].startswith(f'{path}: 1 added; backup: {path}.bak. Restart kinect')
    assert path.read_text() == CELL.replace(
        '<objects warn="0.4" />', f'<objects warn="0.4">\n      {ELEMENT}\n    </objects>')
    assert Path(f'{path}.bak').read_text() == CELL
    assert expect('kinect', '--write', sent=(objects(thing(1)),))[1][-1] == (
        'kinect sees nothing that can be added')


@pytest.mark.parametrize('sensor, frame, problem', [
    ('kinec', 'world', 'no depth sensor "kinec" has <objects>; did you mean "kinect"?'),
    ('kinect', 'map', 'the objects are in the frame "map", and the global frame of the '
                      'configuration is "world"; name the configuration that runs')])
def test_it_refuses(expect: Run, path: Path, sensor: str, frame: str, problem: str) -> None:
    code, lines, errors = expect(sensor, '--write', sent=(objects(thing(1), frame=frame),))
    assert (code, lines) == (1, [])
    assert len(errors) == 1 and errors[0].startswith('cell: ') and errors[0].endswith(problem)
    assert path.read_text() == CELL


def test_a_cell_without_such_sensors(expect: Run, path: Path) -> None:
    path.write_text(CELL.replace('<objects warn="0.4" />', ''))
    assert expect('kinect')[2] == [f'cell: {path}: no depth sensor has <objects>']


def test_it_listens_for_a_while_after_the_first_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expect_command, 'LOOK_S', 0.0)
    sent: 'queue.Queue[DetectedObjects]' = queue.Queue()
    sent.put(objects())
    sent.put(objects(thing(1)))
    assert [len(it.objects) for it in expect_command._received(sent)] == [0, 1]
    monkeypatch.setattr(expect_command, 'START_S', 0.0)
    assert expect_command._received(sent) == []


def test_without_a_master(path: Path, capsys: pytest.CaptureFixture[str],
                          monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    assert main(['expect', str(path), 'kinect']) == 1
    assert capsys.readouterr().err == ('cell: there is no ROS master at http://localhost:1; start '
                                       'the cell first\n')
