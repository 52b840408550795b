# SPDX-License-Identifier: BSD-3-Clause
"""Playback as the operator sees and commands it, with a queue of commands for the player."""
from __future__ import annotations

import time
from typing import Any, Callable, Iterable, NamedTuple, Optional, Protocol, Type

from PyQt5.QtCore import QObject, Qt, QTimer, pyqtSignal

from process_visualizer.gui.playback.playback_state import (
    MIN_LOOP_S,
    LoopPoints,
    Marks,
    PlacedMark,
    PlaybackPosition,
    PlaybackState,
    SeekTarget,
    StepUnit,
)
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.tasks import Newest, NewestCall, SilenceWatch, Tasks
from process_visualizer.playback.timeline import MAX_RATE, MIN_RATE, faster, slower

_READY_S = 10.0


class PlaybackReturn:
    """Remembers the last state, to restore it when the player of a recording is restarted."""

    def __init__(self) -> None:
        self._last: Optional[PlayerSnapshot] = None
        self._is_up = True
        self._was_down = False

    def follow(self, is_up: bool) -> None:
        """Set whether the player runs; it does not while it is being stopped or started."""
        self._is_up = is_up
        self._was_down = self._was_down or not is_up

    def forget(self) -> None:
        """Let the next player start at the beginning."""
        self._last, self._was_down = None, False

    def take(self, snapshot: PlayerSnapshot) -> Optional[PlayerSnapshot]:
        """Update the newest state; return the state to restore if the player is new."""
        if not self._is_up:
            return None  # the state of a player that is being stopped or started
        before, self._last = self._last, snapshot
        was_down, self._was_down = self._was_down, False
        is_same = before is not None and before.files == snapshot.files
        return before if was_down and is_same else None


def hold(client: PlayerCommands, spot: PlayerSnapshot) -> None:
    """Pause, with the loop of an earlier state; block until the player accepts commands."""
    client.wait_until_ready(_READY_S)
    client.pause()
    if spot.loop is not None:
        client.set_loop(True, *spot.loop)


def go_on(client: PlayerCommands, spot: PlayerSnapshot) -> None:
    """Restore the rate of an earlier state, and play if the player played then."""
    client.set_rate(spot.rate)
    if not spot.paused:
        client.play()


LINE = 'player'
FRAME_MS = 16  # period of drawing the position while playing


