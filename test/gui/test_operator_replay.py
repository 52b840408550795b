# SPDX-License-Identifier: BSD-3-Clause
"""An operator looks back while the cell runs and is recorded, and returns to live."""
from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any, Iterator, List

import pytest
from operator_at_work import Operator, nodes, processes
from PyQt5.QtCore import QPoint, Qt
from surroundings import wait_until
from test_operator_session import launch, open_the_cell

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import Completeness, make_report
from process_visualizer.gui.live.live_timeline import LiveTimeline
from process_visualizer.gui.live.replay_model import ReplayModel, ReplayPhase
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.nodes.view_picture import save_picture

AMBER, MIN_AMBER = '#f5a623', 10000
BACK_S = 6.0


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_replay(operator: Operator, tmp_path: Path) -> None:
    open_the_cell(operator)
    launch(operator)
    replay = operator.launcher.replay
    wait_for_memory(operator)
    before = operator.beside(nodes)
    begin_recording(operator, tmp_path)
    go_back(operator, replay)
    wait_for_band(operator, str(tmp_path / 'replay.png'), True)
    assert operator.beside(nodes) == before, 'the running cell knows nothing of it'
    look_around(operator, replay)
    move_the_live_scene(operator)
    play(operator, replay)
    press_in_replay(operator, 'Escape')
    operator.wait(lambda: replay.is_live, 'back to live')
    wait_for_band(operator, str(tmp_path / 'live.png'), False)
    running = processes('GUI_TEST_MARK')
    go_back(operator, replay, 2.0)
    anew = processes('GUI_TEST_MARK') - running
    assert {it for it in anew if 'bag_player' not in it and 'roslaunch_server' not in it} == set()
    operator.click('back_to_live')
    running = processes('GUI_TEST_MARK')
    go_back(operator, replay, 4.0)
    assert processes('GUI_TEST_MARK') <= running, 'everything is there'
    operator.click('back_to_live')
    end_recording(operator, tmp_path)
    operator.click('launch')
    operator.wait(lambda: operator.text('status') == 'Idle', 'everything has ended')
    operator.close()
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


def timeline_of(operator: Operator) -> LiveTimeline:
    return operator.widget('live_timeline', LiveTimeline)


def wait_for_memory(operator: Operator) -> None:
    live = operator.launcher.live
    operator.wait(lambda: live.window is not None and len(live.window.curves) > 4
                  and live.window.begin_s + live.window.duration_s > 2.0 * BACK_S, 'curves')


def begin_recording(operator: Operator, folder: Path) -> None:
    operator.launcher.recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'ready to record')
    operator.click('record')
    operator.wait(lambda: 'Recording' in operator.text('status'), 'recording')


def end_recording(operator: Operator, folder: Path) -> None:
    """The recording has everything from the time of the replays."""
    operator.click('record')
    operator.wait(lambda: operator.launcher.recording.phase is RecordingPhase.IDLE, 'recorded')
    [path] = folder.glob('*.bag')
    assert operator.beside(lambda: completeness(path)) is Completeness.COMPLETE


def completeness(path: Path) -> Completeness:
    with Recording([str(path)]) as recording:
        return make_report(recording).completeness


def go_back(operator: Operator, replay: ReplayModel, ago_s: float = BACK_S) -> None:
    """Click into the past, and wait until RViz shows it."""
    timeline = timeline_of(operator)
    place = QPoint(int(timeline.axis.x(-ago_s)), 60)
    phases: List[ReplayPhase] = []
    note = replay.changed.connect(lambda: phases.append(replay.phase))
    operator.drag(timeline, place, [place])
    operator.wait(lambda: replay.phase is ReplayPhase.SHOWN, 'the replay is shown',
                  instead=operator.messages)
    replay.changed.disconnect(note)
    assert ReplayPhase.PREPARING in phases, 'where it is there already, only for a moment'
    shown_s = operator.window.live._end_s() + timeline.axis.time_s(place.x())
    operator.wait(lambda: abs(replay.time_s - shown_s) < 0.02
                  and replay.playback.state.sought is None, 'the past',
                  instead=lambda: f'{replay.time_s - shown_s:.3f} s away')


def look_around(operator: Operator, replay: ReplayModel) -> None:
    """Drag: the player follows the mouse."""
    timeline = timeline_of(operator)
    for back_s in (4.0, 7.0, 2.0, 9.0, 3.0):
        place = QPoint(int(timeline.axis.x(-back_s)), 60)
        wanted_s = operator.window.live._end_s() + timeline.axis.time_s(place.x())
        operator.drag(timeline, place, [place])
        operator.wait(lambda at_s=wanted_s: abs(replay.time_s - at_s) < 0.02  # type: ignore[misc]
                      and replay.playback.state.sought is None, 'the moment')


def move_the_live_scene(operator: Operator) -> None:
    """The window of the replay stays in front of RViz of the running cell."""
    live, past = operator.beside(rviz_windows)
    operator.beside(lambda: xdotool('windowsize', live, '900', '500',
                                    'windowmove', live, '120', '90'))
    operator.beside(lambda: wait_until(lambda: place_of(past) == place_of(live)
                                       == [120, 90, 900, 500], 'both are there',
                                       instead=lambda: place_of(past)))


def rviz_windows() -> List[str]:
    """Return the windows of the running cell and of the replay: the older one first."""
    found = xdotool('search', '--onlyvisible', '--name', 'RViz$').split()
    started = {it: Path(f'/proc/{xdotool("getwindowpid", it).strip()}/stat').read_text()
               .rpartition(')')[2].split()[19] for it in found}
    return sorted(found, key=lambda it: int(started[it]))


def place_of(window: str) -> List[int]:
    """Return x, y, width and height [px]."""
    text = xdotool('getwindowgeometry', '--shell', window)
    values = dict(line.split('=') for line in text.split())
    return [int(values[name]) for name in ('X', 'Y', 'WIDTH', 'HEIGHT')]


def xdotool(*words: str) -> str:
    return subprocess.run(['xdotool', *words], check=True, stdout=subprocess.PIPE,
                          universal_newlines=True).stdout


def press_in_replay(operator: Operator, key: str) -> None:
    """Press a key while its RViz has the keyboard focus."""
    _, past = operator.beside(rviz_windows)
    operator.beside(lambda: xdotool('windowfocus', '--sync', past, 'key', key))


def play(operator: Operator, replay: ReplayModel) -> None:
    """Play with the keys, independent of the focus."""
    before_s = replay.time_s
    press_in_replay(operator, 'space')
    operator.wait(lambda: replay.playback.state.is_playing and replay.time_s > before_s + 0.5,
                  'it plays')
    operator.press(Qt.Key_Space)
    operator.wait(lambda: not replay.playback.state.is_playing, 'it stands')


def wait_for_band(operator: Operator, picture: str, is_shown: bool) -> None:
    """Wait until RViz shows that this is a replay, or no longer."""
    operator.beside(lambda: wait_until(lambda: (amber_pixels(picture) > MIN_AMBER) == is_shown,
                                       f'band: {is_shown}'))


def amber_pixels(picture: str) -> int:
    """Return the number of pixels of the screen that have the color of the band."""
    save_picture(picture)
    text = subprocess.run(['convert', picture, '-fill', 'black', '+opaque', AMBER, '-fill', 'white',
                           '-opaque', AMBER, '-format', '%[fx:mean*w*h]', 'info:'],
                          check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout
    return round(float(text))
