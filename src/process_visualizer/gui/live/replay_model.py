# SPDX-License-Identifier: BSD-3-Clause
"""Instant replay of the last seconds; decides when it is ready, and when it is given up."""
from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import Any, Callable, Dict, NamedTuple, Optional, Protocol, Set, Tuple, Type

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.plan import BAG_PART, RVIZ_PART
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.values_model import Played
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import NewestCall, Tasks
from process_visualizer.launching.part_report import PartReport, PartState

LINE = 'replay'
_END_TIMEOUT_S = 60.0
_OTHERS_MS = 8000
"""Time that the picture waits for the nodes of devices: without them, objects would be missing."""
_LATE_S = 2.0  # of the memory's beginning, lost at most while it is copied


def age_text(age_s: float) -> str:
    """Return an age as shown in the bar of the replay."""
    minutes, seconds = divmod(round(age_s, 1), 60.0)
    return f'{minutes:.0f} min {seconds:.1f} s' if minutes else f'{seconds:.1f} s'


class ReplayPhase(Enum):
    """The phase of a replay; ``PREPARING`` until the past is visible."""

    LIVE = 'live'
    PREPARING = 'preparing'
    SHOWN = 'shown'


class MemoryCopy(NamedTuple):
    """A bag with the recorder's memory, and the times of its first and last message [s]."""

    path: str
    begin_s: float
    end_s: float


class _MomentGone(Exception):
    """A moment is not in the recorder's memory; the text says how far that goes back."""


class ReplayTools(Protocol):
    """The tools of a replay (ReplayLink in gui/ros/replay_link.py); each call may block."""

    def copy_memory(self) -> MemoryCopy:
        """Write the recorder's memory into a bag."""

    def start(self, choice: Choice) -> Any:
        """Start a second cell, or change the bag that it plays."""

    def follow(self) -> Any:
        """Follow the state of the second cell's player until the player ends."""

    def show(self) -> Any:
        """Show the second cell's RViz over that of the running cell, with the same camera."""

    def move(self) -> Any:
        """Move the second cell's RViz, which is shown, over that of the running cell again."""

    def hide(self) -> Any:
        """Hide the second cell's RViz."""

    def interrupt(self) -> Any:
        """Make ``show`` stop waiting."""

    def restart(self, part: str) -> Any:
        """Restart a part of the second cell."""

    def stop(self) -> Any:
        """Stop the second cell."""


