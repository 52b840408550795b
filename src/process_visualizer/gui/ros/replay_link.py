# SPDX-License-Identifier: BSD-3-Clause
"""The second cell of an instant replay, which has a ROS master of its own."""
from __future__ import annotations

import os
import threading
import time
from typing import Callable, Optional, Sequence

from PyQt5.QtCore import QObject, pyqtSignal
from std_msgs.msg import String

from process_visualizer.bagio.recording import Recording
from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.clients.remote_follower import RemoteFollower
from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.live.replay_model import MemoryCopy
from process_visualizer.gui.ros.snapshots import KeyPress, PlayerSnapshot
from process_visualizer.launching.replay_cell import ReplayCell
from process_visualizer.msg import PlayerState
from process_visualizer.ros_names import BAG_PLAYER, PLAYER_STATE_TOPIC, RVIZ, RVIZ_KEY_TOPIC
from process_visualizer.rviz.window_geometry import Rectangle
from process_visualizer.srv import ShowReplay


def player_snapshot(state: PlayerState) -> PlayerSnapshot:
    """Return the snapshot of a player's state."""
    return PlayerSnapshot(
        stamp_s=state.stamp.to_sec(), begin_s=state.begin.to_sec(), duration_s=state.duration,
        position_s=state.position, rate=state.rate, achieved_rate=state.achieved_rate,
        paused=state.paused, loop=(state.loop_begin, state.loop_end) if state.loop else None,
        segment=state.segment, published=state.published, dropped=state.dropped,
        gaps=tuple(state.gaps), files=tuple(state.files), mark=state.mark,
        topics=tuple((topic.name, topic.published) for topic in state.topics),
        others=tuple(state.others), since_s=state.since.to_sec())


_BAG = 'replay.bag'
_SERVICE = f'/{RVIZ}/show_replay'
_TIMEOUT_S = 10.0
_START_S = 30.0


class ReplayLinkError(Exception):
    """The replay's RViz did not answer, or refused a command; the text says why."""


class ReplayLink(QObject):
    """Starts, follows and commands the second cell. Its methods block: run them as tasks."""

    reported = pyqtSignal(object)
    """A PartReport."""
    player_state = pyqtSignal(object)
    """A PlayerSnapshot."""
    key_pressed = pyqtSignal(object)
    """One of the keys was pressed while the replay's RViz had the keyboard."""

    def __init__(self, copy: Callable[[str, str], str], camera: Callable[[], str],
                 place: Callable[[], Optional[Rectangle]], keys: Callable[[], Sequence[str]],
                 parent: Optional[QObject] = None) -> None:
        """Set functions to copy the recorder's memory and to get the state of the live RViz.

        ``copy`` takes a folder and a name, and returns the path of the bag. The others return the
        live RViz's camera, its place (in unscaled pixels of the screen), and the keys that it
        passes on.
        """
        super().__init__(parent)
        self._copy, self._camera, self._place, self._keys = copy, camera, place, keys
        self._cell = ReplayCell(self.reported.emit)
        uri = self._cell.master_uri
        self.player = PlayerClient(follow_now=False, master_uri=uri)
        self._show = ServiceConnection(_SERVICE, ShowReplay, _TIMEOUT_S, uri)
        self._follower: Optional[RemoteFollower] = None
        self._key_follower: Optional[RemoteFollower] = None
        self._stopping = threading.Event()

    @property
    def master_uri(self) -> str:
        """The address of the second cell's master."""
        return self._cell.master_uri

    @property
    def folder(self) -> str:
        """Return the folder of the bag that the second cell plays."""
        return self._cell.folder

    def copy_memory(self) -> MemoryCopy:
        """Write the recorder's memory into a bag.

        Raises:
            RecorderError: the recorder does not answer, or its memory is empty.
            OSError: the bag cannot be given its name.
            BagError: it cannot be read.
        """
        self._leave_player()  # the player plays the last copy
        path = os.path.join(self._cell.folder, _BAG)
        os.replace(self._copy(self._cell.folder, 'copied'), path)
        with Recording([path]) as recording:
            return MemoryCopy(path, recording.begin_ns / 1e9, recording.end_ns / 1e9)

    def start(self, choice: Choice) -> None:
        """Start the second cell, or change the bag that it plays; see ReplayCell."""
        self._cell.show(choice)

    def follow(self) -> None:
        """Follow the state of the second cell's player until the player ends."""
        self._leave_player()
        self._follower = RemoteFollower(
            PLAYER_STATE_TOPIC, PlayerState, f'/{BAG_PLAYER}', self._cell.master_uri,
            lambda state: self.player_state.emit(player_snapshot(state)), lambda: None)

    def show(self) -> None:
        """Show the replay's RViz over that of the running cell, with the same camera.

        Raises:
            ReplayLinkError: RViz does not answer, or refuses.
        """
        self._show.wait(_START_S, self._stopping)  # RViz is a node before it has displays
        self._call(True, self._camera(), self._place(), self._keys())
        self._follow_keys()

    def move(self) -> None:
        """Move the replay's RViz, which is shown, over that of the running cell again.

        Raises:
            ReplayLinkError: RViz does not answer, or refuses.
        """
        self._call(True, '', self._place())

    def hide(self) -> None:
        """Hide the replay's RViz.

        Raises:
            ReplayLinkError: RViz does not answer, or refuses.
        """
        self._call(False, '', None)

    def restart(self, part: str) -> None:
        """Restart a part of the second cell."""
        self._cell.restart(part)

    def interrupt(self) -> None:
        """Make ``show`` stop waiting for RViz; return at once."""
        self._stopping.set()

    def stop(self) -> None:
        """Stop the second cell."""
        try:
            self._leave_player()
            self._leave_keys()
            self._stopping.clear()
            for connection in (self.player, self._show):
                connection.close()
        finally:
            self._cell.stop()

    def _leave_player(self) -> None:
        if self._follower is not None:
            self._follower.close()
        self._follower = None

    def _follow_keys(self) -> None:
        """Follow the keys of RViz, with a new follower as RViz may have been restarted."""
        self._leave_keys()
        self._key_follower = RemoteFollower(
            RVIZ_KEY_TOPIC, String, f'/{RVIZ}', self._cell.master_uri,
            lambda text: self.key_pressed.emit(KeyPress.from_text(text.data, time.time())),
            lambda: None)

    def _leave_keys(self) -> None:
        if self._key_follower is not None:
            self._key_follower.close()
        self._key_follower = None

    def _call(self, shown: bool, camera: str, window: Optional[Rectangle],
              keys: Sequence[str] = ()) -> None:
        place = (0, 0, 0, 0) if window is None else (
            max(window.x, 0), max(window.y, 0), window.width, window.height)
        try:
            answer = self._show.call(shown, camera, *place, '\n'.join(keys))
        except ServiceUnreachable as error:
            raise ReplayLinkError(str(error)) from error
        if not answer.success:
            raise ReplayLinkError(answer.message)
