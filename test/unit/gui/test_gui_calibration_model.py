# SPDX-License-Identifier: BSD-3-Clause
"""Moving and saving of base frames."""
from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any, Iterator, List, Tuple

import pytest
from held_tasks import wait_for_line
from recording_stand_in import HERE

from process_visualizer.cell.file_edit import PoseEditError, PoseEditor
from process_visualizer.cell.model import BaseFrame, Device, DeviceType, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.gui.cell.calibration_model import CalibrationModel
from process_visualizer.gui.toolkit.tasks import Tasks

IN_FILE = Pose((1.0, 2.0, 3.0), (0.1, 0.2, 0.3))


def device(name: str, pose: Pose = IN_FILE) -> Device:
    return Device(DeviceType.OTHER, name, HERE, base=BaseFrame(f'{name}/base', pose, HERE))


class Frames:
    """Stand-in for frame nodes that notes moves and saves; while ``gate`` is not set moves wait."""

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.gate.set()
        self.moves: List[Tuple[str, Any, Any]] = []
        self.saves: List[Tuple[str, Pose]] = []
        self.error: Any = None

    def move(self, frame: str, xyz: Any, ypr: Any) -> None:
        assert self.gate.wait(60)
        self.moves.append((frame, xyz, ypr))
        if self.error is not None:
            raise self.error

    def save(self, edited: str, pose: Pose) -> None:
        if self.error is not None:
            raise self.error
        self.saves.append((edited, pose))


@pytest.fixture
def frames() -> Frames:
    return Frames()


@pytest.fixture
def tasks(qtbot) -> Iterator[Tasks]:
    lines = Tasks()
    yield lines
    lines.close()


@pytest.fixture
def model(frames: Frames, tasks: Tasks) -> CalibrationModel:
    calibration = CalibrationModel(tasks, frames.move)
    assert not calibration.can_save
    calibration.set_save(frames.save)
    calibration.set_devices([device('a'), Device(DeviceType.OTHER, 'floor', HERE), device('b')])
    calibration.set_running(True)
    return calibration


def test_only_what_has_a_base_frame_is_there(model):
    assert model.devices == ['a', 'b'] and model.device == 'a' and model.pose == IN_FILE
    model.choose('floor')
    assert model.device == 'a'


def test_the_chosen_device_is_the_same_after_another_configuration(model):
    model.choose('b')
    model.set_devices([device('other')])
    assert model.device == 'other'
    model.set_devices([device('a'), device('b')])
    assert model.device == 'b'


def test_a_number_moves_the_frame_and_leaves_the_others_exact(model, frames, qtbot):
    model.set_value(4, 0.25)
    qtbot.waitUntil(lambda: len(frames.moves) == 1)
    assert frames.moves == [('a/base', (1.0, 2.0, 3.0), (0.1, 0.25, 0.3))]
    assert model.is_unsaved and model.unsaved == ['a']


def test_only_the_newest_pose_waits(model, frames, tasks, qtbot):
    frames.gate.clear()
    for step in range(100):
        model.set_value(0, 1.0 + 0.01 * step)
    frames.gate.set()
    qtbot.waitUntil(lambda: len(frames.moves) == 2)
    wait_for_line(tasks, 'calibration', qtbot)
    assert [move[1][0] for move in frames.moves] == pytest.approx([1.01, 1.99])


def test_revert(model, frames, qtbot):
    model.set_value(0, 5.0)
    model.revert()
    assert not model.is_unsaved and model.pose == IN_FILE
    qtbot.waitUntil(lambda: frames.moves[-1:] == [('a/base', IN_FILE.xyz, IN_FILE.ypr)])


def test_edits_of_several_devices_are_kept_apart(model):
    model.set_value(0, 5.0)
    model.choose('b')
    assert model.pose == IN_FILE and not model.is_unsaved
    model.set_value(1, 6.0)
    assert model.unsaved == ['a', 'b']
    model.choose('a')
    assert model.pose.xyz == (5.0, 2.0, 3.0)


def test_save(model, frames, qtbot):
    model.set_value(0, 5.0)
    with qtbot.waitSignal(model.saved) as signal:
        model.save()
        assert model.is_saving and not model.can_save
    assert signal.args == ['a'] and frames.saves == [('a', Pose((5.0, 2.0, 3.0), IN_FILE.ypr))]
    assert not model.is_unsaved and model.pose.xyz == (5.0, 2.0, 3.0)
    model.revert()
    assert model.pose.xyz == (5.0, 2.0, 3.0)


