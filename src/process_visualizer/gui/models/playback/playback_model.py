# SPDX-License-Identifier: BSD-3-Clause
"""Playback as the operator sees and commands it."""
from __future__ import annotations

import bisect
import time
from typing import Any, Callable, NamedTuple, Optional, Sequence, Tuple, Type

from PyQt5.QtCore import QObject, Qt, QTimer, pyqtSignal

from process_visualizer.gui.models.playback.loop_points import (
    SHORTEST_LOOP_S,
    LoopPoints,
    points_of,
)
from process_visualizer.gui.models.playback.motion import MotionCommands
from process_visualizer.gui.models.playback.newest_call import NewestCall
from process_visualizer.gui.models.playback.playback_position import PlaybackPosition
from process_visualizer.gui.models.playback.player_commands import PlayerCommands
from process_visualizer.gui.models.playback.step_unit import MESSAGE, StepUnit
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.playback.rate_ladder import faster, slower
from process_visualizer.playback.timeline import MAX_RATE, MIN_RATE

LINE = 'player'
FRAME_MS = 16  # the position is drawn so often while playing
_KEPT_SHARE = 0.95  # of the rate; what is reached above this is not worth telling
_JUST_PASSED_S = 0.7  # while playing, "previous mark" leads farther than to one just passed
_HERE_S = 0.0005

Loop = Optional[Tuple[float, float]]


class PlacedMark(NamedTuple):
    """A mark, in s from the beginning of the recording."""

    position_s: float
    label: str


