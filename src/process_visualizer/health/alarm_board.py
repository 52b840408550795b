# SPDX-License-Identifier: BSD-3-Clause
"""Turns the present conditions of a cell into alarms and events: order, end, acknowledgment."""
from __future__ import annotations

import time
from enum import Enum
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.health.device_state import Level, said_of

MAX_EVENTS = 5000


class Action(Enum):
    """The operator's remedy for an alarm."""

    RESTART_DEVICE = 'Restart device'
    RESTART_PART = 'Restart'
    RESTART_RVIZ = 'Restart RViz'
    SHOW_LOG = 'Show log'
    GO_THERE = 'Go there'
    REPLAY = 'Replay'
    ACKNOWLEDGE = 'Acknowledge'


class Condition(NamedTuple):
    """Something that is wrong now.

    ``source`` is the device or other thing concerned; together with ``about`` it identifies the
    alarm even if the ``text`` changes. ``name`` replaces a text that is only about the present,
    once the condition has ended. Actions apply to ``part`` and ``node``. ``since_s`` is the start
    [s since the epoch], if known; alarms of a recording have a ``position_s``, where they begin in
    the recording. ``is_clause`` is set if the source is the subject of the text. ``end`` describes
    the end of the condition in the event. A latched condition remains an alarm after its end, until
    it is acknowledged. ``reported_by`` names the values that show whether the condition persists;
    it is empty if the condition is not about values. ``excess`` ranks occurrences by severity.
    ``times`` is how often the condition has begun (0: unknown), so that an unobserved end is
    noticed.
    """

    source: str
    about: str
    text: str
    level: Level
    actions: Tuple[Action, ...] = ()
    part: str = ''
    node: str = ''
    since_s: Optional[float] = None
    position_s: Optional[float] = None
    is_clause: bool = False
    end: str = 'over'
    is_latched: bool = False
    reported_by: Tuple[str, ...] = ()
    name: str = ''
    excess: float = 0.0
    times: int = 0

    @property
    def said(self) -> str:
        """Return source and text in one sentence."""
        return said_of(self.source, self.text, '' if self.is_clause else ':')


class Alarm(NamedTuple):
    """A condition, and when it began and ended [s since the epoch].

    An alarm that recurs before it is acknowledged counts its ``times`` since ``first_s``;
    ``worst_before`` is the worst of its earlier occurrences.
    """

    condition: Condition
    since_s: float
    ended_s: Optional[float] = None
    is_acknowledged: bool = False
    times: int = 1
    first_s: Optional[float] = None
    worst_before: Optional[Condition] = None

    @property
    def worst(self) -> Condition:
        """Return the condition as it was when it was worst."""
        before = self.worst_before
        return self.condition if before is None or self.condition.excess >= before.excess \
            else before


class Event(NamedTuple):
    """Something that happened [s since the epoch]."""

    time_s: float
    text: str


