"""The player: publishes a recording, with services to move freely in its time."""
from __future__ import annotations

import threading
import time
from typing import List, NamedTuple, Optional, Tuple

import rospy

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.marks import Mark, mark_at, read_marks
from process_visualizer.bags.playback import Playback
from process_visualizer.bags.player_control import PlayerControl
from process_visualizer.bags.progress_line import Progress
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.timeline import NS_PER_S, Timeline
from process_visualizer.bags.topic_choice import TopicChoice
from process_visualizer.msg import PlayerState, TopicCount
from process_visualizer.nodes.bag_publishers import BagPublishers, published_topics
from process_visualizer.nodes.player_services import PlayerServices
from process_visualizer.nodes.player_state import StatePublisher
from process_visualizer.nodes.simulated_clock import SimulatedClock
from process_visualizer.nodes.topic_conflicts import without_conflicts

DRAIN_S = 5.0
HEAD_START_NS = 50_000_000
"""Too short to be noticed, and enough to have the first messages ready when they are due."""
SIGNALS_S = 0.5  # how long the main thread waits at most before it looks at signals
REPEAT_S = 2.0
"""While paused the scene is published again after so long: what has started meanwhile, or has lost
it, need not subscribe topics of the player itself (a robot's model follows its /tf)."""


class NothingToPlay(Exception):
    """The recording has no message that can be played; the text says why."""


class PlayerSettings(NamedTuple):
    """How a recording is played, to its end or to a time [s from its beginning]."""

    choice: TopicChoice = TopicChoice()
    end_s: Optional[float] = None
    restamp: bool = True
    clock_hz: Optional[float] = None  # of /clock; None: it is not published
    queue_size: int = 100


