# SPDX-License-Identifier: BSD-3-Clause
"""Output of messages before they are due; those not sent yet can be taken back."""
from __future__ import annotations

from collections import deque
from typing import (
    Callable,
    Deque,
    Dict,
    FrozenSet,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Protocol,
    Tuple,
)

from process_visualizer.bagio.message_layout import Data, with_stamps_moved
from process_visualizer.playback.message_loader import LoadedMessage, first_stamp_ns
from process_visualizer.playback.playback_event import PlaybackEvent
from process_visualizer.playback.stamp_mapping import MAX_DISTANCE_NS, StampMapping
from process_visualizer.playback.timeline import NS_PER_S, Clock, TimelineState


class Scheduled(NamedTuple):
    """An event given to the output before it is due."""

    event: PlaybackEvent
    position: int
    step: int  # FORWARD or BACKWARD
    due_ns: int  # monotonic
    given: int  # number of messages given to the output before the event
    stamps: int  # StampMapping.remembered before the event


class SendSchedule:
    """Events in the order in which they were given, as the output will send them."""

    def __init__(self) -> None:
        self._events: Deque[Scheduled] = deque()
        self._bytes = 0

    @property
    def bytes(self) -> int:
        """Return the approximate memory [bytes] used by the messages."""
        return self._bytes

    def add(self, scheduled: Scheduled) -> None:
        """Add the event given last; it is not sent before those given earlier."""
        if self._events and scheduled.due_ns < self._events[-1].due_ns:
            scheduled = scheduled._replace(due_ns=self._events[-1].due_ns)
        self._events.append(scheduled)
        self._bytes += scheduled.event.size

    def forget_due(self, now_ns: int) -> None:
        """Forget events due before a monotonic time [ns]: they cannot be taken back."""
        while self._events and self._events[0].due_ns < now_ns:
            self._bytes -= self._events.popleft().event.size

    def taken_back(self, given: int) -> Iterator[Scheduled]:
        """Yield the events given after a number of messages, the last first, and remove them."""
        while self._events and self._events[-1].given >= given:
            scheduled = self._events.pop()
            self._bytes -= scheduled.event.size
            yield scheduled


RestoredStamps = Tuple[Tuple[int, int], ...]
"""Stamps of sensors' messages as published, ascending, each with the bag time it shows [ns]."""