class PlaybackModel(QObject):
    """What the player does, between its states too, and all that can be asked of it.

    Commands return at once and do nothing while there is no player; what the player refuses is
    told by ``failed``.
    """

    changed = pyqtSignal()
    """Anything but the position."""
    moved = pyqtSignal()
    """The position; as often as a screen shows it while playing."""
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, client: PlayerCommands,
                 refused: Type[Exception] = Exception,
                 clock: Callable[[], float] = time.time,
                 parent: Optional[QObject] = None) -> None:
        """Take the client that commands the player, and what it raises with a text for the user.

        ``clock`` returns the wall time [s], by which the states are stamped.
        """
        super().__init__(parent)
        self._tasks = tasks
        self._client = client
        self._refused = refused
        self._clock = clock
        self._snapshot: Optional[PlayerSnapshot] = None
        self._position = PlaybackPosition()
        self._sought_s: Optional[float] = None
        self._sought_from = 0  # the segment that the last seek is to end
        self._sought_at_s = 0.0  # the wall time at which it was sent
        self._points = LoopPoints()
        self._resumes = False
        self._unit = MESSAGE
        self._marks: Tuple[PlacedMark, ...] = ()
        self._seeks = self._newest(self._send_seek, self._forget_seek)
        self._motion = MotionCommands(client.set_rate, client.play, self._newest)
        self._loops = self._newest(self._send_loop)
        self._steps = self._newest(self._send_steps)
        self._frames = QTimer(self, interval=FRAME_MS, timerType=Qt.PreciseTimer)
        self._frames.timeout.connect(self.moved)

    # What the player does.

    def take_state(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Take the newest state of the player; None when there is none any more."""
        before, self._snapshot = self._snapshot, snapshot
        self._position.take(snapshot)
        self._take_loop(before, snapshot)
        self._forget_seek()
        if self.is_playing != self._frames.isActive():
            self._frames.start() if self.is_playing else self._frames.stop()
        if _without_position(before) != _without_position(snapshot):
            self.changed.emit()
        self.moved.emit()

    @property
    def is_available(self) -> bool:
        """Whether there is a player to command."""
        return self._snapshot is not None

    @property
    def duration_s(self) -> float:
        """How long the recording is; 0 while there is no player."""
        return 0.0 if self._snapshot is None else self._snapshot.duration_s

    @property
    def position_s(self) -> float:
        """Where playback is now [s from the beginning], or where it is about to be."""
        if self._sought_s is not None:
            return self._sought_s
        return self._position.at(self._clock())

    @property
    def is_playing(self) -> bool:
        """Whether the position moves."""
        return self._snapshot is not None and not self._snapshot.paused

    @property
    def is_backwards(self) -> bool:
        """The direction in which it plays, or last did."""
        return self.rate < 0.0

    @property
    def rate(self) -> float:
        """The rate as commanded; below 0 backwards."""
        if self._motion.rate is not None:
            return self._motion.rate
        return 1.0 if self._snapshot is None else self._snapshot.rate

    @property
    def reached_rate(self) -> Optional[float]:
        """The rate that the machine reaches, if that is less than the rate wanted."""
        if self._snapshot is None or self._snapshot.paused:
            return None
        reached = self._snapshot.achieved_rate
        return None if abs(reached) >= _KEPT_SHARE * abs(self._snapshot.rate) else reached

    @property
    def dropped(self) -> int:
        """How many messages slow subscribers did not get."""
        return 0 if self._snapshot is None else self._snapshot.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """What the player cannot play."""
        return () if self._snapshot is None else self._snapshot.gaps

    # Play.

    def play(self) -> None:
        """Play forward."""
        self._play_at(abs(self.rate))

    def play_backwards(self) -> None:
        """Play backwards."""
        self._play_at(-abs(self.rate))

    def pause(self) -> None:
        """Stand still."""
        self._stand(self._client.pause)

    def toggle(self) -> None:
        """Pause while playing, in either direction; play forward while paused."""
        self.pause() if self.is_playing else self.play()

    def toggle_backwards(self) -> None:
        """Play backwards, or pause if it does so already."""
        self.pause() if self.is_playing and self.is_backwards else self.play_backwards()

    def stop(self) -> None:
        """Stand still at the beginning."""
        self._stand(self._client.stop)

    # Go somewhere.

    def seek(self, position_s: float) -> None:
        """Go to a position, at most to the nearer end; playing or paused as before.

        While one seek is under way, only the newest other one waits for its turn.
        """
        if self._snapshot is None:
            return
        self._sought_s = min(max(position_s, 0.0), self.duration_s)
        self._sought_from = self._snapshot.segment
        self._seeks.request(self._sought_s)
        self.moved.emit()

    def jump(self, seconds: float) -> None:
        """Go on or (below 0) back by a time [s]."""
        self.seek(self.position_s + seconds)

    def to_start(self) -> None:
        """Go to the beginning."""
        self.seek(0.0)

    def to_end(self) -> None:
        """Go to the end."""
        self.seek(self.duration_s)

    def begin_scrub(self) -> None:
        """Stand still while the operator drags."""
        if self.is_playing and not self._resumes:
            self._resumes = True
            self.pause()

    def end_scrub(self) -> None:
        """Play on after dragging, if it did before."""
        if self._resumes:
            self._resumes = False
            self._run(self._client.play)

    @property
    def step_unit(self) -> StepUnit:
        """What one step is."""
        return self._unit

    def set_step_unit(self, unit: StepUnit) -> None:
        """Choose what one step is."""
        self._unit = unit
        self.changed.emit()

    def step(self, count: int) -> None:
        """Pause and go so many steps on, or (below 0) back."""
        if self.is_available:
            self._motion.stand()
            waiting = self._steps.waiting
            done, unit = waiting if waiting is not None and waiting[1] == self._unit \
                else (0, self._unit)
            self._steps.request((done + count, unit))

    # Marks.

    @property
    def marks(self) -> Tuple[PlacedMark, ...]:
        """The marks of the recording in the order of time."""
        return self._marks

    def set_marks(self, marks: Sequence[PlacedMark]) -> None:
        """Take the marks of the recording."""
        self._marks = tuple(sorted(marks))
        self.changed.emit()

    def to_next_mark(self) -> None:
        """Go to the next mark, if there is one."""
        row = bisect.bisect_right(self._mark_positions(), self.position_s + _HERE_S)
        if row < len(self._marks):
            self.seek(self._marks[row].position_s)

    def to_previous_mark(self) -> None:
        """Go to the mark before; to the beginning before the first one."""
        before_s = self.position_s - (_JUST_PASSED_S if self.is_playing else _HERE_S)
        row = bisect.bisect_left(self._mark_positions(), before_s)
        self.seek(self._marks[row - 1].position_s if row else 0.0)

    # Rate.

    def set_rate(self, rate: float) -> None:
        """Change the rate at once; below 0 backwards; the nearest possible one is taken."""
        if not self.is_available or rate == 0.0:
            return
        size = min(max(abs(rate), MIN_RATE), MAX_RATE)
        self._motion.change_rate(size if rate > 0.0 else -size)
        self.changed.emit()

    def set_speed(self, speed: float) -> None:
        """Change the rate and keep the direction."""
        self.set_rate(-abs(speed) if self.is_backwards else abs(speed))

    def faster(self) -> None:
        """Take the next higher speed of the ladder."""
        self.set_rate(faster(self.rate))

    def slower(self) -> None:
        """Take the next lower speed of the ladder."""
        self.set_rate(slower(self.rate))

    # Loop.

    @property
    def is_looping(self) -> bool:
        """Whether playback is repeated."""
        if self._loops.wanted is not None:
            return self._loops.wanted[0]
        return self._snapshot is not None and self._snapshot.loop is not None

    @property
    def loop_points(self) -> LoopPoints:
        """A and B, which stay while the loop is off."""
        return self._points

    def toggle_loop(self) -> None:
        """Repeat what is between A and B, or everything; or no more."""
        self._set_loop(not self.is_looping, self._points)

    def set_loop_begin(self, position_s: Optional[float] = None) -> None:
        """Repeat from a position (now) on, to B or, where there is none behind it, the end."""
        self._set_loop(True, self._points.with_begin(self._chosen(position_s)))

    def set_loop_end(self, position_s: Optional[float] = None) -> None:
        """Repeat up to a position (now); if it lies before A, A and B change places."""
        self._set_loop(True, self._points.with_end(self._chosen(position_s)))

    def move_loop_point(self, which: str, position_s: float) -> None:
        """Drag 'A' or 'B' to a position, as far as the other one allows."""
        self._set_loop(self.is_looping, self._points.moved(which, position_s, self.duration_s))

    def clear_loop(self) -> None:
        """Forget A and B, and repeat no more."""
        self._set_loop(False, LoopPoints())

    # Inside.

    def _newest(self, function: Callable[[Any], Any],
                on_done: Callable[[], None] = lambda: None) -> NewestCall[Any]:
        return NewestCall(self._tasks, LINE, function, on_done, self._fail)

    def _run(self, command: Callable[[], Any]) -> None:
        if self.is_available:
            self._tasks.run(LINE, command, None, self._fail)

    def _fail(self, error: Exception) -> None:
        """Return to what the player does, and tell."""
        self._sought_s = self._seeks.wanted
        if self._snapshot is not None and self._snapshot.loop is not None:
            self._points = points_of(self._snapshot.loop, self._snapshot.duration_s)
        self.changed.emit()
        if not isinstance(error, self._refused):
            raise error
        self.failed.emit(str(error))

    def _play_at(self, rate: float) -> None:
        if rate == self.rate and self._motion.rate is None:
            self._run(self._client.play)
        elif self.is_available:
            self._motion.play(rate)
            self.changed.emit()

    def _stand(self, command: Callable[[], Any]) -> None:
        self._motion.stand()
        self._run(command)

    def _send_seek(self, position_s: float) -> None:
        self._sought_at_s = self._clock()
        self._client.seek(position_s)

    def _forget_seek(self) -> None:
        """Once the seek has been done and a state tells of it, that state holds."""
        snapshot = self._snapshot
        if snapshot is None or (self._seeks.wanted is None
                                and snapshot.segment != self._sought_from
                                and snapshot.stamp_s >= self._sought_at_s):
            self._sought_s = None

    def _send_steps(self, steps: Tuple[int, StepUnit]) -> None:
        count, unit = steps
        if unit.duration_s:
            self._client.step(0, '', count * unit.duration_s)
        elif count:
            self._client.step(count, unit.topic, 0.0)

    def _mark_positions(self) -> Sequence[float]:
        return [mark.position_s for mark in self._marks]

    def _chosen(self, position_s: Optional[float]) -> float:
        chosen_s = self.position_s if position_s is None else position_s
        return min(max(chosen_s, 0.0), self.duration_s)

    def _set_loop(self, on: bool, points: LoopPoints) -> None:
        if not self.is_available:
            return
        if not points.is_long_enough(self.duration_s):
            self.failed.emit(f'A and B must be at least {SHORTEST_LOOP_S:g} s apart')
            return
        self._points = points
        if on or self.is_looping:
            self._loops.request((on, *points.bounds(self.duration_s)))
        self.changed.emit()

    def _send_loop(self, loop: Tuple[bool, float, float]) -> None:
        self._client.set_loop(*loop)

    def _take_loop(self, before: Optional[PlayerSnapshot], after: Optional[PlayerSnapshot]) -> None:
        """Take over a loop that somebody else has set; forget the points of another recording."""
        if before is None or after is None or before.files != after.files:
            self._points = LoopPoints()
            before = None
        if after is None or after.loop is None or self._loops.wanted is not None:
            return
        if before is None or before.loop != after.loop:
            self._points = points_of(after.loop, after.duration_s)


def _without_position(snapshot: Optional[PlayerSnapshot]) -> Optional[PlayerSnapshot]:
    if snapshot is None:
        return None
    return snapshot._replace(stamp_s=0.0, position_s=0.0, published=0, segment=0,
                             achieved_rate=round(snapshot.achieved_rate, 2))
