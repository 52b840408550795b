# SPDX-License-Identifier: BSD-3-Clause
"""Decides which unmodeled objects are too near to a robot, and how long that holds."""
from __future__ import annotations

import math
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple

from process_visualizer.health.device_state import Level
from process_visualizer.msg import DetectedObject, DetectedObjects

HOLD_S = 0.5
"""Hold time before *near* is cleared, so that a temporarily occluded object does not flicker."""
MARGIN_M = 0.03
"""Distance beyond the limit at which *near* is cleared, so that noise has no effect."""
SILENT_S = 3.0
"""Maximum age of a running sensor's last message; beyond it the objects are unknown."""
START_S = 15.0
"""Time limit for the first message, while the sensor starts and the cell's models load."""
_ALARMS = Level.WARNING, Level.BAD
_LEVELS = {DetectedObject.CLEAR: Level.GOOD, DetectedObject.WARN: Level.WARNING,
           DetectedObject.STOP: Level.BAD}


class SeenObject(NamedTuple):
    """An object as seen by a sensor: edge lengths of its box, distance to a robot's link [m].

    ``level`` is WARNING or BAD if it is nearer than the distance ``warn`` or ``stop``, else GOOD.
    The center and the yaw of the box are in the global frame. See DetectedObject.msg.
    """

    number: int
    link: str
    distance_m: float
    size_m: Tuple[float, float, float]
    level: Level
    center_m: Tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0
    speed_m_s: float = 0.0
    is_seen: bool = True
    is_confirmed: bool = True

    def place(self) -> str:
        """Return its distance and its size: '0.31 m from arm's hand: 24 × 18 × 30 cm'."""
        return f'{self.distance_text()}: {self.size_text()}'

    def distance_text(self) -> str:
        """Return its distance from the nearest link: '0.31 m from arm's hand'."""
        robot, _, link = self.link.rpartition('/')
        whose = f"{robot}'s " if robot else ''
        return f'{self.distance_m:.2f} m from {whose}{link}'

    def size_text(self) -> str:
        """Return the edge lengths of its box: '24 × 18 × 30 cm'."""
        return f'{" × ".join(f"{100.0 * it:.0f}" for it in self.size_m)} cm'


def seen_objects(message: DetectedObjects) -> Tuple[SeenObject, ...]:
    """Return the objects in a sensor's message; an unknown level counts as BAD."""
    return tuple(
        SeenObject(it.number, it.link, it.distance, (it.size.x, it.size.y, it.size.z),
                   _LEVELS.get(it.level, Level.BAD),
                   (it.pose.position.x, it.pose.position.y, it.pose.position.z),
                   2.0 * math.atan2(it.pose.orientation.z, it.pose.orientation.w),
                   math.hypot(math.hypot(it.velocity.x, it.velocity.y), it.velocity.z),
                   bool(it.is_seen), bool(it.is_confirmed)) for it in message.objects)


class NearObject(NamedTuple):
    """An object as last seen, its level after hold time and margin, and the start of *near* [s]."""

    seen: SeenObject
    level: Level
    since_s: float


class _Followed(NamedTuple):
    seen: SeenObject
    latest: Level
    reached_s: Dict[Level, float]
    since_s: float

    def level(self, now_s: float) -> Level:
        held = [it for it, at_s in self.reached_s.items() if now_s < at_s + HOLD_S]
        return max([self.latest, *held])


class ObjectWatch:
    """Judges the objects of one sensor as its messages arrive; times [s] must not decrease."""

    def __init__(self, warn_m: float, stop_m: float) -> None:
        """Initialize with the distances [m] below which an object is near, and too near."""
        self._limits_m = {Level.WARNING: warn_m, Level.BAD: stop_m}
        self._followed: Dict[int, _Followed] = {}

    def take(self, objects: Iterable[SeenObject], now_s: float) -> None:
        """Update with all objects seen now."""
        before = {number: it._replace(latest=Level.GOOD) for number, it in self._followed.items()
                  if it.level(now_s) in _ALARMS}
        self._followed = before
        for seen in objects:
            self._follow(seen, before.get(seen.number), now_s)

    def present(self, now_s: float) -> Tuple[NearObject, ...]:
        """Return the objects that are near, the worst first, then the nearest."""
        near = [NearObject(it.seen, it.level(now_s), it.since_s)
                for it in self._followed.values() if it.level(now_s) in _ALARMS]
        return tuple(sorted(near, key=lambda it: (-it.level, it.seen.distance_m)))

    def ends_s(self, now_s: float) -> Optional[float]:
        """Return when the next alarm ends or weakens if nothing else is seen; None if none will."""
        ends = [at_s + HOLD_S for it in self._followed.values()
                for level, at_s in it.reached_s.items() if level > it.latest]
        return min((it for it in ends if it > now_s), default=None)

    def _follow(self, seen: SeenObject, before: Optional[_Followed], now_s: float) -> None:
        latest = self._judged(seen, Level.GOOD if before is None else before.level(now_s))
        if before is None and latest not in _ALARMS:
            return
        reached_s = {} if before is None else before.reached_s
        self._followed[seen.number] = _Followed(
            seen, latest, {**reached_s, **{it: now_s for it in _ALARMS if it <= latest}},
            now_s if before is None else before.since_s)

    def _judged(self, seen: SeenObject, held: Level) -> Level:
        """Return the level of an object; it holds until the object is clearly farther away."""
        kept = [level for level, limit_m in self._limits_m.items()
                if level <= held and seen.distance_m < limit_m + MARGIN_M]
        return max([seen.level, *kept])


