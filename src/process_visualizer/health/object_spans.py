# SPDX-License-Identifier: BSD-3-Clause
"""Times, or spans of a recording, at which unmodelled objects were near a robot."""
from __future__ import annotations

import math
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple

from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import NearObject, SeenObject

_JOIN_S = 0.2  # what is nearer to each other is one span


class Span(NamedTuple):
    """From when to when [s] a sensor saw something near, and the nearest of it in words."""

    device: str
    level: Level
    begin_s: float
    end_s: float
    text: str = ''
    distance_m: float = math.inf

    def joined(self, other: Span) -> Span:
        """Return both as one, with the words of the nearer one."""
        nearer = min(self, other, key=lambda it: it.distance_m)
        return nearer._replace(begin_s=min(self.begin_s, other.begin_s),
                               end_s=max(self.end_s, other.end_s))


def times(spans: Iterable[Span], level: Level) -> Tuple[Tuple[float, float], ...]:
    """Return begin and end [s] of the spans of a level."""
    return tuple((it.begin_s, it.end_s) for it in spans if it.level is level)


class Moment(NamedTuple):
    """A time [s]; what lies between two of one segment was passed."""

    segment: int
    time_s: float


class ObjectSpans:
    """Collects spans from what is seen at one moment after the other, in any order of time."""

    def __init__(self) -> None:
        self._spans: List[Span] = []
        self._last: Dict[Tuple[str, int, Level], Moment] = {}
        self._begun: Dict[Tuple[str, int], Moment] = {}

    @property
    def spans(self) -> Tuple[Span, ...]:
        """All of them in the order of time; those of a sensor and a level do not overlap."""
        return tuple(sorted(self._spans, key=lambda it: (it.begin_s, it.level)))

    def begun_s(self, device: str, number: int) -> Optional[float]:
        """Return since when the object is near that a sensor sees; None: it was not seen."""
        begun = self._begun.get((device, number))
        return None if begun is None else begun.time_s

    def take(self, device: str, seen: Iterable[SeenObject], near: Iterable[NearObject],
             moment: Moment) -> None:
        """Take what a sensor sees at a moment, and what of it is held to be near."""
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
        """Forget what ended before a time [s]."""
        self._spans = [it for it in self._spans if it.end_s >= before_s]

    def _extend(self, device: str, level: Level, seen: SeenObject, last: Moment,
                moment: Moment) -> None:
        from_s = last.time_s if last.segment == moment.segment else moment.time_s
        span = self._join(Span(device, level, min(from_s, moment.time_s),
                               max(from_s, moment.time_s), f'object {seen.place()}',
                               seen.distance_m))
        begun = self._begun.get((device, seen.number))
        if begun is None or begun.segment != moment.segment:
            self._begun[device, seen.number] = Moment(moment.segment, span.begin_s)

    def _join(self, span: Span) -> Span:
        """Add a span; return that into which it was joined with those that it touches."""
        for other in [it for it in self._spans if _touch(it, span)]:
            self._spans.remove(other)
            span = span.joined(other)
        self._spans.append(span)
        return span


def _touch(one: Span, other: Span) -> bool:
    return (one.device, one.level) == (other.device, other.level) \
        and one.begin_s <= other.end_s + _JOIN_S and other.begin_s <= one.end_s + _JOIN_S