class Output(Protocol):
    """The receiver of played messages; called by one thread."""

    def publish(self, connection: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of a connection, given in pieces, at a monotonic time [ns].

        Messages are sent in the order given. This method must not wait for receivers.
        """

    def withdraw(self, connection: int, due_ns: int) -> None:
        """Drop the latched message of a connection's source at a monotonic time [ns].

        ``revoke`` counts this as a message.
        """

    def revoke(self, after_ns: int) -> int:
        """Take back the last messages that are due after a monotonic time [ns]; return how many.

        Messages that are being sent, or were given when already due, stay, as do all messages given
        before these or due at the same time.
        """

    def jump(self, bag_ns: int) -> None:
        """Note that the position jumped to a bag time [ns]; its scene follows."""

    def restored(self, stamps: RestoredStamps) -> None:
        """Note the messages just published that are stamped with the present time."""

    def finish(self) -> bool:
        """Note that play has reached its end; return whether nothing will follow."""


LEAD_NS = NS_PER_S // 10  # how long before they are due messages are given to the output
SETTLING_NS = NS_PER_S // 10  # time without message or command until the scene is repeated
MAX_RESTORED = 100  # maximum number of reported stamps: those of a scene and of the last steps
AT_ONCE = 0  # a monotonic time [ns] that has passed


class ScheduledOutput:
    """An output that keeps track of the messages given to it, and of when it has settled.

    All methods but ``published`` are for the publishing thread only.
    """

    def __init__(self, output: Output, clock: Clock, mapping: Optional[StampMapping],
                 lead_bytes: int, sensors: FrozenSet[int]) -> None:
        """Initialize with the output, and the mapping of stamps (None: stamps stay as recorded).

        At most about ``lead_bytes`` are given to the output before they are due. ``sensors`` are
        the connections of sensors.
        """
        self._output = output
        self._clock = clock
        self._mapping = mapping
        self._lead_bytes = lead_bytes
        self._sensors = sensors
        self._restored: Dict[int, int] = {}
        self._schedule = SendSchedule()
        self._given = 0  # number of messages given to the output, including withdrawn ones
        self._published = 0
        self._settled_ns: Optional[int] = None

    @property
    def published(self) -> int:
        """Number of published messages, including those of the next moment."""
        return self._published

    @property
    def settled_ns(self) -> Optional[int]:
        """The monotonic time [ns] at which the output settles; None: it is settled already."""
        return self._settled_ns

    def lead_ns(self) -> int:
        """Return how long before its due time the next message may be given [ns]."""
        self._schedule.forget_due(self._clock.monotonic_ns())
        return LEAD_NS if self._schedule.bytes < self._lead_bytes else 0

    def give(self, event: PlaybackEvent, position: int, step: int, state: TimelineState) -> None:
        """Give the event of passing the message at a position, to be sent when it is due.

        The state must be playing.
        """
        stamps = 0 if self._mapping is None else self._mapping.remembered
        due_ns = state.due_ns(event.time_ns)
        assert due_ns is not None, 'it plays'
        self._schedule.add(Scheduled(event, position, step, due_ns, self._given, stamps))
        self.show(event, state, due_ns)
        self._unsettle(due_ns)  # even for an event without messages, as of a delayed sensor

    def take_back(self) -> List[Scheduled]:
        """Take back the events not sent yet; return them, the last first."""
        count = self._output.revoke(self._clock.monotonic_ns())
        if count:
            self._unsettle()
        self._given -= count
        taken_back = list(self._schedule.taken_back(self._given))
        for scheduled in taken_back:
            self._published -= scheduled.event.published
            if self._mapping is not None:
                self._mapping.forget_since(scheduled.stamps)
        return taken_back

    def show(self, event: PlaybackEvent, state: TimelineState, due_ns: int = AT_ONCE) -> None:
        """Send an event at a monotonic time [ns]."""
        for message in event.messages:
            stamper = self._stamper(state, message.time_ns, event.time_ns, due_ns)
            self._publish(message, stamper, due_ns)
        if state.paused:
            self._report_restored(event, state)

    def restore(self, event: PlaybackEvent, state: TimelineState) -> None:
        """Send a scene at once, with the present time as stamps."""
        for message in event.messages:
            self._publish(message, lambda stamp_ns: self._present(state, stamp_ns), AT_ONCE)
        self._restored.clear()
        self._report_restored(event, state)

    def forget_stamps(self) -> None:
        """Give new stamps to messages published again."""
        if self._mapping is not None:
            self._mapping.forget()

    def settle(self) -> None:
        """Note that nothing needs to be repeated."""
        self._settled_ns = None

    def jump(self, bag_ns: int) -> None:
        """Notify the output that the position jumped to a bag time [ns]; its scene follows."""
        self._restored.clear()
        self._output.jump(bag_ns)

    def finish(self) -> bool:
        """Notify the output that play has reached its end; return whether nothing will follow."""
        return self._output.finish()

    def _stamper(self, state: TimelineState, message_ns: int, shown_ns: int,
                 due_ns: int) -> Callable[[int], int]:
        mapping = self._mapping
        if mapping is None:
            return lambda stamp_ns: stamp_ns
        return lambda stamp_ns: mapping.stamp(state, stamp_ns, message_ns, shown_ns, due_ns)

    def _present(self, state: TimelineState, stamp_ns: int) -> int:
        return stamp_ns if self._mapping is None else self._mapping.present(state, stamp_ns)

    def _report_restored(self, event: PlaybackEvent, state: TimelineState) -> None:
        """Report the bag times that sensors' messages show, which their new stamps hide."""
        for message in event.messages:
            if message.connection in self._sensors:
                stamp_ns = first_stamp_ns(message)
                if stamp_ns is not None:
                    self._restored[self._present(state, stamp_ns)] = shown_ns(message, stamp_ns)
        stamps = sorted(self._restored.items())[-MAX_RESTORED:]
        self._restored = dict(stamps)
        self._output.restored(tuple(stamps))

    def _publish(self, message: LoadedMessage, mapping: Callable[[int], int],
                 due_ns: int) -> None:
        self._given += 1
        if message.withdrawn:
            self._output.withdraw(message.connection, due_ns)
            return
        pieces: List[Data] = [message.data]
        if message.stamp_offsets and self._mapping is not None:
            pieces = with_stamps_moved(message.data, message.stamp_offsets, mapping)
        self._output.publish(message.connection, pieces, due_ns)
        self._published += 1
        self._unsettle(due_ns)

    def _unsettle(self, due_ns: int = AT_ONCE) -> None:
        """Note that something changes at a monotonic time [ns]."""
        self._settled_ns = max(self._clock.monotonic_ns(), due_ns) + SETTLING_NS


def shown_ns(message: LoadedMessage, stamp_ns: int) -> int:
    """Return the bag time [ns] that a message shows: its stamp, unless from another clock."""
    is_ours = abs(stamp_ns - message.time_ns) <= MAX_DISTANCE_NS
    return stamp_ns if is_ours else message.time_ns
