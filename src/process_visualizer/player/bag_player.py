# SPDX-License-Identifier: BSD-3-Clause
"""The player: publishes a recording, with services to move freely in time."""
from __future__ import annotations

import os
import re
import struct
import threading
import traceback
from typing import Callable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import rospy

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.marks import Mark, mark_at, read_marks
from process_visualizer.bagio.recording import Recording
from process_visualizer.health.other_publishers import (
    LOOK_PERIOD_S,
    SHARED_TOPICS,
    Others,
    PublisherWatch,
    described,
)
from process_visualizer.msg import PlayerState, RestoredStamp, TopicCount
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.engine import Playback, UnevenParts
from process_visualizer.playback.playback_clock import ClockState, PlaybackClock
from process_visualizer.playback.player_control import PlayerControl, PlayerStatus
from process_visualizer.playback.scene import sources
from process_visualizer.playback.scheduled_output import RestoredStamps
from process_visualizer.playback.timeline import NS_PER_S, Clock, Timeline, duration_s
from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_publishers import (
    BagPublishers,
    OtherNodes,
    PlaybackListener,
    PublishedTopic,
    SimulatedClock,
    published_topics,
    without_conflicts,
)
from process_visualizer.player.player_services import (
    PlayerServices,
    StatePublisher,
    TopicReadingService,
)

_WARNING_PERIOD_S = 10.0
_STAMP = struct.Struct('<4xII')  # after the sequence number
_BEGINS_WITH_HEADER = re.compile(r'(?:\s*(?:#[^\n]*)?\n)*\s*(?:std_msgs/|roslib/)?Header\s')


class RateControl:
    """The option --rate-control-topic of `rosbag play`: any type that begins with a header."""

    def __init__(self, topic: str, bag_ns_of: Callable[[int], Optional[int]],
                 heard: Callable[[int], None], node: NodeHandle) -> None:
        """Subscribe to the topic.

        Args:
            topic: its global name.
            bag_ns_of: maps a stamp [ns] to the bag time [ns], or None if it cannot.
            heard: is called with the bag time, in rospy's thread.
            node: subscribes.
        """
        self._topic = topic
        self._bag_ns_of = bag_ns_of
        self._heard = heard
        self._node, self._warns_from_s = node, 0.0
        node.subscribe(topic, rospy.AnyMsg, self._receive, queue_size=10)

    def _receive(self, message: rospy.AnyMsg) -> None:
        if not begins_with_header(message._connection_header.get('message_definition', '')):
            self._warn()
            return
        seconds, nanoseconds = _STAMP.unpack_from(message._buff)
        bag_ns = self._bag_ns_of(seconds * NS_PER_S + nanoseconds)
        if bag_ns is not None:
            self._heard(bag_ns)

    def _warn(self) -> None:
        now_s = self._node.monotonic_s()
        if now_s >= self._warns_from_s:
            self._warns_from_s = now_s + _WARNING_PERIOD_S
            self._node.warn(f'{self._topic} cannot control the rate: its messages do not begin '
                            'with a header')


def begins_with_header(definition: str) -> bool:
    """Return whether the first field of a message definition is a header."""
    return _BEGINS_WITH_HEADER.match(definition) is not None


_MAX_LINES = 20


def play_summary(left_out: Mapping[str, int], recorded: Mapping[str, int],
                 problems: Sequence[str], dropped: int) -> Tuple[str, ...]:
    """Return a summary of problems as lines; no lines if everything was played and arrived.

    Args:
        left_out: number of messages that could not be played, by topic.
        recorded: number of recorded messages, for each of these topics.
        problems: the reasons, and other problems.
        dropped: number of messages that slow subscribers did not receive.
    """
    lines = [f'{topic}: {count} of {recorded[topic]} messages could not be played'
             for topic, count in sorted(left_out.items())]
    lines += problems[:_MAX_LINES]
    if len(problems) > _MAX_LINES:
        lines.append(f'and {len(problems) - _MAX_LINES} more such problems')
    if dropped:
        lines.append(f'{dropped} messages did not reach subscribers that were too slow for them; '
                     'a longer --queue or a lower rate helps')
    return tuple(lines)


