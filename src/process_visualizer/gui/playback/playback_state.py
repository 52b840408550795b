# SPDX-License-Identifier: BSD-3-Clause
"""The state of playback as an operator sees it, as a value: what changes it returns another one."""
from __future__ import annotations

import bisect
from typing import Iterable, NamedTuple, Optional, Tuple

from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.playback.timeline import MIN_LOOP_NS, NS_PER_S

# The points A and B between which playback is repeated.

MIN_LOOP_S = MIN_LOOP_NS / NS_PER_S
_SAME_S = 1e-6


class LoopPoints(NamedTuple):
    """A and B [s from the beginning]; None: the beginning or the end of the recording."""

    begin_s: Optional[float] = None
    end_s: Optional[float] = None

    def bounds(self, duration_s: float) -> Tuple[float, float]:
        """Return where the loop of a recording begins and ends [s]."""
        return (0.0 if self.begin_s is None else self.begin_s,
                duration_s if self.end_s is None else self.end_s)

    def is_long_enough(self, duration_s: float) -> bool:
        """Return whether a player can repeat it."""
        begin_s, end_s = self.bounds(duration_s)
        return end_s - begin_s >= MIN_LOOP_S - _SAME_S

    def with_begin(self, time_s: float) -> LoopPoints:
        """Return the points with another A; a B before it is given up: A to the end."""
        keeps_end = self.end_s is not None and self.end_s > time_s
        return LoopPoints(time_s, self.end_s if keeps_end else None)

    def with_end(self, time_s: float) -> LoopPoints:
        """Return the points with another B; if it lies before A, they change places."""
        if self.begin_s is not None and time_s < self.begin_s:
            return LoopPoints(time_s, self.begin_s)
        return LoopPoints(self.begin_s, time_s)

    def moved(self, which: str, time_s: float, duration_s: float) -> LoopPoints:
        """Return the points with 'A' or 'B' dragged to a time, as far as the other one allows."""
        begin_s, end_s = self.bounds(duration_s)
        if which == 'A':
            return self._replace(begin_s=max(min(time_s, end_s - MIN_LOOP_S), 0.0))
        return self._replace(end_s=min(max(time_s, begin_s + MIN_LOOP_S), duration_s))


def points_of(loop: Tuple[float, float], duration_s: float) -> LoopPoints:
    """Return the points of a player's loop: none where it is the whole recording."""
    begin_s, end_s = loop
    return LoopPoints(begin_s if begin_s > _SAME_S else None,
                      end_s if end_s < duration_s - _SAME_S else None)


# The marks of a recording, and which of them is next to a position.

_JUST_PASSED_S = 0.7  # while playing, "previous mark" leads farther than to one just passed
_HERE_S = 0.0005


class PlacedMark(NamedTuple):
    """A mark, in s from the beginning of the recording."""

    position_s: float
    label: str


class Marks(NamedTuple):
    """Marks in the order of time."""

    all: Tuple[PlacedMark, ...] = ()

    @staticmethod
    def of(marks: Iterable[PlacedMark]) -> Marks:
        """Return marks that come in any order."""
        return Marks(tuple(sorted(marks)))

    def after(self, position_s: float) -> Optional[float]:
        """Return where the next mark is [s]; None if there is none."""
        row = bisect.bisect_right(self._positions(), position_s + _HERE_S)
        return self.all[row].position_s if row < len(self.all) else None

    def before(self, position_s: float, playing: bool) -> float:
        """Return where the mark before is [s], before the first one the beginning."""
        before_s = position_s - (_JUST_PASSED_S if playing else _HERE_S)
        row = bisect.bisect_left(self._positions(), before_s)
        return self.all[row - 1].position_s if row else 0.0

    def _positions(self) -> Tuple[float, ...]:
        return tuple(mark.position_s for mark in self.all)


class StepUnit(NamedTuple):
    """A message of a topic ('' for any), or, where it is not 0, a time [s]."""

    topic: str = ''
    duration_s: float = 0.0

    @property
    def label(self) -> str:
        """Return what the operator reads."""
        if self.duration_s:
            return f'{1000 * self.duration_s:g} ms'
        return self.topic or 'message'


MESSAGE = StepUnit()
TIMES = (StepUnit(duration_s=0.01), StepUnit(duration_s=0.1), StepUnit(duration_s=1.0))


_KEPT_SHARE = 0.95  # of the rate; what is reached above this is not worth telling


class SeekTarget(NamedTuple):
    """A position [s from the beginning] that was asked for in a segment, which this is to end."""

    position_s: float
    segment: int


