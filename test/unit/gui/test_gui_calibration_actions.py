# SPDX-License-Identifier: BSD-3-Clause
"""Calibration within the program: restarted frame nodes, paused playback, the open recording."""
from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, List

import pytest
import rosbag
from genpy import Time
from playback_stand import PAUSED
from std_msgs.msg import Float64
from test_gui_launcher import config, launcher, loaded, run  # noqa: F401, fixtures

from process_visualizer.bagio.recording_calibration import save_pose
from process_visualizer.cell.model import Mode, Pose
from process_visualizer.clients.player_client import PlayerError
from process_visualizer.generate.plan import FRAMES_PART
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.launching.part_report import PartState

IN_FILE, SAVED = (1.0, 0.0, 0.0), (3.0, 0.0, 0.0)


@pytest.fixture
def moves(loaded: Launcher, monkeypatch: pytest.MonkeyPatch) -> List[Any]:  # noqa: F811
    """The requested moves of frames: name, xyz, ypr."""
    told: List[Any] = []
    monkeypatch.setattr(loaded.link, 'move_frame', lambda *words: told.append(words))
    return told


@pytest.fixture
def bag(tmp_path: Path) -> str:
    path = str(tmp_path / 'seam.bag')
    with rosbag.Bag(path, 'w') as recording:
        for second in (1, 2):
            recording.write('/a', Float64(1.0), Time(second))
    save_pose(path, 'oven', Pose(SAVED))
    return path


def report(program: Launcher, state: PartState) -> None:
    part: Any = SimpleNamespace(part='frames', state=state, nodes=())
    program.launch.reports[FRAMES_PART] = part
    program.launch.changed.emit()


def test_frames_that_are_restarted_get_the_unsaved_pose(loaded, moves, qtbot):  # noqa: F811
    run(loaded)
    report(loaded, PartState.RUNNING)
    loaded.calibration.set_value(0, 1.5)
    qtbot.waitUntil(lambda: len(moves) == 1)
    report(loaded, PartState.STARTING)
    assert loaded.calibration.blocked_reason
    report(loaded, PartState.RUNNING)
    qtbot.waitUntil(lambda: len(moves) == 2)
    assert moves[0] == moves[1] == ('oven', (1.5, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_a_paused_player_shows_its_scene_again(loaded, moves, qtbot, monkeypatch):  # noqa: F811
    monkeypatch.setattr(loaded.link.player, 'repeat', lambda: moves.append('repeat'))
    loaded.calibration.set_running(True)
    loaded.calibration.set_value(0, 1.5)
    qtbot.waitUntil(lambda: len(moves) == 1)
    loaded.session.take_player(PAUSED)
    loaded.calibration.set_value(0, 1.6)
    qtbot.waitUntil(lambda: len(moves) == 3)
    loaded.session.take_player(PAUSED._replace(paused=False))
    loaded.calibration.set_value(0, 1.7)
    qtbot.waitUntil(lambda: len(moves) == 4)
    assert moves.index('repeat') == 2 and moves.count('repeat') == 1


def test_a_player_that_does_not_answer_is_told(loaded, moves, qtbot, monkeypatch):  # noqa: F811
    def refuse() -> str:
        raise PlayerError('gone')

    monkeypatch.setattr(loaded.link.player, 'repeat', refuse)
    loaded.calibration.set_running(True)
    loaded.session.take_player(PAUSED)
    with qtbot.waitSignal(loaded.failed) as told:
        loaded.calibration.set_value(0, 1.5)
    assert 'its picture stays as it was: gone' in told.args[0]


def test_what_is_saved_for_a_recording_counts_in_playback_only(loaded, bag, qtbot):  # noqa: F811
    calibration = loaded.calibration
    with qtbot.waitSignal(loaded.calibrating.recording.changed):
        loaded.bag.open([bag])
    qtbot.waitUntil(lambda: loaded.calibrating.recording.value is not None)
    assert calibration.pose.xyz == IN_FILE and calibration.recording == ''
    loaded.session.set_mode(Mode.PLAYBACK)
    assert calibration.pose.xyz == SAVED and not calibration.is_unsaved
    calibration.take_file()
    with qtbot.waitSignal(calibration.kept):
        calibration.save_for_recording()
    loaded.session.set_mode(Mode.REALTIME)
    loaded.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(lambda: not loaded.calibrating.recording.value.saved)
    assert calibration.pose.xyz == IN_FILE and not calibration.is_unsaved


def test_a_damaged_file_beside_the_recording_is_told(loaded, bag, qtbot):  # noqa: F811
    Path(f'{bag}.calibration.json').write_text('{')
    with qtbot.waitSignal(loaded.failed) as told:
        loaded.bag.open([bag])
    assert 'calibration.json' in told.args[0] and 'the poses in the configuration' in told.args[0]