class AlarmBoard(NamedTuple):
    """The present alarms, and all events in order of time.

    Persisting alarms come before ended ones, and present ones before those of a recording; then the
    worst is first, then the oldest.
    """

    alarms: Tuple[Alarm, ...] = ()
    events: Tuple[Event, ...] = ()

    def seen(self, conditions: Iterable[Condition], now_s: float,
             end: Callable[[Condition], str] = lambda it: it.end) -> AlarmBoard:
        """Return the board for all present conditions; changes become events.

        An alarm that becomes worse is a change, too. Alarms of a recording never become events,
        because they depend on the position. Of several conditions of the same alarm the worst
        counts, and of equally bad ones the last. ``end`` returns the words for the end of a
        condition.
        """
        before = {_key(alarm.condition): alarm for alarm in self.alarms}
        present: Dict[Tuple[object, ...], Alarm] = {}
        events: List[Event] = []
        for key, condition in _worst(conditions).items():
            known = before.get(key)
            unseen = 0 if known is None or known.ended_s is not None else \
                max(condition.times - known.condition.times, 0)
            is_again = known is not None and (known.ended_s is not None or unseen > 0)
            since_s = known.since_s if known is not None and not is_again else \
                now_s if condition.since_s is None else condition.since_s
            if known is not None and unseen:
                events.append(Event(since_s, _begun_again(known, end(known.condition), unseen)))
            if known is None or is_again or condition.level > known.condition.level:
                events.append(Event(since_s if known is None or is_again else now_s,
                                    _begun(condition)))
            alarm = Alarm(condition, since_s) if known is None else known
            if is_again:
                alarm = alarm._replace(times=alarm.times + max(unseen, 1), is_acknowledged=False,
                                       first_s=alarm.since_s if alarm.first_s is None
                                       else alarm.first_s, worst_before=alarm.worst)
            present[key] = alarm._replace(condition=condition._replace(since_s=since_s),
                                          since_s=since_s, ended_s=None)
        for key, alarm in before.items():
            if key not in present:
                if alarm.ended_s is None:
                    events.append(Event(now_s, _ended(alarm, end(alarm.condition), now_s)))
                if alarm.condition.is_latched and not alarm.is_acknowledged:
                    present[key] = alarm if alarm.ended_s is not None else \
                        alarm._replace(ended_s=now_s)
        return self._of(present.values())._with(event for event in events if event.text)

    def acknowledged(self, condition: Condition, who: str, now_s: float) -> AlarmBoard:
        """Return the board with an alarm acknowledged; such an alarm disappears when it ends."""
        key = _key(condition)
        found = [it for it in self.alarms if _key(it.condition) == key and not it.is_acknowledged]
        if not found:
            return self
        alarms = (it._replace(is_acknowledged=True) if it in found else it for it in self.alarms)
        return self._of(it for it in alarms if it not in found and not (
            it.is_acknowledged and it.ended_s is not None))._with(
            [Event(now_s, f'{_counted(found[0])}: acknowledged by {who}')])

    def _of(self, alarms: Iterable[Alarm]) -> AlarmBoard:
        return self._replace(alarms=tuple(sorted(alarms, key=lambda it: (
            it.ended_s is not None, it.condition.position_s is not None, -it.condition.level,
            it.since_s))))

    def noted(self, text: str, now_s: float) -> AlarmBoard:
        """Return the board with one more event."""
        return self._with([Event(now_s, text)])

    def events_since(self, time_s: float) -> Tuple[Event, ...]:
        """Return the events from a time [s since the epoch] on."""
        return tuple(event for event in self.events if event.time_s >= time_s)

    def _with(self, events: Iterable[Event]) -> AlarmBoard:
        return self._replace(events=(*self.events, *events)[-MAX_EVENTS:])


def _key(condition: Condition) -> Tuple[object, ...]:
    return condition.source, condition.about, condition.position_s


def _worst(conditions: Iterable[Condition]) -> Dict[Tuple[object, ...], Condition]:
    found: Dict[Tuple[object, ...], Condition] = {}
    for condition in conditions:
        key = _key(condition)
        if key not in found or condition.level >= found[key].level:
            found[key] = condition
    return found


def _begun(condition: Condition) -> str:
    return '' if condition.position_s is not None else condition.said


def _begun_again(alarm: Alarm, end: str, unseen: int) -> str:
    """Return the event for one or more unobserved ends: the duration is unknown."""
    again = '' if unseen == 1 else f', and {unseen - 1} more of it since'
    begun = _begun(alarm.condition)
    return begun and f'{begun}: {end}{again}'


def _counted(alarm: Alarm) -> str:
    return alarm.worst.said + (f' ({alarm.times}×)' if alarm.times > 1 else '')


def _ended(alarm: Alarm, end: str, now_s: float) -> str:
    condition = alarm.condition
    begun = _begun(condition._replace(text=condition.name or condition.text))
    length_s = max(now_s - alarm.since_s, 0.0)
    return begun and f'{begun}: {end} after {length_s:.1f} s'


def events_text(events: Sequence[Event]) -> str:
    """Return one line per event: local date and time, and the text."""
    return '\n'.join(f'{_moment(event.time_s)}  {event.text}' for event in events)


def _moment(time_s: float) -> str:
    return time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(time_s))