class PlaybackState(NamedTuple):
    """The player's last state, None where there is none, and the operator's choices.

    ``sought`` is where a seek leads that no state of the player includes yet; ``points`` stay
    while the loop is off; ``resumes`` says whether it plays on after dragging; ``files`` are
    those of the player that was there last.
    """

    snapshot: Optional[PlayerSnapshot] = None
    sought: Optional[SeekTarget] = None
    points: LoopPoints = LoopPoints()
    resumes: bool = False
    unit: StepUnit = MESSAGE
    marks: Marks = Marks()
    files: Tuple[str, ...] = ()

    @property
    def is_available(self) -> bool:
        """Return whether there is a player to command."""
        return self.snapshot is not None

    @property
    def duration_s(self) -> float:
        """Return how long the recording is; 0 while there is no player."""
        return 0.0 if self.snapshot is None else self.snapshot.duration_s

    @property
    def is_playing(self) -> bool:
        """Return whether the position moves."""
        return self.snapshot is not None and not self.snapshot.paused

    @property
    def loop(self) -> Optional[Tuple[float, float]]:
        """Return what the player repeats [s from the beginning]; None if it does not."""
        return None if self.snapshot is None else self.snapshot.loop

    @property
    def rate(self) -> float:
        """The player's rate; below 0 backwards."""
        return 1.0 if self.snapshot is None else self.snapshot.rate

    @property
    def reached_rate(self) -> Optional[float]:
        """The rate that the machine reaches, if that is less than the rate wanted."""
        if self.snapshot is None or self.snapshot.paused:
            return None
        reached = self.snapshot.achieved_rate
        return None if abs(reached) >= _KEPT_SHARE * abs(self.snapshot.rate) else reached

    @property
    def dropped(self) -> int:
        """Return how many messages slow subscribers did not get."""
        return 0 if self.snapshot is None else self.snapshot.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """Return what the player cannot play."""
        return () if self.snapshot is None else self.snapshot.gaps

    def within(self, position_s: float) -> float:
        """Return a position [s], or the nearer end of the recording where it lies outside."""
        return min(max(position_s, 0.0), self.duration_s)

    def updated(self, snapshot: Optional[PlayerSnapshot], asks_for_loop: bool) -> PlaybackState:
        """Take the newest state of the player.

        Another recording has no points; those of this one stay while its player is away. A loop
        that somebody else has set is taken over, unless one is being asked for.
        """
        files = self.files if self.snapshot is None else self.snapshot.files
        before, state = self, self._replace(snapshot=snapshot, files=files)
        if _files(self.snapshot) != _files(snapshot):
            before = PlaybackState()
        if snapshot is not None and snapshot.files != files:
            state = state._replace(points=LoopPoints())
        return state if asks_for_loop or state.loop == before.loop else state.with_players_loop()

    def sought_at(self, position_s: float) -> SeekTarget:
        """Return a seek from here to a position [s], or to the nearer end."""
        segment = 0 if self.snapshot is None else self.snapshot.segment
        return SeekTarget(self.within(position_s), segment)

    def arrived(self, sent_s: Optional[float]) -> PlaybackState:
        """Forget a seek that was sent at a wall time [s], once the player's state includes it.

        None: it is under way.
        """
        if self.snapshot is None or (self.sought is not None
                                     and _tells(self.snapshot, self.sought, sent_s)):
            return self._replace(sought=None)
        return self

    def failed(self, wanted: Optional[SeekTarget]) -> PlaybackState:
        """Return to what the player does, but for a seek that it is still asked for."""
        sought = None if self.snapshot is None else wanted
        return self._replace(sought=sought).with_players_loop()

    def with_players_loop(self) -> PlaybackState:
        """Take the points of the loop that the player repeats, if it does."""
        if self.loop is None:
            return self
        return self._replace(points=points_of(self.loop, self.duration_s))

    def differs_from(self, other: PlaybackState) -> bool:
        """Return whether the player says anything else but another position."""
        return _without_position(self.snapshot) != _without_position(other.snapshot)


def _files(snapshot: Optional[PlayerSnapshot]) -> Optional[Tuple[str, ...]]:
    return None if snapshot is None else snapshot.files


def _tells(snapshot: PlayerSnapshot, sought: SeekTarget, sent_s: Optional[float]) -> bool:
    return (sent_s is not None and snapshot.stamp_s >= sent_s
            and snapshot.segment != sought.segment)


def _without_position(snapshot: Optional[PlayerSnapshot]) -> Optional[PlayerSnapshot]:
    if snapshot is None:
        return None
    return snapshot._replace(stamp_s=0.0, position_s=0.0, published=0, segment=0,
                             achieved_rate=round(snapshot.achieved_rate, 2))


MAX_AHEAD_S = 0.5  # a player that has said nothing for so long may have ended


class PlaybackPosition:
    """Goes on evenly between two states, and never back while playing forward (or vice versa)."""

    def __init__(self) -> None:
        self._snapshot: Optional[PlayerSnapshot] = None
        self._shown_s = 0.0

    def take(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Take the newest state; None when there is no player any more."""
        before, self._snapshot = self._snapshot, snapshot
        if snapshot is not None and (before is None or not _continues(before, snapshot)):
            self._shown_s = snapshot.position_s

    def at(self, now_s: float) -> float:
        """Return the position [s] at a wall time [s], which does not decrease between calls."""
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
    """Return the end or jump of play; from outside of the loop, and not before it, the bounds."""
    loop = snapshot.loop
    if snapshot.rate > 0.0:
        return loop[1] if loop and snapshot.position_s <= loop[1] else snapshot.duration_s
    return loop[0] if loop and snapshot.position_s >= loop[0] else 0.0