_JOIN_S = 0.2  # spans with a shorter gap are joined


class NearSpan(NamedTuple):
    """A time span [s] in which a sensor saw near objects, and the nearest one in words."""

    device: str
    level: Level
    begin_s: float
    end_s: float
    text: str = ''
    distance_m: float = math.inf

    def joined(self, other: NearSpan) -> NearSpan:
        """Return both spans as one, with the text of the nearer object."""
        nearer = min(self, other, key=lambda it: it.distance_m)
        return nearer._replace(begin_s=min(self.begin_s, other.begin_s),
                               end_s=max(self.end_s, other.end_s))


def times(spans: Iterable[NearSpan], level: Level) -> Tuple[Tuple[float, float], ...]:
    """Return start and end [s] of the spans with a level."""
    return tuple((it.begin_s, it.end_s) for it in spans if it.level is level)


class NearMoment(NamedTuple):
    """A time [s]; the time between two moments of one segment was covered without a jump."""

    segment: int
    time_s: float


class ObjectSpans:
    """Collects spans from the objects seen at successive moments, whose times need no order."""

    def __init__(self) -> None:
        self._spans: List[NearSpan] = []
        self._last: Dict[Tuple[str, int, Level], NearMoment] = {}
        self._begun: Dict[Tuple[str, int], NearMoment] = {}

    @property
    def spans(self) -> Tuple[NearSpan, ...]:
        """The spans in order of time; spans of the same sensor and level do not overlap."""
        return tuple(sorted(self._spans, key=lambda it: (it.begin_s, it.level)))

    def begun_s(self, device: str, number: int) -> Optional[float]:
        """Return when a sensor's object came near; None if the object was not seen near."""
        begun = self._begun.get((device, number))
        return None if begun is None else begun.time_s

    def take(self, device: str, seen: Iterable[SeenObject], near: Iterable[NearObject],
             moment: NearMoment) -> None:
        """Add the objects that a sensor sees at a moment, and those judged as near."""
        before = self._last
        self._last = {key: it for key, it in before.items() if key[0] != device}
        present = tuple(seen)
        for it in near:
            if it.seen in present:
                for level in (Level.WARNING, Level.BAD):
                    if level <= it.level:
                        key = device, it.seen.number, level
                        self._last[key] = moment
                        self._extend(device, level, it.seen, before.get(key, moment), moment)

    def forget(self, before_s: float) -> None:
        """Forget spans that ended before a time [s]."""
        self._spans = [it for it in self._spans if it.end_s >= before_s]

    def _extend(self, device: str, level: Level, seen: SeenObject, last: NearMoment,
                moment: NearMoment) -> None:
        from_s = last.time_s if last.segment == moment.segment else moment.time_s
        span = self._join(NearSpan(device, level, min(from_s, moment.time_s),
                                   max(from_s, moment.time_s), f'object {seen.place()}',
                                   seen.distance_m))
        begun = self._begun.get((device, seen.number))
        if begun is None or begun.segment != moment.segment:
            self._begun[device, seen.number] = NearMoment(moment.segment, span.begin_s)

    def _join(self, span: NearSpan) -> NearSpan:
        """Add a span, joined with those that it touches; return the joined span."""
        for other in [it for it in self._spans if _touch(it, span)]:
            self._spans.remove(other)
            span = span.joined(other)
        self._spans.append(span)
        return span


def _touch(one: NearSpan, other: NearSpan) -> bool:
    return (one.device, one.level) == (other.device, other.level) \
        and one.begin_s <= other.end_s + _JOIN_S and other.begin_s <= one.end_s + _JOIN_S