def test_what_is_edited_while_it_is_saved_stays_unsaved(model, qtbot):
    model.set_value(0, 5.0)
    with qtbot.waitSignal(model.saved):
        model.save()
        model.set_value(0, 6.0)
    assert model.is_unsaved and model.pose.xyz[0] == 6.0


@pytest.mark.parametrize('error', [PermissionError(13, 'Permission denied', 'cell.xml'),
                                   PoseEditError('cell.xml has been changed')])
def test_a_save_that_fails_loses_nothing(model, frames, qtbot, error):
    model.set_value(0, 5.0)
    qtbot.waitUntil(lambda: len(frames.moves) == 1)
    frames.error = error
    with qtbot.waitSignal(model.failed) as signal:
        model.save()
    assert 'the pose of a was not saved' in signal.args[0] and 'cell.xml' in signal.args[0]
    assert model.is_unsaved and model.can_save


def test_a_move_that_fails_is_told(model, frames, qtbot):
    frames.error = RuntimeError('/cell_frames does not answer')
    with qtbot.waitSignal(model.failed) as signal:
        model.set_value(0, 5.0)
    assert signal.args == [
        'the base frame of a was not moved: /cell_frames does not answer']


def test_nothing_runs(model, frames, qtbot):
    model.set_value(0, 5.0)
    qtbot.waitUntil(lambda: len(frames.moves) == 1)
    model.set_running(False)
    assert 'Launch' in model.blocked_reason and model.can_save
    model.set_running(True)  # the nodes start with the values of the file
    qtbot.waitUntil(lambda: len(frames.moves) == 2)
    assert frames.moves[1][1][0] == 5.0


def test_the_marker(model, frames, qtbot):
    wanted: List[bool] = []
    moved: List[Tuple[str, Pose]] = []
    model.marker_wanted.connect(wanted.append)
    model.moved.connect(lambda frame, pose: moved.append((frame, pose)))
    model.take_pose((9.0, 9.0, 9.0), (0.0, 0.0, 0.0))  # no marker is shown
    assert not model.is_unsaved
    model.show_marker(True)
    model.take_pose((2.0, 2.0, 2.0), (0.0, 0.0, 0.0))
    assert model.pose == Pose((2.0, 2.0, 2.0)) and moved == []
    qtbot.waitUntil(lambda: frames.moves == [('a/base', (2.0, 2.0, 2.0), (0.0, 0.0, 0.0))])
    model.set_value(0, 3.0)
    assert moved == [('a/base', Pose((3.0, 2.0, 2.0)))]
    model.choose('b')
    model.set_running(False)
    assert wanted == [True, False, True, False] and not model.has_marker


def test_the_configuration_is_read_again(model):
    model.set_value(0, 5.0)
    model.choose('b')
    model.set_value(0, 7.0)
    model.set_devices([device('a', replace(IN_FILE, xyz=(5.0, 2.0, 3.0))), device('b')])
    assert model.unsaved == ['b'] and model.device == 'b' and model.pose.xyz[0] == 7.0
    model.set_devices([device('a')])
    assert model.device == 'a' and model.unsaved == []
    model.set_devices([])
    assert model.device == '' and model.blocked_reason and model.pose == Pose()


def test_the_file_gets_the_numbers(model, tmp_path, qtbot):
    path = tmp_path / 'cell.xml'
    path.write_text('<visualizer>  <!-- measured in May -->\n'
                    '<device type="other" name="a"><base frame="b" xyz="1 2 3" /></device>\n'
                    '</visualizer>')
    cell = XmlParser().parse(str(path))
    model.set_devices(cell.devices)
    model.set_save(PoseEditor(cell).save)
    model.set_value(0, 1.0123456789)
    with qtbot.waitSignal(model.saved):
        model.save()
    assert 'xyz="1.012346 2 3"' in path.read_text() and 'measured in May' in path.read_text()
    model.set_devices(XmlParser().parse(str(path)).devices)
    assert not model.is_unsaved and model.pose.xyz[0] == 1.012346