class ReplayModel(QObject):
    """Shows a moment of the recorder's memory; ``playback`` moves from there.

    The memory is copied when a replay begins, so that the moment is not overwritten. A moment that
    the last copy contains is shown at once.
    The second cell starts with the first replay and stays, so that later replays begin at once.
    Times are those of the recorder's clock [s].
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    copied = pyqtSignal()
    """The memory has been copied: the replay ends at this moment."""

    def __init__(self, tasks: Tasks, playback: PlaybackModel, tools: ReplayTools,
                 refused: Tuple[Type[Exception], ...], session: Session,
                 parent: Optional[QObject] = None) -> None:
        """Set the tools; ``refused`` are their exceptions whose texts are for the user."""
        super().__init__(parent)
        self.playback = playback
        self._tasks, self._tools, self._refused = tasks, tools, refused
        self._phase = ReplayPhase.LIVE
        self._choice: Optional[Choice] = None
        self._reports: Dict[str, PartReport] = {}
        self._path, self._copies = '', 0
        self._begin_s = self._wanted_s = 0.0
        self._has_state = self._is_opening = self._is_started = False
        self._restarted: Set[str] = set()  # parts that have died during this replay
        self._others = QTimer(self, interval=_OTHERS_MS, singleShot=True)
        self._others.timeout.connect(self._open)
        self._moves = NewestCall[bool](tasks, LINE, self._move, lambda: None, self._fail)
        session.run_changed.connect(lambda: self._follow_run(session.running_mode))

    @property
    def phase(self) -> ReplayPhase:
        """Return the phase of the replay."""
        return self._phase

    @property
    def is_live(self) -> bool:
        """Return whether the scene shows the running cell."""
        return self._phase is ReplayPhase.LIVE

    @property
    def played(self) -> Played:
        """Return what is replayed; nothing until the memory has been copied."""
        if self._choice is None or not self._path:
            return Played()
        return Played((self._path,), self._choice.devices, self._copies)

    @property
    def trouble(self) -> str:
        """Return which device's nodes have ended again, so that the scene keeps old data; or ''."""
        return ', '.join(sorted(it for it in self._restarted if self._reports[it].has_died))

    @property
    def time_s(self) -> float:
        """The moment that is shown, or is being prepared."""
        if self._phase is not ReplayPhase.SHOWN:
            return self._wanted_s
        return self._begin_s + self.playback.position_s

    def show(self, time_s: float, choice: Choice) -> None:
        """Show a moment; ``choice`` is that of the running cell."""
        self._wanted_s = time_s
        if self.is_live and self._holds(time_s, choice):
            self._begin_again()
        elif self.is_live:
            self._begin(choice)
        elif self._has_state:
            self.playback.seek(time_s - self._begin_s)

    def leave_for(self, time_s: float) -> None:
        """Return to the running cell if the memory was copied before a moment, or lacks it.

        To show that moment, the memory has to be copied again.
        """
        if not (self._has_state and self._contains(time_s)):
            self.leave()

    def leave(self) -> None:
        """Return to the running cell."""
        self._others.stop()
        before, self._phase = self._phase, ReplayPhase.LIVE
        view = self._reports.get(RVIZ_PART)
        if before is ReplayPhase.SHOWN:
            self.playback.pause()
            if view is not None and view.state is PartState.RUNNING:
                self._run(self._tools.hide)
        if before is not ReplayPhase.LIVE:
            self.changed.emit()

    def _follow_run(self, mode: Optional[Mode]) -> None:
        """End the replay when the cell has ended."""
        if mode is not Mode.REALTIME and self._is_started:
            self.leave()
            self._is_started, self._reports = False, {}
            self._restarted.clear()
            self.playback.take_state(None)
            self._tools.interrupt()
            self._run(self._tools.stop)

    def close(self) -> None:
        """Stop everything; block until it is done."""
        if self._is_started:
            self._tools.interrupt()
            self._tasks.run_and_wait(LINE, self._tools.stop, _END_TIMEOUT_S)

    def follow_window(self) -> None:
        """Follow the running cell's RViz, which has been moved or resized."""
        if self._is_opening and not self.is_live:
            self._moves.request(True)

    def take_report(self, report: PartReport) -> None:
        """Update from the state of a part of the second cell."""
        before = self._reports.get(report.part)
        self._reports[report.part] = report
        is_view = report.part == RVIZ_PART
        if is_view and report.has_died and self._revives_view(before):
            pass  # it is shown again when it is up
        elif report.state is PartState.FAILED and report.part in (BAG_PART, RVIZ_PART):
            died = report.dead_nodes if is_view else ()
            self._give_up(f'The replay has ended with its RViz ({died[0].end_words})' if died else
                          f'The replay has ended: {report.reason}')
        elif report.state is PartState.STOPPED and is_view and (
                before is None or before.state is not PartState.STOPPING):  # not restarted
            if self._phase is ReplayPhase.PREPARING:
                self._give_up('Replay failed: its RViz was closed while it started')
            self.leave()  # the operator has closed its window
        elif report.part == BAG_PART and report.state is PartState.RUNNING and (
                before is None or before.state is not PartState.RUNNING):
            self._run(self._tools.follow)
        elif report.has_died and report.part not in self._restarted and not self.is_live:
            self._restart(report.part)  # what it drew would stay, and be wrong at other times
        if report.part in self._restarted:
            self.changed.emit()
        self._check_ready()

    def take_state(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Update from the newest state of the second cell's player."""
        if self.is_live or snapshot is None or self._path not in snapshot.files:
            return
        is_first, self._has_state = not self._has_state, True
        self._begin_s = snapshot.begin_s
        self.playback.take_state(snapshot)
        if is_first:
            self.playback.seek(self._wanted_s - self._begin_s)
        self._check_ready()

    def _revives_view(self, before: Optional[PartReport]) -> bool:
        """Restart an RViz that has died while it was shown; return whether it is being restarted.

        Its death is reported twice, by its node and by its roslaunch.
        """
        if self._phase is ReplayPhase.SHOWN and RVIZ_PART not in self._restarted:
            self._phase, self._is_opening = ReplayPhase.PREPARING, False
            self._restart(RVIZ_PART)
            return True
        return (RVIZ_PART in self._restarted and self._phase is ReplayPhase.PREPARING
                and not self._is_opening and before is not None
                and before.state is PartState.RUNNING)

    def _restart(self, part: str) -> None:
        """Restart a part, once in a replay."""
        self._restarted.add(part)
        self._run(lambda: self._tools.restart(part))

    def _holds(self, time_s: float, choice: Choice) -> bool:
        """Return whether the last copy contains a moment and the second cell still shows it."""
        states = [self._reports[part].state for part in (BAG_PART, RVIZ_PART)
                  if part in self._reports]
        has_died = any(it.has_died for it in self._reports.values())
        return (self._has_state and states == 2 * [PartState.RUNNING] and self._choice is not None
                and not has_died
                and replace(choice, window=None) == replace(self._choice, window=None)
                and self._contains(time_s))

    def _contains(self, time_s: float) -> bool:
        return self._begin_s <= time_s <= self._begin_s + self.playback.state.duration_s

    def _begin_again(self) -> None:
        self._phase, self._is_opening = ReplayPhase.PREPARING, False
        self._restarted.clear()
        self.playback.seek(self._wanted_s - self._begin_s)
        self._check_ready()
        self.changed.emit()

    def _begin(self, choice: Choice) -> None:
        self._phase, self._choice = ReplayPhase.PREPARING, choice
        self._has_state = self._is_opening = False
        self._is_started = True
        self._path = ''
        self._restarted.clear()
        self.playback.forget_player()
        self._tasks.run(LINE, lambda: self._started(choice), self._take_path, self._fail)
        self.changed.emit()

    def _started(self, choice: Choice) -> str:
        """Copy the memory and start the second cell; return the copy's path; runs as a task."""
        copy = self._tools.copy_memory()
        if self._wanted_s < copy.begin_s - _LATE_S:
            raise _MomentGone(
                f'That moment, {age_text(copy.end_s - self._wanted_s)} ago, can no longer be '
                f"replayed: the recorder's memory begins {age_text(copy.end_s - copy.begin_s)} ago")
        self._tools.start(replace(choice, mode=Mode.PLAYBACK, rviz=RvizStart.OPTIONAL,
                                  bag=copy.path, further_bags=(), left_out=(), is_replay=True))
        return copy.path

    def _take_path(self, path: str) -> None:
        self._path = path
        self._copies += 1
        self.copied.emit()
        self._check_ready()

    def _check_ready(self) -> None:
        view = self._reports.get(RVIZ_PART)
        if self._phase is not ReplayPhase.PREPARING or self._is_opening or not self._has_state \
                or view is None or view.state is not PartState.RUNNING or view.has_died:
            return
        if all(it.state is not PartState.STARTING for it in self._reports.values()):
            self._open()
        elif not self._others.isActive():
            self._others.start()

    def _open(self) -> None:
        """Show RViz; parts that are still starting have been waited for long enough."""
        self._others.stop()
        if self._phase is ReplayPhase.PREPARING and not self._is_opening:
            self._is_opening = True
            self._tasks.run(LINE, self._tools.show, self._take_shown, self._fail)

    def _take_shown(self, _nothing: object) -> None:
        if self._phase is ReplayPhase.PREPARING:
            self._phase = ReplayPhase.SHOWN
            self.changed.emit()
        else:
            self._run(self._tools.hide)  # the operator has left meanwhile

    def _move(self, _is_moved: bool) -> None:
        """Move RViz, unless the operator has left meanwhile; runs as a task."""
        if not self.is_live:
            self._tools.move()

    def _run(self, work: Callable[[], Any]) -> None:
        self._tasks.run(LINE, work, None, self._fail)

    def _fail(self, error: Exception) -> None:
        if isinstance(error, _MomentGone):
            self._give_up(str(error))
            return
        if not isinstance(error, self._refused):
            raise error
        self._give_up(f'Replay failed: {error}')

    def _give_up(self, text: str) -> None:
        if not self.is_live:
            self.leave()
            self.failed.emit(text)
