# SPDX-License-Identifier: BSD-3-Clause
"""The state of playback as seen by the operator: immutable values; changes return new values."""
from __future__ import annotations

import bisect
from types import MappingProxyType
from typing import Iterable, Mapping, NamedTuple, Optional, Tuple

from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.playback.timeline import MIN_LOOP_NS, NS_PER_S, is_too_slow

# The points A and B between which playback is repeated.

MIN_LOOP_S = MIN_LOOP_NS / NS_PER_S
_SAME_S = 1e-6


class LoopPoints(NamedTuple):
    """A and B [s from the beginning]; None means the beginning or end of the recording."""

    begin_s: Optional[float] = None
    end_s: Optional[float] = None

    def bounds(self, duration_s: float) -> Tuple[float, float]:
        """Return begin and end of the loop [s]."""
        return (0.0 if self.begin_s is None else self.begin_s,
                duration_s if self.end_s is None else self.end_s)

    def is_long_enough(self, duration_s: float) -> bool:
        """Return whether a player can repeat the loop."""
        begin_s, end_s = self.bounds(duration_s)
        return end_s - begin_s >= MIN_LOOP_S - _SAME_S

    def with_begin(self, time_s: float) -> LoopPoints:
        """Return the points with another A; a B before it is removed."""
        keeps_end = self.end_s is not None and self.end_s > time_s
        return LoopPoints(time_s, self.end_s if keeps_end else None)

    def with_end(self, time_s: float) -> LoopPoints:
        """Return the points with another B; if it lies before A, A and B are swapped."""
        if self.begin_s is not None and time_s < self.begin_s:
            return LoopPoints(time_s, self.begin_s)
        return LoopPoints(self.begin_s, time_s)

    def moved(self, which: str, time_s: float, duration_s: float) -> LoopPoints:
        """Return the points with 'A' or 'B' dragged to a time, as far as the other point allows."""
        begin_s, end_s = self.bounds(duration_s)
        if which == 'A':
            return self._replace(begin_s=max(min(time_s, end_s - MIN_LOOP_S), 0.0))
        return self._replace(end_s=min(max(time_s, begin_s + MIN_LOOP_S), duration_s))


def points_of(loop: Tuple[float, float], duration_s: float) -> LoopPoints:
    """Return the points of a player's loop; None for an end that is that of the recording."""
    begin_s, end_s = loop
    return LoopPoints(begin_s if begin_s > _SAME_S else None,
                      end_s if end_s < duration_s - _SAME_S else None)


# The marks of a recording, and the next and previous mark of a position.

_JUST_PASSED_S = 0.7  # while playing, "previous mark" skips a mark passed more recently
_HERE_S = 0.0005


class PlacedMark(NamedTuple):
    """A mark at a position [s from the beginning of the recording]."""

    position_s: float
    label: str


class Marks(NamedTuple):
    """Marks in order of time."""

    all: Tuple[PlacedMark, ...] = ()

    @staticmethod
    def of(marks: Iterable[PlacedMark]) -> Marks:
        """Return marks given in any order."""
        return Marks(tuple(sorted(marks)))

    def after(self, position_s: float) -> Optional[float]:
        """Return the position of the next mark [s]; None if there is none."""
        row = bisect.bisect_right(self._positions(), position_s + _HERE_S)
        return self.all[row].position_s if row < len(self.all) else None

    def before(self, position_s: float, playing: bool) -> float:
        """Return the position of the previous mark [s]; 0 if there is none."""
        before_s = position_s - (_JUST_PASSED_S if playing else _HERE_S)
        row = bisect.bisect_left(self._positions(), before_s)
        return self.all[row - 1].position_s if row else 0.0

    def _positions(self) -> Tuple[float, ...]:
        return tuple(mark.position_s for mark in self.all)


class StepUnit(NamedTuple):
    """The unit of a step: a message of a topic ('' for any), or a time [s] if that is not 0."""

    topic: str = ''
    duration_s: float = 0.0

    @property
    def label(self) -> str:
        """The name shown to the operator."""
        if self.duration_s:
            return f'{1000 * self.duration_s:g} ms'
        return self.topic or 'message'