def printable(text: str) -> str:
    """Return the text in valid UTF-8, which a file name may not be."""
    return text.encode('utf-8', 'surrogateescape').decode('utf-8', 'replace')


DRAIN_S = 5.0
HEAD_START_NS = 50_000_000
"""Head start [ns] to prepare the first messages before they are due; too short to be noticed."""
SIGNALS_S = 0.5  # maximum time until the main thread handles a signal
TENDING_S = 0.5  # period of housekeeping
REPEAT_S = 2.0
"""Period [s] of publishing the scene while paused.

This serves nodes that have started or lost the scene meanwhile, and that do not subscribe to the
player itself (a robot's model follows its /tf).
"""


class NothingToPlay(Exception):
    """The recording has no playable message; the text says why."""


class PlaybackFailed(Exception):
    """The publishing thread ended because of a bug in the program; the text says where."""


class PlayerSettings(NamedTuple):
    """Settings of playback, to the recording's end or to ``end_s`` [s] from its beginning."""

    choice: TopicChoice = TopicChoice()
    end_s: Optional[float] = None
    restamp: bool = True
    clock_hz: Optional[float] = None  # rate of /clock; None: /clock is not published
    queue_size: int = 100
    pauses_beside_others: bool = False  # pause if other nodes publish the same topics
    keep_alive: bool = False  # stay at the end
    skip_empty_s: Optional[float] = None
    pause_topics: Tuple[str, ...] = ()
    rate_control_topic: str = ''
    rate_control_max_delay_s: float = 1.0


class Surroundings(NamedTuple):
    """Surroundings of the player, which tests replace with objects that they can observe."""

    node: NodeHandle = NodeHandle()
    clock: Clock = Clock()
    others: OtherNodes = OtherNodes()
    publishers: Callable[[Sequence[PublishedTopic], Sequence[int], int, PlaybackListener],
                         BagPublishers] = BagPublishers


REAL = Surroundings()


