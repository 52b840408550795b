# SPDX-License-Identifier: BSD-3-Clause
"""A recording is shown with another calibration: its own, one saved for it, or the file's."""
from __future__ import annotations

from pathlib import Path
from typing import Iterator, List

import pytest
from held_tasks import HeldTasks
from PyQt5.QtWidgets import QLabel, QPushButton
from test_gui_calibration_model import IN_FILE, Frames, device

from process_visualizer.bagio.recording_calibration import (
    RecordedFrame,
    RecordingCalibration,
    calibration_path,
    save_pose,
    saved_poses,
)
from process_visualizer.cell.model import DeviceType, Pose
from process_visualizer.clients.sensor_fit_client import FitError, SensorFit
from process_visualizer.gui.cell.calibration_model import CalibrationModel, FitModel
from process_visualizer.gui.cell.calibration_panel import CalibrationPanel
from process_visualizer.gui.toolkit.tasks import Tasks

THEN = Pose((1.02, 2.0, 3.0), IN_FILE.ypr)
SAVED = Pose((1.5, 2.0, 3.0), IN_FILE.ypr)
FITTED = Pose((1.02, 2.0, 3.0), (0.1, 0.2, 0.335))


class Finder:
    """Stand-in that finds what the test sets."""

    def __init__(self) -> None:
        self.answer: object = SensorFit(FITTED, 0.0327, 0.001, 2755, ('arm/link1',))
        self.asked: List[str] = []

    def find(self, name: str) -> SensorFit:
        self.asked.append(name)
        if isinstance(self.answer, SensorFit):
            return self.answer
        assert isinstance(self.answer, Exception)
        raise self.answer


@pytest.fixture
def tasks(qtbot) -> Iterator[Tasks]:
    found = Tasks()
    yield found
    found.close()


@pytest.fixture
def frames() -> Frames:
    return Frames()


@pytest.fixture
def model(tasks: Tasks, frames: Frames) -> CalibrationModel:
    calibration = CalibrationModel(tasks, frames.move)
    calibration.set_save(frames.save)
    sensor = device('a')
    calibration.set_devices([sensor.__class__(DeviceType.DEPTH_SENSOR, 'a', sensor.location,
                                              base=sensor.base), device('b')])
    calibration.set_running(True)
    return calibration


@pytest.fixture
def finder() -> Finder:
    return Finder()


@pytest.fixture
def fit(tasks: Tasks, model: CalibrationModel, finder: Finder) -> FitModel:
    return FitModel(tasks, model, finder.find)


@pytest.fixture
def panel(model: CalibrationModel, fit: FitModel, qtbot) -> CalibrationPanel:
    widget = CalibrationPanel(model, fit)
    qtbot.addWidget(widget)
    widget.show()
    return widget


def recording(folder: Path, name: str = 'seam.bag') -> RecordingCalibration:
    bag = str(folder / name)
    return RecordingCalibration(bag, {'a/base': RecordedFrame('world', THEN)}, saved_poses(bag))


def text(panel: CalibrationPanel, name: str) -> str:
    label = panel.findChild(QLabel, f'calibration_{name}')
    return label.text() if label.isVisible() else ''


def click(panel: CalibrationPanel, name: str) -> None:
    button = panel.findChild(QPushButton, f'calibration_{name}')
    assert button.isVisible() and button.isEnabled(), name
    button.click()


def poses(frames: Frames) -> List[Pose]:
    return [Pose(xyz, ypr) for _frame, xyz, ypr in frames.moves]


def test_the_file_counts_and_the_window_says_where_it_was_then(model, panel, tmp_path):
    assert text(panel, 'then') == '' and not panel.findChild(
        QPushButton, 'calibration_as_recorded').isVisible()
    model.set_recording(recording(tmp_path))
    assert model.pose == IN_FILE and not model.is_unsaved
    assert text(panel, 'then') == 'When seam.bag was recorded it was 20.0 mm and 0.00° from here.'
    model.choose('b')
    assert text(panel, 'then') == 'seam.bag does not say where it was then.'
    assert not panel.findChild(QPushButton, 'calibration_as_recorded').isEnabled()


def test_it_is_moved_to_where_it_was_and_saved_for_the_recording(model, panel, frames, qtbot,
                                                                 tmp_path):
    model.set_recording(recording(tmp_path))
    click(panel, 'as_recorded')
    assert model.is_unsaved and text(panel, 'then') == 'As when seam.bag was recorded.'
    qtbot.waitUntil(lambda: poses(frames) == [THEN])
    with qtbot.waitSignal(model.kept):
        click(panel, 'keep')
    assert not model.is_unsaved and model.pose == THEN and frames.saves == []
    assert saved_poses(model.recording) == {'a/base': THEN}
    assert text(panel, 'state') == 'As in what is saved for seam.bag.'


def test_what_is_saved_counts_when_the_recording_is_chosen_again(model, frames, qtbot, tmp_path):
    save_pose(str(tmp_path / 'seam.bag'), 'a/base', SAVED)
    model.set_recording(recording(tmp_path))
    assert model.pose == SAVED and not model.is_unsaved
    qtbot.waitUntil(lambda: poses(frames) == [SAVED])
    model.set_recording(recording(tmp_path, 'other.bag'))
    qtbot.waitUntil(lambda: poses(frames) == [SAVED, IN_FILE])
    model.set_recording(recording(tmp_path))
    model.set_recording(None)  # real time
    qtbot.waitUntil(lambda: poses(frames)[-1] == IN_FILE)
    assert model.pose == IN_FILE and not model.is_unsaved