MESSAGE = StepUnit()
TIMES = (StepUnit(duration_s=0.01), StepUnit(duration_s=0.1), StepUnit(duration_s=1.0))


class SeekTarget(NamedTuple):
    """The target of a seek [s from the beginning], and the segment that the seek will end."""

    position_s: float
    segment: int


class PlaybackState(NamedTuple):
    """The player's last state, None without a player, and the operator's choices.

    ``sought`` is the target of a seek that no state of the player includes yet. ``points`` stay
    while the loop is off, and ``points_of_others`` are those of other recordings, by their files.
    ``resumes`` says whether playback continues after dragging. ``files`` are the files of the last
    player. ``is_silent`` says that the player no longer reports.
    """

    snapshot: Optional[PlayerSnapshot] = None
    sought: Optional[SeekTarget] = None
    points: LoopPoints = LoopPoints()
    resumes: bool = False
    unit: StepUnit = MESSAGE
    marks: Marks = Marks()
    files: Tuple[str, ...] = ()
    is_silent: bool = False
    points_of_others: Mapping[Tuple[str, ...], LoopPoints] = MappingProxyType({})

    @property
    def is_available(self) -> bool:
        """Return whether there is a player to command."""
        return self.snapshot is not None

    @property
    def duration_s(self) -> float:
        """The length of the recording [s]; 0 without a player."""
        return 0.0 if self.snapshot is None else self.snapshot.duration_s

    @property
    def is_playing(self) -> bool:
        """Return whether the position moves."""
        return self.snapshot is not None and not self.snapshot.paused

    @property
    def loop(self) -> Optional[Tuple[float, float]]:
        """The part that the player repeats [s from the beginning]; None if it repeats nothing."""
        return None if self.snapshot is None else self.snapshot.loop

    @property
    def rate(self) -> float:
        """The player's rate; below 0 backwards."""
        return 1.0 if self.snapshot is None else self.snapshot.rate

    @property
    def reached_rate(self) -> Optional[float]:
        """The rate that the machine reaches, if it is below the wanted rate; else None."""
        if self.snapshot is None or self.snapshot.paused:
            return None
        reached = self.snapshot.achieved_rate
        return reached if is_too_slow(self.snapshot.rate, reached) else None

    @property
    def dropped(self) -> int:
        """The number of messages that slow subscribers did not get."""
        return 0 if self.snapshot is None else self.snapshot.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """The parts of the recording that the player cannot play."""
        return () if self.snapshot is None else self.snapshot.gaps

    def within(self, position_s: float) -> float:
        """Return a position [s], limited to the recording."""
        return min(max(position_s, 0.0), self.duration_s)

    def updated(self, snapshot: Optional[PlayerSnapshot], asks_for_loop: bool) -> PlaybackState:
        """Return the state with the newest state of the player.

        Another recording has the points that it had before; those of the same recording stay while
        there is no player.
        A loop set by another client is adopted, unless a loop is being requested here.
        """
        files = self.files if self.snapshot is None else self.snapshot.files
        before, state = self, self._replace(snapshot=snapshot, files=files, is_silent=False)
        if _files(self.snapshot) != _files(snapshot):
            before = PlaybackState()
        if snapshot is not None and snapshot.files != files:
            state = state._replace(
                points=self.points_of_others.get(snapshot.files, LoopPoints()),
                points_of_others={**self.points_of_others, files: self.points})
        return state if asks_for_loop or state.loop == before.loop else state.with_players_loop()

    def sought_at(self, position_s: float) -> SeekTarget:
        """Return a seek from here to a position [s], limited to the recording."""
        segment = 0 if self.snapshot is None else self.snapshot.segment
        return SeekTarget(self.within(position_s), segment)

    def arrived(self, sent_s: Optional[float]) -> PlaybackState:
        """Return the state without its seek if the player's state already includes the seek.

        ``sent_s`` is the wall time [s] at which the seek was sent; None while it is under way.
        """
        if self.snapshot is None or (self.sought is not None
                                     and _includes(self.snapshot, self.sought, sent_s)):
            return self._replace(sought=None)
        return self

    def failed(self, wanted: Optional[SeekTarget]) -> PlaybackState:
        """Return the player's own state after a failure, except for a seek that is still wanted."""
        sought = None if self.snapshot is None else wanted
        return self._replace(sought=sought).with_players_loop()

    def with_players_loop(self) -> PlaybackState:
        """Return the state with the points of the player's loop, if it repeats one."""
        if self.loop is None:
            return self
        return self._replace(points=points_of(self.loop, self.duration_s))

    def differs_from(self, other: PlaybackState) -> bool:
        """Return whether the player's state differs in more than the position."""
        return (self.is_silent != other.is_silent
                or _without_position(self.snapshot) != _without_position(other.snapshot))


