# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the scene for the page of ``cell compare``: good beside poor, as RViz shows them."""
from __future__ import annotations

import os
import shutil
import subprocess
import threading
from contextlib import contextmanager
from dataclasses import replace
from types import TracebackType
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Type

import numpy as np
import rospkg
from diagnostic_msgs.msg import DiagnosticArray
from roslib.packages import find_node

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.clients.ghost_client import GhostError, show_ghost
from process_visualizer.clients.player_client import PlayerClient, PlayerError
from process_visualizer.clients.remote_follower import RemoteFollower
from process_visualizer.clients.rviz_view import DrawnView
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.generator import default_rviz_file
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART, PlanError
from process_visualizer.launching.part_report import PartReport, PartState
from process_visualizer.launching.replay_cell import ReplayCell
from process_visualizer.launching.ros_master import RosMasterError
from process_visualizer.launching.roslaunch_process import dying_with_parent
from process_visualizer.msg import PlayerState
from process_visualizer.ros_names import BAG_PLAYER, DISPLAY_STATUS_TOPIC, PLAYER_STATE_TOPIC, RVIZ
from process_visualizer.runs.comparison.comparison import Comparison, GoodRuns
from process_visualizer.runs.comparison.comparison_page import ScenePair, shown_s
from process_visualizer.runs.comparison.ghost import (
    GhostTrack,
    ReferenceArrow,
    ghost_arrows,
    ghost_tracks,
    robot_models,
)
from process_visualizer.runs.run import Run
from process_visualizer.rviz.camera import camera_pose
from process_visualizer.rviz.views import read_view
from process_visualizer.rviz.window_geometry import Rectangle, scene_aspect

_END_TIMEOUT_S = 5.0


class ScreenError(Exception):
    """There is no screen, or no picture of it; says why and what to do."""