class BagPlayer:
    """A recording played in this node; paused at the beginning until a command to play."""

    def __init__(self, recording: Recording, settings: PlayerSettings,
                 surroundings: Surroundings = REAL) -> None:
        """Advertise the topics and services, in a node that has been initialized.

        Raises:
            NothingToPlay: no topic can be played.
        """
        self._recording = recording
        self._node, self._clock = surroundings.node, surroundings.clock
        self._other_nodes = surroundings.others
        self._marks, bad_marks = _marks(recording)
        self._left_out_topics = self._choose(recording, settings)
        untimed = [str(it) for it in recording.index.strays if not it.are_kept]
        self._problems = self._left_out_topics + bad_marks + untimed
        self._told_problems = 0
        self._others: Others = ()
        self._changed = threading.Condition()
        self._started = self._finished = self._quitting = False
        self._failure: Optional[PlaybackFailed] = None
        self._repeats, self._repeated_ns = settings.restamp, 0
        self._restored: RestoredStamps = ()
        self._timeline = _timeline(recording, settings.end_s, self._clock)
        self._begin = _ros_time(self._timeline.state.begin_ns)
        self._publishers = surroundings.publishers(
            self._topics, sources(recording.index.connections), settings.queue_size, self)
        self._playback = Playback(recording, self._timeline, self._publishers, settings.restamp,
                                  self._clock, uneven_parts=_uneven_parts(self._timeline, settings))
        self._stays = settings.keep_alive
        self._published_states = PlaybackClock()
        self._control_rate(settings)
        self._ros_clock = (SimulatedClock(self._timeline, settings.clock_hz,
                                          self._playback.repeat_scene, self._node)
                           if settings.clock_hz else None)
        self.control = PlayerControl(self._timeline, self._playback)
        self._thread: Optional[threading.Thread] = None
        self._reading = TopicReadingService(recording, self._topics, self._node,
                                            self._playback.held)
        self._state = StatePublisher(self.state_message, self._node)
        self._services: Optional[PlayerServices] = None
        self._pauses_beside_others = settings.pauses_beside_others
        self._watch = self._watch_others(settings.choice)
        self._watch.look()
        self._node.every_real(LOOK_PERIOD_S, self._watch.look_again)

    @property
    def dropped(self) -> int:
        """Return how many messages slow subscribers did not receive."""
        return self._publishers.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """Return the problems of playback so far."""
        return tuple(map(printable, (*self._problems, *self._playback.problems)))

    @property
    def is_complete(self) -> bool:
        """Return whether all chosen messages could be played so far."""
        gaps = (gap for gap in self._recording.index.gaps
                if not gap.topics or self._names.keys() & set(gap.topics))
        return not (self._left_out_topics or self._playback.left_out or any(gaps))

    def summary(self) -> Tuple[str, ...]:
        """Return a summary, as lines, of messages that were not played or did not arrive so far."""
        index, left_out = self._recording.index, self._playback.left_out
        recorded = {topic: len(index.positions_of(index.connections_of(topic)))
                    for topic in left_out}
        return play_summary(left_out, recorded, self.problems, self.dropped)

    def prepare(self, rate: float, start_s: Optional[float], loop: bool) -> None:
        """Set rate, loop and start (None: the beginning, or the end if backward); accept commands.

        The loop covers the part that would be played without it: from the start to the end or, if
        backward, to the beginning.

        Raises:
            CommandRefused: the part to play is too short for a loop.
            NothingToPlay: the recording ends before the start.
        """
        self.control.set_rate(rate)
        state = self._timeline.state
        first_ns, last_ns = ((state.begin_ns, state.end_ns) if state.forward
                             else (state.end_ns, state.begin_ns))
        if start_s is not None:
            first_ns = self._bag_ns(start_s)
        if first_ns > state.end_ns:
            raise NothingToPlay(f'there are no messages to play from {start_s:g} s on: the '
                                f'recording is {duration_s(state):.3f} s long; choose an earlier '
                                '--start')
        if loop:
            self._timeline.set_loop(min(first_ns, last_ns), max(first_ns, last_ns))
        self._timeline.seek(first_ns)
        # advertised only now: an earlier command would have been undone by this one
        self._services = PlayerServices(self.control, self._state.update, self._node)
        self._state.begin()

    def wait_for_subscribers(self, delay_s: float, all_topics: bool) -> bool:
        """Wait for a time [s], then for subscribers of all topics if wanted; False if quit."""
        self._node.at_shutdown(self.quit)
        with self._changed:
            self._changed.wait_for(lambda: self._quitting, delay_s)
            while not self._quitting and all_topics and not self._publishers.all_subscribed:
                self._changed.wait(SIGNALS_S)
            return not self._quitting

    def start(self, paused: bool) -> None:
        """Begin to publish, playing or paused; a command may already have requested a pause."""
        self._playback.prepare()
        if not (paused or self.control.pause_requested):
            self._timeline.begin()
        self._thread = self._node.thread(self._run, 'playback')
        self._started = True
        self._node.every_real(TENDING_S, self._tend)

    @property
    def has_ended(self) -> bool:
        """Return whether the player was asked to quit, or reached its end and does not stay."""
        return self._quitting or (self._finished and not self._stays)

    def wait(self) -> None:
        """Wait until ``has_ended``, which a shutdown of the node causes too.

        Raises:
            PlaybackFailed: publishing has failed.
        """
        with self._changed:
            while not self.has_ended:
                # a signal just before the wait is handled only after it
                self._changed.wait(SIGNALS_S)
        if self._failure is not None:
            raise self._failure

    def print_problems(self) -> None:
        """Print problems since the last call on the terminal."""
        for problem in self.problems[self._told_problems:]:
            self._node.warn(problem)
            self._told_problems += 1

    def quit(self) -> None:
        """End waiting."""
        with self._changed:
            self._quitting = True
            self._changed.notify_all()

    def status(self) -> PlayerStatus:
        """Return the position of playback, with the values that only the player knows."""
        status = self.control.status()
        return status._replace(dropped=self.dropped, mark=self._mark(status.position_s))

    def close(self) -> None:
        """End playback; published messages are still sent, within ``DRAIN_S``."""
        self._watch.close()
        if self._services is not None:
            self._services.close()
        self._reading.close()
        if self._thread is not None:
            self._playback.close()
            self._thread.join()
        if not self._node.is_shutdown():
            self._publishers.wait_until_sent(DRAIN_S)
        self._state.close()
        if self._ros_clock is not None:
            self._ros_clock.close()
        self._publishers.close()

    def state_message(self) -> PlayerState:
        """Return the present state of the player."""
        status, offset_ns = self.status(), self._wall_offset_ns()
        self._published_states.add(ClockState(
            (status.monotonic_ns + offset_ns) / NS_PER_S, status.position_s, status.rate,
            status.paused, status.segment, (status.since_ns + offset_ns) / NS_PER_S))
        begin_s, end_s = status.loop or (0.0, 0.0)
        return PlayerState(
            stamp=_ros_time(status.monotonic_ns + offset_ns),
            since=_ros_time(status.since_ns + offset_ns),
            begin=self._begin, duration=status.duration_s,
            position=status.position_s, rate=status.rate, achieved_rate=status.achieved_rate,
            paused=status.paused, loop=status.loop is not None, loop_begin=begin_s,
            loop_end=end_s, segment=status.segment, published=self._playback.published,
            dropped=status.dropped, gaps=self.problems,
            files=list(map(printable, self._recording.paths)),
            mark=status.mark,
            topics=[TopicCount(*topic) for topic in self._publishers.published.items()],
            others=described(self._others),
            not_begun=[self._names[topic] for topic
                       in self._playback.not_begun(self._bag_ns(status.position_s))],
            restored=[RestoredStamp(_ros_time(stamp_ns), _ros_time(shown_ns))
                      for stamp_ns, shown_ns in self._restored])

    def _wall_offset_ns(self) -> int:
        """Return the difference of wall and monotonic time [ns], undisturbed by other threads."""
        clock, readings = self._clock, []
        for _ in range(3):
            before_ns, wall_ns, after_ns = (clock.monotonic_ns(), clock.wall_ns(),
                                            clock.monotonic_ns())
            readings.append((after_ns - before_ns, wall_ns - (before_ns + after_ns) // 2))
        return min(readings)[1]

    def _mark(self, position_s: float) -> str:
        """Return the label of the last mark before a position [s], '' if there is none."""
        mark = mark_at(self._marks, self._bag_ns(position_s))
        return '' if mark is None else mark.label

    def _bag_ns(self, position_s: float) -> int:
        return self._timeline.state.begin_ns + round(position_s * NS_PER_S)

    def _choose(self, recording: Recording, settings: PlayerSettings) -> List[str]:
        topics, problems = published_topics(recording.index.connections,
                                            settings.choice.published_name)
        self._topics, conflicts = without_conflicts(topics, self._other_nodes)
        self._names = {recording.index.connections[number].topic: topic.name
                       for topic in self._topics for number in topic.numbers}
        recording.choose(number for topic in self._topics for number in topic.numbers)
        if not len(recording.index):
            raise NothingToPlay(' '.join(['no chosen topic can be played', *problems, *conflicts]))
        return problems + conflicts

    def _watch_others(self, choice: TopicChoice) -> PublisherWatch:
        """Watch the played topics, and topics chosen by name that others may publish."""
        names = {topic.name for topic in self._topics} | set(choice.named())
        topics = sorted(names - SHARED_TOPICS)
        return PublisherWatch(lambda: self._other_nodes.beside(topics), self._take_others)

    def _take_others(self, others: Others) -> None:
        """Report new publishers of played topics, and pause if wanted."""
        new = [it for it in others if it not in self._others]
        self._others = others
        pauses = bool(new) and self._pauses_beside_others
        for sentence in described(new):
            self._node.warn(f'{sentence}, in addition to the recording: stop it, or play under '
                            'other names '
                            f'(-p PREFIX){"; playback is paused" if pauses else ""}')
        if pauses:
            self.control.pause()
        self._state.update()

    def _control_rate(self, settings: PlayerSettings) -> None:
        if settings.rate_control_topic:
            RateControl(settings.rate_control_topic,
                        self._played_at if settings.restamp else lambda stamp_ns: stamp_ns,
                        self._playback.uneven_parts.heard, self._node)

    def _played_at(self, stamp_ns: int) -> Optional[int]:
        """Return the bag time [ns] that was played at a wall time [ns]; None if a jump followed."""
        time = self._published_states.bag_time(stamp_ns / NS_PER_S)
        if time is None or time.segment != self._timeline.state.segment:
            return None
        return self._bag_ns(time.time_s)

    def _tend(self) -> None:
        """Do the periodic housekeeping."""
        if not self._quitting:
            self._repeat_while_paused()
            self.print_problems()

    def _repeat_while_paused(self) -> None:
        state, now_ns = self._timeline.state, self._clock.monotonic_ns()
        quiet_ns = now_ns - max(state.monotonic_ns, self._repeated_ns)
        if self._repeats and state.paused and not state.held and quiet_ns >= REPEAT_S * NS_PER_S:
            self._repeated_ns = now_ns
            self._playback.repeat_scene()

    def _run(self) -> None:
        try:
            self._playback.run()
        except Exception as error:  # any exception ends the program
            self._failure = self._failed(error)
            self.quit()

    def _failed(self, error: Exception) -> PlaybackFailed:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return PlaybackFailed(
            f'playback has failed at {self.control.status().position_s:.3f} s: {error!r} in '
            f'{os.path.basename(place.filename)}, line {place.lineno}; start it again, and send '
            'the developers this message and the bag')

    # Notifications of the engine and the publishers, in their threads.

    def on_jump(self, bag_ns: int) -> None:
        """Note a jump to a bag time [ns], before its scene is published."""
        if self._ros_clock is not None:
            self._ros_clock.jump(bag_ns)
        self._restored = ()
        self._state.update()

    def on_restored(self, stamps: RestoredStamps) -> None:
        """Note the messages just published that are stamped with the present time."""
        self._restored = stamps
        self._state.update()

    def on_finish(self) -> bool:
        """Note that play has reached its end; return whether nothing follows."""
        self._state.update()
        with self._changed:
            self._finished = True
            self._changed.notify_all()
        return not self._stays

    def on_subscribe(self) -> None:
        """Note a new subscriber; while paused, publish the scene for it at once."""
        with self._changed:
            self._changed.notify_all()
        if self._timeline.state.paused and self._started:
            self._playback.repeat_scene()


def _marks(recording: Recording) -> Tuple[List[Mark], List[str]]:
    """Return the marks, and problems in reading them; called before topics are chosen."""
    try:
        return read_marks(recording), [str(gap) for gap in recording.damage]
    except BagError as error:
        return [], [str(error)]


def _timeline(recording: Recording, end_s: Optional[float], clock: Clock) -> Timeline:
    """Return the timeline of a recording up to a time [s], at most to the recording's end."""
    end_ns = recording.end_ns
    if end_s is not None:
        end_ns = min(recording.begin_ns + round(end_s * NS_PER_S), end_ns)
    # Each player has other segment numbers: by them receivers recognize that the position jumped.
    segment = clock.monotonic_ns() // 1_000_000 % (1 << 31)
    return Timeline(recording.begin_ns, end_ns, clock, HEAD_START_NS, segment)


def _uneven_parts(timeline: Timeline, settings: PlayerSettings) -> UnevenParts:
    skip_s, delay_s = settings.skip_empty_s, settings.rate_control_max_delay_s
    return UnevenParts(timeline, None if skip_s is None else round(skip_s * NS_PER_S),
                       settings.pause_topics,
                       round(delay_s * NS_PER_S) if settings.rate_control_topic else None)


def _ros_time(time_ns: int) -> rospy.Time:
    return rospy.Time(*divmod(time_ns, NS_PER_S))