def _files(snapshot: Optional[PlayerSnapshot]) -> Optional[Tuple[str, ...]]:
    return None if snapshot is None else snapshot.files


def _includes(snapshot: PlayerSnapshot, sought: SeekTarget, sent_s: Optional[float]) -> bool:
    return (sent_s is not None and snapshot.stamp_s >= sent_s
            and snapshot.segment != sought.segment)


def _without_position(snapshot: Optional[PlayerSnapshot]) -> Optional[PlayerSnapshot]:
    if snapshot is None:
        return None
    return snapshot._replace(stamp_s=0.0, position_s=0.0, published=0, segment=0,
                             achieved_rate=round(snapshot.achieved_rate, 2))


MAX_AHEAD_S = 0.5  # a player that has been silent for longer may have ended


class PlaybackPosition:
    """The position, even between two states; it never moves against the direction of play."""

    def __init__(self) -> None:
        self._snapshot: Optional[PlayerSnapshot] = None
        self._shown_s = 0.0

    def take(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Update from the newest state of the player; None if the player is gone."""
        before, self._snapshot = self._snapshot, snapshot
        if snapshot is None:
            return
        away_s = abs(snapshot.position_s - self._shown_s)
        has_slipped = away_s > MAX_AHEAD_S * max(abs(snapshot.rate), 1.0)  # after it has hung
        if before is None or not _continues(before, snapshot) or has_slipped:
            self._shown_s = snapshot.position_s

    def at(self, now_s: float) -> float:
        """Return the position [s] at a wall time [s] not before that of the last call."""
        snapshot = self._snapshot
        if snapshot is None:
            return 0.0
        expected_s = _position(snapshot, now_s)
        if snapshot.paused:
            self._shown_s = expected_s
        elif snapshot.rate > 0.0:
            self._shown_s = max(self._shown_s, expected_s)
        else:
            self._shown_s = min(self._shown_s, expected_s)
        return self._shown_s


def _continues(before: PlayerSnapshot, after: PlayerSnapshot) -> bool:
    """Return whether both belong to one uninterrupted movement."""
    return (before.segment == after.segment and before.files == after.files
            and before.paused == after.paused and (before.rate > 0.0) == (after.rate > 0.0))


def _position(snapshot: PlayerSnapshot, now_s: float) -> float:
    if snapshot.paused:
        return snapshot.position_s
    until_s = min(max(now_s, snapshot.stamp_s), snapshot.stamp_s + MAX_AHEAD_S)
    clamp = min if snapshot.rate > 0.0 else max
    return clamp(snapshot.clock_state.position_at(until_s), _limit(snapshot))


def _limit(snapshot: PlayerSnapshot) -> float:
    """Return where play ends or jumps: at the loop's end, or past the loop, at the recording's."""
    loop = snapshot.loop
    if snapshot.rate > 0.0:
        return loop[1] if loop and snapshot.position_s <= loop[1] else snapshot.duration_s
    return loop[0] if loop and snapshot.position_s >= loop[0] else 0.0
