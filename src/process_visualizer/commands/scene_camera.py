# SPDX-License-Identifier: BSD-3-Clause
"""Takes pictures of recordings in RViz, in a cell of its own that nobody sees."""
from __future__ import annotations

import threading
from contextlib import contextmanager
from dataclasses import replace
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from diagnostic_msgs.msg import DiagnosticArray

from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.clients.drawn_view import DrawnView
from process_visualizer.clients.ghost_client import GhostError, show_ghost
from process_visualizer.clients.player_client import PlayerClient, PlayerError
from process_visualizer.clients.remote_follower import RemoteFollower
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART, PlanError
from process_visualizer.launching.part_report import PartReport, PartState
from process_visualizer.launching.replay_cell import ReplayCell
from process_visualizer.launching.ros_master import RosMasterError
from process_visualizer.launching.virtual_screen import ScreenError, VirtualScreen
from process_visualizer.msg import PlayerState
from process_visualizer.ros_names import BAG_PLAYER, DISPLAY_STATUS_TOPIC, PLAYER_STATE_TOPIC, RVIZ
from process_visualizer.runs.comparison.ghost_arrows import GhostArrow
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.rviz.window_geometry import Rectangle

SIZE = (880, 700)
"""Of RViz's window [px]."""
_SCENE = '846x606+17+63'
"""What of the window is the scene: without bars and the docks' edges."""
_START_S, _DRAWN_S = 90.0, 30.0
_ALIKE, _MOST_PICTURES = 3, 20
"""So many pictures are the same in a scene at rest; so many are taken at most."""
_NEEDED = (FRAMES_PART, BAG_PART, RVIZ_PART)


class SceneError(Exception):
    """There can be no picture; says why."""


@contextmanager
def scene_camera(choice: Choice) -> Iterator[SceneCamera]:
    """Yield a camera; it goes with its cell.

    Args:
        choice: devices and view, in playback mode; what is played is told to the camera.

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
                arrows: Sequence[GhostArrow] = ()) -> bytes:
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
        for _ in range(_MOST_PICTURES):
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