class VirtualScreen:
    """An X server in memory (Xvfb), from ``with`` on; drawn without the help of a graphics card.

    The operator's own screen, if there is one, shows nothing of it. Open it in a thread that lives
    as long as the program does: the kernel ends the server when that thread ends.
    """

    def __init__(self, width: int, height: int) -> None:
        """Take its size in px."""
        self._size = f'{width}x{height}x24'
        self._server: Optional['subprocess.Popen[bytes]'] = None
        self._name = ''

    def __enter__(self) -> VirtualScreen:
        """Start it.

        Raises:
            ScreenError: it cannot be started.
        """
        program = shutil.which('Xvfb')
        if program is None:
            raise ScreenError('there is no Xvfb; install the package xvfb')
        read, write = os.pipe()
        with os.fdopen(read, encoding='ascii') as number:
            try:
                self._server = subprocess.Popen(
                    [*dying_with_parent(), program, '-displayfd', str(write), '-screen', '0',
                     self._size, '-nolisten', 'tcp'], pass_fds=[write],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL, start_new_session=True)
            except OSError as error:
                raise ScreenError(f'Xvfb cannot be started: {error}') from None
            finally:
                os.close(write)
            self._name = number.readline().strip()
        if not self._name:
            self.close()
            raise ScreenError('Xvfb has ended before it had a screen')
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    @property
    def variables(self) -> Dict[str, str]:
        """The environment of programs that are to be seen on it."""
        return {'DISPLAY': f':{self._name}', 'LIBGL_ALWAYS_SOFTWARE': '1',
                'QT_X11_NO_MITSHM': '1', 'QT_QPA_PLATFORM': 'xcb'}

    def picture(self, area: str) -> bytes:
        """Return an area of it, such as 800x600+0+0 (width, height, x, y in px), as a JPEG.

        Raises:
            ScreenError: ImageMagick fails.
        """
        try:
            return subprocess.run(
                ['import', '-silent', '-window', 'root', '-crop', area, '+repage', '-quality',
                 '88', 'jpeg:-'], env={**os.environ, **self.variables}, check=True,
                stdout=subprocess.PIPE).stdout
        except (OSError, subprocess.CalledProcessError) as error:
            raise ScreenError(f'ImageMagick cannot take a picture: {error}') from None

    def close(self) -> None:
        """End it."""
        if self._server is not None:
            self._server.terminate()
            try:
                self._server.wait(_END_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._server.kill()
                self._server.wait()
        self._server = None


SIZE = (880, 700)
"""Of RViz's window [px]."""
_SCENE = '846x606+17+63'
"""What of the window is the scene: without bars and the docks' edges."""
_START_S, _DRAWN_S = 90.0, 30.0
_ALIKE, _MAX_PICTURES = 3, 20
"""Equal pictures in a row that show a scene at rest, and the most that are taken."""
_NEEDED = (FRAMES_PART, BAG_PART, RVIZ_PART)


class SceneError(Exception):
    """There can be no picture; says why."""


@contextmanager
def scene_camera(choice: Choice) -> Iterator[SceneCamera]:
    """Yield a camera; it goes with its cell.

    Args:
        choice: devices and view, in playback mode; the camera is given what is played.

    Raises:
        SceneError: there is no screen.
    """
    try:
        with VirtualScreen(*SIZE) as screen:
            camera = SceneCamera(choice, screen)
            try:
                yield camera
            finally:
                camera.close()
    except ScreenError as error:
        raise SceneError(str(error)) from None


class SceneCamera:
    """Starts its cell with the first picture."""

    def __init__(self, choice: Choice, screen: VirtualScreen) -> None:
        """Take what is shown, and the screen on which it is."""
        self._choice = replace(choice, rviz=RvizStart.OPTIONAL, window=Rectangle(0, 0, *SIZE))
        self._screen = screen
        self._changed = threading.Condition()
        self._states: Dict[str, PartState] = {}
        self._failure = ''
        self._files: Tuple[str, ...] = ()  # as the player says
        self._view, self._has_ghost = DrawnView(), False
        self._cell = ReplayCell(self._take_report, screen.variables)
        self._player = PlayerClient(follow_now=False, master_uri=self._cell.master_uri)
        self._followers: Dict[str, RemoteFollower] = {}

    def picture(self, paths: Sequence[str], position_s: float,
                tracks: Sequence[GhostTrack] = (),
                arrows: Sequence[ReferenceArrow] = ()) -> bytes:
        """Return a picture (JPEG) of a recording at a position [s from its begin].

        ``tracks`` and ``arrows`` are the ghost's.

        Raises:
            SceneError: the cell cannot be started, or does not answer.
        """
        self._play(tuple(paths))
        try:
            self._player.pause()
            self._player.seek(position_s)
            if tracks or self._has_ghost:  # without robots' models there is no node for it
                show_ghost(tracks, arrows, self._cell.master_uri, _START_S)
                self._has_ghost = bool(tracks)
        except (PlayerError, GhostError) as error:
            raise SceneError(str(error)) from None
        return self._still_picture()

    def close(self) -> None:
        """Stop the cell."""
        for follower in self._followers.values():
            follower.close()
        self._player.close()
        self._cell.stop()

    def _still_picture(self) -> bytes:
        """A picture of a scene that has come to rest: messages, models and labels may be late."""
        pictures: List[bytes] = []
        for _ in range(_MAX_PICTURES):
            self._view.begin_again()
            is_drawn = self._view.wait_until_drawn(_DRAWN_S)
            if not self._view.frames:
                raise SceneError(self._failure or self._view.problems()[0])
            pictures.append(self._screen.picture(_SCENE))
            if not is_drawn or pictures[-_ALIKE:] == _ALIKE * pictures[-1:]:
                break  # of a display that gets nothing, nothing more will come
        return pictures[-1]

    def _play(self, paths: Tuple[str, ...]) -> None:
        """Let the player have a recording, and RViz show it."""
        if paths == self._files:
            return
        self._leave(PLAYER_STATE_TOPIC)
        self._files = ()
        try:
            self._cell.show(replace(self._choice, bag=paths[0], further_bags=paths[1:]))
        except (RosMasterError, ConfigurationError, PlanError, OSError) as error:
            raise SceneError(str(error)) from None
        self._wait(lambda: all(self._states.get(part) is PartState.RUNNING for part in _NEEDED),
                   'RViz and the player did not start')
        self._follow(PLAYER_STATE_TOPIC, PlayerState, BAG_PLAYER, self._take_state)
        if DISPLAY_STATUS_TOPIC not in self._followers:
            self._follow(DISPLAY_STATUS_TOPIC, DiagnosticArray, RVIZ, self._view.take)
        self._wait(lambda: self._files == paths, 'the player did not open the recording')

    def _follow(self, topic: str, kind: type, node: str,
                take: Callable[[object], None]) -> None:
        self._followers[topic] = RemoteFollower(topic, kind, f'/{node}', self._cell.master_uri,
                                                take, lambda: None, _START_S)

    def _leave(self, topic: str) -> None:
        follower: Optional[RemoteFollower] = self._followers.pop(topic, None)
        if follower is not None:
            follower.close()

    def _take_report(self, report: PartReport) -> None:
        with self._changed:
            self._states[report.part] = report.state
            if report.part in _NEEDED and report.state is PartState.FAILED:
                self._failure = report.reason
            elif report.part == RVIZ_PART and report.dead_nodes:
                self._failure = str(report.dead_nodes[0])
            self._changed.notify_all()

    def _take_state(self, state: PlayerState) -> None:
        with self._changed:
            self._files = tuple(state.files)
            self._changed.notify_all()

    def _wait(self, condition: Callable[[], bool], problem: str) -> None:
        with self._changed:
            self._changed.wait_for(lambda: bool(self._failure) or condition(), _START_S)
            if self._failure or not condition():
                raise SceneError(self._failure or f'{problem} within {_START_S:.0f} s')


MAX_SCENES = 4
"""So many poor runs at most, as each takes some seconds."""
_AROUND_M = 0.35
"""So much around each tool is in the picture: the arrows, and the robot's hand."""


def scene_pictures(cell: Cell, good: GoodRuns,
                   comparisons: Sequence[Comparison]) -> Tuple[Optional[ScenePair], ...]:
    """Return for each run a pair of pictures; None for good runs, and for those after the first 4.

    Raises:
        SceneError: there is no RViz or no screen, or they do not do what they should; says why.
    """
    poor = [it for it in comparisons
            if it.departures and good.of(it.run) is good][:MAX_SCENES]
    if not poor:
        return (None,) * len(comparisons)
    _check_rviz()
    devices = _recorded(cell, good.reference)
    problems = check_environment(cell, Mode.PLAYBACK, [device.name for device in devices])
    if problems:
        raise SceneError(str(problems[0]))
    choice = Choice(cell, Mode.PLAYBACK, devices, view=_view(good.reference, poor))
    with scene_camera(choice) as camera:
        good_ones = [_good_picture(camera, good.reference, it) for it in poor]
        poor_ones = [_poor_picture(camera, cell, good.reference, it) for it in poor]
    pairs = [ScenePair(_shown_s(it), *pictures)
             for it, *pictures in zip(poor, good_ones, poor_ones)]
    return tuple(pairs[poor.index(it)] if it in poor else None for it in comparisons)


def _check_rviz() -> None:
    try:
        found = find_node(RVIZ, RVIZ)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise SceneError('there is no RViz; install the package rviz')


def _good_picture(camera: SceneCamera, reference: Run, poor: Comparison) -> bytes:
    return camera.picture(_paths(reference), reference.begin_s + _shown_s(poor))


def _poor_picture(camera: SceneCamera, cell: Cell, reference: Run, poor: Comparison) -> bytes:
    wanted = cell, reference, [poor], robot_models(cell)
    return camera.picture(_paths(poor.run), poor.run.begin_s + poor.run_s(_shown_s(poor)),
                          ghost_tracks(*wanted), ghost_arrows(*wanted))


def _shown_s(poor: Comparison) -> float:
    """The moment of the pictures, in the time of the reference."""
    return shown_s(poor.departures[0])


def _paths(run: Run) -> List[str]:
    """The player is a process in another folder."""
    return [os.path.abspath(path) for path in run.recording]


def _recorded(cell: Cell, run: Run) -> Tuple[Device, ...]:
    """The devices of which there is something to be seen: the others would be waited for."""
    with Recording(run.recording) as recording:
        index = recording.index
        return tuple(device for device in cell.devices if not device.topics or any(
            len(index.positions_of(index.connections_of(topic.name))) for topic in device.topics))


def _view(reference: Run, poor: Sequence[Comparison]) -> Optional[Mapping[str, Any]]:
    """An RViz file's content with a camera that sees the tools at all moments."""
    places = [place for it in poor for place in _tools(reference, _shown_s(it))]
    if not places:
        return None  # that of the whole cell
    offsets = _AROUND_M * np.stack(np.meshgrid(*3 * [(-1.0, 1.0)]), axis=-1).reshape(-1, 3)
    points = np.concatenate([place + offsets for place in places])
    views: Dict[str, Any] = read_view(default_rviz_file())['Visualization Manager']['Views']
    current = {**views['Current'], **camera_pose(points, views['Current'], scene_aspect(*SIZE))}
    return {'Visualization Manager': {'Views': {**views, 'Current': current}}}


def _tools(reference: Run, time_s: float) -> List[np.ndarray]:
    """Return where the tools are [m] (3,), in the global frame."""
    found = [np.array([np.interp(time_s, it.times_s, column) for column in it.positions.T])
             for it in reference.motions if len(it.times_s)]
    return [place for place in found if np.isfinite(place).all()]