def test_frames_that_start_again_get_what_counts(model, frames, qtbot, tmp_path):
    save_pose(str(tmp_path / 'seam.bag'), 'a/base', SAVED)
    model.set_recording(recording(tmp_path))
    qtbot.waitUntil(lambda: poses(frames) == [SAVED])
    model.set_running(False)
    model.set_running(True)
    qtbot.waitUntil(lambda: poses(frames) == [SAVED, SAVED])


def test_an_unsaved_pose_is_tried_on_another_recording(model, tmp_path):
    model.set_recording(recording(tmp_path))
    model.set_value(0, 7.0)
    model.set_recording(recording(tmp_path, 'other.bag'))
    assert model.pose.xyz[0] == 7.0 and model.is_unsaved
    model.revert()
    assert model.pose == IN_FILE


def test_the_pose_of_the_file_is_saved_by_forgetting_the_other(model, panel, qtbot, tmp_path):
    bag = str(tmp_path / 'seam.bag')
    save_pose(bag, 'a/base', SAVED)
    model.set_recording(recording(tmp_path))
    click(panel, 'as_file')
    assert model.is_unsaved and model.pose == IN_FILE
    with qtbot.waitSignal(model.kept):
        click(panel, 'keep')
    assert not Path(calibration_path(bag)).exists()
    assert not model.is_unsaved and not model.is_for_recording


def test_saving_into_the_file_ends_what_was_saved_for_the_recording(model, frames, qtbot,
                                                                    tmp_path):
    bag = str(tmp_path / 'seam.bag')
    save_pose(bag, 'a/base', SAVED)
    model.set_recording(recording(tmp_path))
    assert model.can_save  # it differs from the file
    with qtbot.waitSignal(model.kept):
        model.save()
    assert frames.saves == [('a', SAVED)] and saved_poses(bag) == {}
    assert model.pose == SAVED and not model.is_unsaved


def test_a_pose_that_cannot_be_saved_stays_unsaved(model, panel, qtbot, tmp_path):
    model.set_recording(recording(tmp_path))
    model.set_value(0, 7.0)
    Path(calibration_path(model.recording)).write_text('{')
    with qtbot.waitSignal(model.failed) as failed:
        click(panel, 'keep')
    assert 'calibration.json' in failed.args[0]
    assert model.is_unsaved and model.can_save_for_recording


def test_a_fit_is_an_unsaved_change_that_is_said_and_reverted(model, panel, fit, finder, frames,
                                                              qtbot):
    with qtbot.waitSignal(fit.changed):
        fit.fit()
    qtbot.waitUntil(lambda: not fit.is_fitting)
    assert finder.asked == ['a'] and model.pose == FITTED and model.is_unsaved
    assert text(panel, 'found') == (
        'Fit: moved by 20.0 mm and 2.01°; the cloud is 1.0 mm from the models (before: 32.7 mm; '
        '2\u2009755 points). It is not known where arm/link1 was.')
    assert text(panel, 'state').startswith('Unsaved: 20.0 mm and 2.01° from')
    qtbot.waitUntil(lambda: poses(frames) == [FITTED])
    model.revert()
    assert model.pose == IN_FILE and text(panel, 'found') == ''
    qtbot.waitUntil(lambda: poses(frames) == [FITTED, IN_FILE])


def test_a_refused_fit_says_why_and_changes_nothing(model, panel, fit, finder, frames, qtbot):
    finder.answer = FitError('nothing in view holds the sensor against a shift along x')
    fit.fit()
    qtbot.waitUntil(lambda: not fit.is_fitting)
    assert text(panel, 'found') == ('a stays where it is: nothing in view holds the sensor '
                                    'against a shift along x.')
    assert model.pose == IN_FILE and frames.moves == []
    finder.answer = SensorFit(FITTED, 0.01, 0.001, 500, ())
    fit.fit()
    qtbot.waitUntil(lambda: not fit.is_fitting)
    assert not fit.is_refused and model.pose == FITTED


def test_a_fit_is_offered_for_running_depth_sensors_only(model, fit, finder):
    assert fit.is_offered and fit.can_fit
    model.choose('b')
    assert not fit.is_offered and not fit.can_fit
    model.choose('a')
    model.set_running(False)
    assert fit.is_offered and not fit.can_fit
    fit.fit()
    assert finder.asked == [] and not fit.is_fitting


def test_a_fit_that_ends_after_the_nodes_changes_nothing(model, fit, qtbot):
    fit.fit()
    model.set_running(False)
    qtbot.waitUntil(lambda: not fit.is_fitting)
    assert model.pose == IN_FILE and fit.text == ''


@pytest.mark.parametrize('move', [
    lambda model: model.revert(),
    lambda model: model.set_value(0, 1.3),
    lambda model: model.set_devices([]),
    lambda model: (model.set_value(0, 1.3), model.set_pose('a', SAVED)),
])
def test_a_fit_of_a_sensor_that_was_moved_meanwhile_is_not_used(move, frames, finder, qtbot):
    tasks = HeldTasks()
    model = CalibrationModel(tasks, frames.move)
    sensor = device('a')
    model.set_devices([sensor.__class__(DeviceType.DEPTH_SENSOR, 'a', sensor.location,
                                        base=sensor.base)])
    model.set_running(True)
    model.set_pose('a', SAVED)
    fit = FitModel(tasks, model, finder.find)
    tasks.end_all()
    fit.fit()
    move(model)
    moved_to = model.value_of('a')
    tasks.end_all()
    assert model.value_of('a') == moved_to and not fit.is_fitting
    assert not fit.text or fit.is_refused
    assert (fit.text == 'a was moved during the fit, so the result is not used. '
            'Fit again.') == bool(model.devices)