class PlaybackModel(QObject):
    """The ``state`` of the player, its position between two states, and commands to the player.

    Commands return at once and do nothing without a player; refused commands are reported by
    ``failed``.
    """

    changed = pyqtSignal()
    """Anything but the position has changed."""
    moved = pyqtSignal()
    """The position has changed; while playing, emitted with each frame of the screen."""
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, client: PlayerCommands,
                 refused: Type[Exception] = Exception,
                 clock: Callable[[], float] = time.time,
                 parent: Optional[QObject] = None) -> None:
        """Set the client of the player; ``refused`` are its exceptions with texts for the user.

        ``clock`` returns the wall time [s], by which the states are stamped.
        """
        super().__init__(parent)
        self._tasks = tasks
        self._client = client
        self._refused = refused
        self._clock = clock
        self.state = PlaybackState()
        self._position = PlaybackPosition()
        self._return = PlaybackReturn()
        self._seeks = SeekCommands(client, clock, lambda send: self._newest(send, self._arrive))
        self._motion = MotionCommands(client.set_rate, client.play, self._newest)
        self._loops = self._newest(lambda loop: client.set_loop(*loop))
        self._steps = StepCommands(client, self._newest)
        self._frames = QTimer(self, interval=FRAME_MS, timerType=Qt.PreciseTimer)
        self._frames.timeout.connect(self.moved)
        self._silence = SilenceWatch(self)
        self._silence.silent.connect(self._take_silence)

    # The player's state.

    def take_state(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Update from the newest state of the player; None if the player is gone."""
        self._silence.stop() if snapshot is None else self._silence.hear()
        before = self.state
        self.state = before.updated(snapshot, asks_for_loop=self._loops.wanted is not None)
        self._arrive()
        self._position.take(snapshot)
        if self.state.is_playing != self._frames.isActive():
            self._frames.start() if self.state.is_playing else self._frames.stop()
        if self.state.differs_from(before):
            self.changed.emit()
        self.moved.emit()
        spot = None if snapshot is None else self._return.take(snapshot)
        if spot is not None:
            self._run(lambda: hold(self._client, spot))
            self.seek(spot.position_s)
            self._run(lambda: go_on(self._client, spot))

    def _take_silence(self) -> None:
        """Stay at the last position of a player that no longer reports: the scene stands there."""
        self.state = self.state._replace(is_silent=True)
        self._frames.stop()
        self.changed.emit()
        self.moved.emit()

    def follow_player(self, is_up: bool) -> None:
        """Set whether the player runs; a restarted player continues at the last position."""
        self._return.follow(is_up)

    def forget_player(self) -> None:
        """Let the next player start at the beginning."""
        self._return.forget()
        self.state = self.state._replace(points=LoopPoints())
        self.changed.emit()

    @property
    def position_s(self) -> float:
        """The current position [s from the beginning], or the target of a pending seek.

        While the player is silent, it is the last position that the player reported.
        """
        sought, snapshot = self.state.sought, self.state.snapshot
        if self.state.is_silent and snapshot is not None:
            return snapshot.position_s
        return self._position.at(self._clock()) if sought is None else sought.position_s

    @property
    def rate(self) -> float:
        """The rate as commanded; below 0 backwards."""
        return self.state.rate if self._motion.rate is None else self._motion.rate

    @property
    def is_looping(self) -> bool:
        """Return whether playback is repeated, as commanded."""
        wanted = self._loops.wanted
        return self.state.loop is not None if wanted is None else wanted[0]

    # Play.

    def play(self) -> None:
        """Play forward."""
        self._play_at(abs(self.rate))

    def play_backwards(self) -> None:
        """Play backwards."""
        self._play_at(-abs(self.rate))

    def pause(self) -> None:
        """Pause."""
        self._stand(self._client.pause)

    def toggle(self) -> None:
        """Pause while playing, in either direction; play forward while paused."""
        self.pause() if self.state.is_playing else self.play()

    def toggle_backwards(self) -> None:
        """Pause while playing backwards; otherwise play backwards."""
        self.pause() if self.state.is_playing and self.rate < 0.0 else self.play_backwards()

    def stop(self) -> None:
        """Pause at the beginning."""
        self._stand(self._client.stop)

    # Positions.

    def seek(self, position_s: float) -> None:
        """Go to a position within the recording; playing or paused as before.

        While a seek is under way, only the newest other seek waits.
        """
        if self.state.is_available:
            sought = self.state.sought_at(position_s)
            self.state = self.state._replace(sought=sought)
            self._seeks.request(sought)
            self.moved.emit()

    def begin_scrub(self) -> None:
        """Pause while the operator drags."""
        if self.state.is_playing and not self.state.resumes:
            self.state = self.state._replace(resumes=True)
            self.pause()

    def end_scrub(self) -> None:
        """Play again after dragging, if it played before."""
        if self.state.resumes:
            self.state = self.state._replace(resumes=False)
            self._run(self._client.play)

    def set_step_unit(self, unit: StepUnit) -> None:
        """Set the unit of a step."""
        self.state = self.state._replace(unit=unit)
        self.changed.emit()

    def step(self, count: int) -> None:
        """Pause and move this number of steps forward, or (below 0) back."""
        if self.state.is_available:
            self._motion.stand()
            self._steps.request(count, self.state.unit)

    # Marks.

    def set_marks(self, marks: Iterable[PlacedMark]) -> None:
        """Set the marks of the recording."""
        self.state = self.state._replace(marks=Marks.of(marks))
        self.changed.emit()

    def to_next_mark(self) -> None:
        """Go to the next mark, if there is one."""
        next_s = self.state.marks.after(self.position_s)
        if next_s is not None:
            self.seek(next_s)

    def to_previous_mark(self) -> None:
        """Go to the previous mark, or to the beginning if there is none."""
        self.seek(self.state.marks.before(self.position_s, self.state.is_playing))

    # Rate.

    def set_rate(self, rate: float) -> None:
        """Change the rate at once; below 0 backwards; the nearest possible one is used."""
        if rate != 0.0:
            size = min(max(abs(rate), MIN_RATE), MAX_RATE)
            self._change_rate(size if rate > 0.0 else -size)

    def set_speed(self, speed: float) -> None:
        """Change the rate and keep the direction."""
        self.set_rate(-abs(speed) if self.rate < 0.0 else abs(speed))

    def faster(self) -> None:
        """Set the next higher speed of the ladder."""
        self._change_rate(faster(self.rate))

    def slower(self) -> None:
        """Set the next lower speed of the ladder."""
        self._change_rate(slower(self.rate))

    # Loop.

    def toggle_loop(self) -> None:
        """Repeat the part between A and B, or everything; or end repeating."""
        self._set_loop(not self.is_looping, self.state.points)

    def set_loop_begin(self, position_s: Optional[float] = None) -> None:
        """Repeat from a position (None: the current one) to B, or to the end without a later B."""
        points = self.state.points.with_begin(self._chosen(position_s))
        self._set_loop(True, points)
        if position_s is None and self.rate < 0.0:
            self._loop_now(points, points.bounds(self.state.duration_s)[1])

    def set_loop_end(self, position_s: Optional[float] = None) -> None:
        """Repeat up to a position (None: the current one); swap A and B if it lies before A."""
        end_s = self._chosen(position_s)
        points = self.state.points.with_end(end_s)
        self._set_loop(True, points)
        if position_s is None and self.rate > 0.0 and points.end_s == end_s:
            self._loop_now(points, points.bounds(self.state.duration_s)[0])

    def move_loop_point(self, which: str, position_s: float) -> None:
        """Drag 'A' or 'B' to a position, as far as the other point allows."""
        points = self.state.points.moved(which, position_s, self.state.duration_s)
        self._set_loop(self.is_looping, points)

    def clear_loop(self) -> None:
        """Remove A and B, and end repeating."""
        self._set_loop(False, LoopPoints())

    # Inside.

    def _newest(self, function: Callable[[Any], Any],
                on_done: Callable[[], None] = lambda: None) -> NewestCall[Any]:
        return NewestCall(self._tasks, LINE, function, on_done, self._fail)

    def _run(self, command: Callable[[], Any]) -> None:
        if self.state.is_available:
            self._tasks.run(LINE, command, None, self._fail)

    def _fail(self, error: Exception) -> None:
        """Return to the player's state, and report the error."""
        self.state = self.state.failed(self._seeks.wanted)
        self.changed.emit()
        if not isinstance(error, self._refused):
            raise error
        self.failed.emit(str(error))

    def _change_rate(self, rate: float) -> None:
        if self.state.is_available:
            self._motion.change_rate(rate)
            self.changed.emit()

    def _play_at(self, rate: float) -> None:
        if rate == self.rate and self._motion.rate is None:
            self._run(self._client.play)
        elif self.state.is_available:
            self._motion.play(rate)
            self.changed.emit()

    def _stand(self, command: Callable[[], Any]) -> None:
        self._motion.stand()
        self._run(command)

    def _arrive(self) -> None:
        """Show where the player is, once its state includes the newest seek."""
        self.state = self.state.arrived(self._seeks.done_since_s)

    def _chosen(self, position_s: Optional[float]) -> float:
        return self.state.within(self.position_s if position_s is None else position_s)

    def _loop_now(self, points: LoopPoints, start_s: float) -> None:
        """Begin the next pass: while playing, the position has just passed the new end."""
        if self.state.is_playing and self.state.points == points:
            self.seek(start_s)

    def _set_loop(self, on: bool, points: LoopPoints) -> None:
        if not self.state.is_available:
            return
        if not points.is_long_enough(self.state.duration_s):
            self.failed.emit(f'A and B must be at least {MIN_LOOP_S:g} s apart')
            return
        self.state = self.state._replace(points=points)
        if on or self.is_looping:
            self._loops.request((on, *points.bounds(self.state.duration_s)))
        self.changed.emit()


class PlayerCommands(Protocol):
    """Commands to the player (PlayerClient in clients/player_client.py); each call may block."""

    def wait_until_ready(self, timeout_s: float) -> Any:
        """Wait until the player accepts commands."""

    def play(self) -> Any:
        """Play."""

    def pause(self) -> Any:
        """Pause."""

    def stop(self) -> Any:
        """Pause at the beginning."""

    def seek(self, position_s: float) -> Any:
        """Go to a position [s]."""

    def set_rate(self, rate: float) -> Any:
        """Change the rate; below 0 backwards."""

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> Any:
        """Pause and move by messages or by a time [s]."""

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> Any:
        """Repeat the part between two positions [s], or end repeating."""


class PlayMotion(NamedTuple):
    """A rate, below 0 backwards, and whether to play then; else playing or paused as before."""

    rate: float
    plays: bool = False


class MotionCommands:
    """Sends one motion at a time, so that the player never plays in an outdated direction.

    A command to pause also keeps a waiting motion from playing.
    """

    def __init__(self, set_rate: Callable[[float], Any], play: Callable[[], Any],
                 newest: Newest) -> None:
        """Set the player's commands, and a maker of calls with the newest value."""
        self._set_rate = set_rate
        self._play = play
        self._calls = newest(self._send)

    @property
    def rate(self) -> Optional[float]:
        """The requested rate until the player has adopted it, then None."""
        wanted = self._calls.wanted
        return None if wanted is None else wanted.rate

    def change_rate(self, rate: float) -> None:
        """Change the rate; playing or paused as before."""
        waiting = self._calls.waiting
        self._calls.request(PlayMotion(rate, waiting is not None and waiting.plays))

    def play(self, rate: float) -> None:
        """Play as soon as the player has the rate."""
        self._calls.request(PlayMotion(rate, plays=True))

    def stand(self) -> None:
        """Keep a waiting motion from playing."""
        waiting = self._calls.waiting
        if waiting is not None:
            self._calls.request(waiting._replace(plays=False))

    def _send(self, motion: PlayMotion) -> None:
        self._set_rate(motion.rate)
        if motion.plays:
            self._play()


class SeekCommands:
    """Sends one seek at a time, and knows when the newest one was sent."""

    def __init__(self, client: PlayerCommands, clock: Callable[[], float],
                 newest: Newest) -> None:
        """Set the client of the player, and a maker of calls with the newest value.

        ``clock`` returns the wall time [s].
        """
        self._client = client
        self._clock = clock
        self._sent_s = 0.0
        self._calls = newest(self._send)

    @property
    def wanted(self) -> Optional[SeekTarget]:
        """The newest seek until the player has done it, then None."""
        return self._calls.wanted

    @property
    def done_since_s(self) -> Optional[float]:
        """The wall time [s] at which the newest seek was sent; None while it is under way."""
        return self._sent_s if self._calls.wanted is None else None

    def request(self, sought: SeekTarget) -> None:
        """Go to a position, unless a newer seek comes before its turn."""
        self._calls.request(sought)

    def _send(self, sought: SeekTarget) -> None:
        self._sent_s = self._clock()
        self._client.seek(sought.position_s)


class Steps(NamedTuple):
    """A number of steps forward, or (below 0) back."""

    number: int
    unit: StepUnit


class StepCommands:
    """Sends one step at a time; waiting steps of the same unit are merged, so that none pile up."""

    def __init__(self, client: PlayerCommands, newest: Newest) -> None:
        """Set the client of the player, and a maker of calls with the newest value."""
        self._client = client
        self._calls = newest(self._send)

    def request(self, count: int, unit: StepUnit) -> None:
        """Move this number of steps forward, or (below 0) back."""
        waiting = self._calls.waiting
        waits = waiting.number if waiting is not None and waiting.unit == unit else 0
        self._calls.request(Steps(waits + count, unit))

    def _send(self, steps: Steps) -> None:
        count, unit = steps
        if unit.duration_s:
            self._client.step(0, '', count * unit.duration_s)
        elif count:
            self._client.step(count, unit.topic, 0.0)