class BagPlayer:
    """A recording being played in this node; paused at the beginning until told to play."""

    def __init__(self, recording: Recording, settings: PlayerSettings) -> None:
        """Advertise the topics and services, in a node that has been initialised.

        Raises:
            NothingToPlay: no topic is left that can be played.
        """
        self._recording = recording
        self._marks, bad_marks = _marks(recording)
        self._problems = self._choose(recording, settings) + bad_marks
        self._changed = threading.Condition()
        self._started = self._finished = self._quitting = False
        self._repeats, self._repeated_ns = settings.restamp, 0
        self._timeline = _timeline(recording, settings.end_s)
        self._begin = _ros_time(self._timeline.basis.begin_ns)
        self._publishers = BagPublishers(self._topics, settings.queue_size, self)
        self._playback = Playback(recording, self._timeline, self._publishers, settings.restamp)
        self._clock = (SimulatedClock(self._timeline, settings.clock_hz,
                                      self._playback.repeat_scene)
                       if settings.clock_hz else None)
        self.control = PlayerControl(self._timeline, self._playback)
        self._thread = threading.Thread(target=self._run, name='playback', daemon=True)
        self._state = StatePublisher(self.state_message)
        self._services = PlayerServices(self.control, self._state.update)

    @property
    def dropped(self) -> int:
        """How many messages slow subscribers did not get."""
        return self._publishers.dropped

    @property
    def problems(self) -> Tuple[str, ...]:
        """What cannot be played, so far."""
        return (*self._problems, *self._playback.problems)

    def prepare(self, rate: float, start_s: Optional[float], loop: bool) -> None:
        """Set the rate, where to begin (None: at the beginning, backwards at the end), the loop.

        Raises:
            CommandRefused: what is left is too short for a loop.
        """
        self.control.set_rate(rate)
        end_s = self.control.status().duration_s
        if loop:
            self.control.set_loop(True, start_s or 0.0, end_s)
        self.control.seek((0.0 if rate > 0.0 else end_s) if start_s is None else start_s)

    def wait_for_subscribers(self, delay_s: float, all_topics: bool) -> bool:
        """Wait for a time [s] and until every topic has a subscriber; False if quit meanwhile."""
        rospy.on_shutdown(self.quit)
        with self._changed:
            self._changed.wait_for(lambda: self._quitting, delay_s)
            while not self._quitting and all_topics and not self._publishers.all_subscribed:
                self._changed.wait(SIGNALS_S)
            return not self._quitting

    def start(self, paused: bool) -> None:
        """Begin to publish, playing or paused; paused too where a command has said so already."""
        self._playback.prepare()
        if not (paused or self.control.stands):
            self.control.play()
        self._thread.start()
        self._started = True

    def wait(self, until_finished: bool) -> None:
        """Wait until the node is shut down or told to quit, or until the end has been reached."""
        with self._changed:
            while not (self._quitting or (until_finished and self._finished)):
                # a signal just before the wait is handled only after it
                self._changed.wait(SIGNALS_S)
                self._repeat_while_paused()

    def quit(self) -> None:
        """End waiting."""
        with self._changed:
            self._quitting = True
            self._changed.notify_all()

    def progress(self) -> Progress:
        """Return where playback is."""
        status = self.control.status()
        return Progress(status.position_s, status.duration_s, status.rate, status.achieved_rate,
                        status.paused, status.loop, self.dropped,
                        self._mark(status.position_s))

    def close(self) -> None:
        """End: what was published is still sent, if that does not take too long."""
        self._services.close()
        if self._thread.is_alive():
            self._playback.close()
            self._thread.join()
        if not rospy.is_shutdown():
            self._publishers.wait_until_sent(DRAIN_S)
        self._state.close()
        if self._clock is not None:
            self._clock.close()
        self._publishers.close()

    def state_message(self) -> PlayerState:
        """Return what the player does now."""
        status, offset_ns = self.control.status(), _wall_offset_ns()
        begin_s, end_s = status.loop or (0.0, 0.0)
        return PlayerState(
            stamp=_ros_time(status.monotonic_ns + offset_ns),
            since=_ros_time(status.since_ns + offset_ns),
            begin=self._begin, duration=status.duration_s,
            position=status.position_s, rate=status.rate, achieved_rate=status.achieved_rate,
            paused=status.paused, loop=status.loop is not None, loop_begin=begin_s,
            loop_end=end_s, segment=status.segment, published=self._playback.published,
            dropped=self.dropped, gaps=self.problems, files=self._recording.paths,
            mark=self._mark(status.position_s),
            topics=[TopicCount(*topic) for topic in self._publishers.published.items()])

    def _mark(self, position_s: float) -> str:
        """The label of the last mark before a position [s]."""
        position_ns = self._timeline.basis.begin_ns + round(position_s * NS_PER_S)
        mark = mark_at(self._marks, position_ns)
        return '' if mark is None else mark.label

    def _choose(self, recording: Recording, settings: PlayerSettings) -> List[str]:
        topics, problems = published_topics(recording.index.connections,
                                            settings.choice.published_name)
        self._topics, conflicts = without_conflicts(topics)
        recording.choose(number for topic in self._topics for number in topic.numbers)
        if not len(recording.index):
            raise NothingToPlay(' '.join(['no chosen topic can be played', *problems, *conflicts]))
        return problems + conflicts

    def _repeat_while_paused(self) -> None:
        basis, now_ns = self._timeline.basis, time.monotonic_ns()
        quiet_ns = now_ns - max(basis.monotonic_ns, self._repeated_ns)
        if self._repeats and basis.paused and quiet_ns >= REPEAT_S * NS_PER_S:
            self._repeated_ns = now_ns
            self._playback.repeat_scene()

    def _run(self) -> None:
        try:
            self._playback.run()
        except Exception as error:
            rospy.logfatal(f'playback has failed: {error!r}')
            self.quit()
            raise

    # What the engine and the publishers tell, in their threads.

    def on_jump(self, bag_ns: int) -> None:
        """Take note of a jump to a bag time [ns], before its scene is published."""
        if self._clock is not None:
            self._clock.jump(bag_ns)
        self._state.update()

    def on_finish(self) -> None:
        """Take note that the end has been reached."""
        self._state.update()
        with self._changed:
            self._finished = True
            self._changed.notify_all()

    def on_subscribe(self) -> None:
        """Take note of a new subscriber; while paused, it is to see the scene at once."""
        with self._changed:
            self._changed.notify_all()
        if self._timeline.basis.paused and self._started:
            self._playback.repeat_scene()


def _marks(recording: Recording) -> Tuple[List[Mark], List[str]]:
    """The marks, or why those beside the bag cannot be read; before topics are chosen."""
    try:
        return read_marks(recording), []
    except BagError as error:
        return [], [str(error)]


def _timeline(recording: Recording, end_s: Optional[float]) -> Timeline:
    """The timeline of a recording up to a time; it ends where the recording does at the latest."""
    end_ns = recording.end_ns
    if end_s is not None:
        end_ns = min(recording.begin_ns + round(end_s * NS_PER_S), end_ns)
    return Timeline(recording.begin_ns, end_ns, head_start_ns=HEAD_START_NS)


def _wall_offset_ns() -> int:
    """Return what wall times are more than monotonic ones [ns], not disturbed by other threads."""
    readings = []
    for _ in range(3):
        before_ns, wall_ns, after_ns = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
        readings.append((after_ns - before_ns, wall_ns - (before_ns + after_ns) // 2))
    return min(readings)[1]


def _ros_time(time_ns: int) -> rospy.Time:
    return rospy.Time(*divmod(time_ns, NS_PER_S))
