# SPDX-License-Identifier: BSD-3-Clause
"""The real playback engine on the clock of a simulated node, with the node as its only receiver."""
from __future__ import annotations

import threading
from concurrent.futures import Future
from typing import Any, Callable, List, NamedTuple, Optional, Sequence

import rosbag
import rospy
from genpy import Duration, Time
from simulated_node import SimulatedNode

from process_visualizer.bags.recording import Recording
from process_visualizer.curves.topic_messages import topic_messages, topic_period_s
from process_visualizer.msg import PlayerState, TopicCount
from process_visualizer.playback.clock import Clock
from process_visualizer.playback.engine import Playback
from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.step_target import Step
from process_visualizer.playback.timeline import FOREVER_NS, NS_PER_S, Timeline
from process_visualizer.player.bag_player import HEAD_START_NS
from process_visualizer.player.player_state import PERIOD_S
from process_visualizer.player.topic_reading import LARGEST_BYTES
from process_visualizer.ros_names import BAG_PLAYER, PLAYER_STATE_TOPIC
from process_visualizer.srv import ReadTopicRequest, ReadTopicResponse

BEGIN_S = 1_600_000_000
_ANSWER_S = 60.0  # in which the engine's thread must have come to its next wait


class Row(NamedTuple):
    """A message to be recorded: topic, time [ms from the beginning], content."""

    topic: str
    time_ms: int
    message: Any


def stamp(time_ms: float) -> Time:
    """Return a bag time."""
    return Time.from_sec(BEGIN_S) + Duration.from_sec(time_ms / 1000.0)


def write_bag(path: Any, rows: Sequence[Row], latched: Sequence[str] = ('/tf_static',)) -> str:
    """Write messages into a bag as `rosbag record` does."""
    with rosbag.Bag(str(path), 'w', chunk_threshold=100_000) as bag:
        for row in sorted(rows, key=lambda it: it.time_ms):
            bag.write(row.topic, row.message, stamp(row.time_ms), connection_header={
                'topic': row.topic, 'type': row.message._type, 'md5sum': row.message._md5sum,
                'callerid': '/recorded', 'message_definition': row.message._full_text,
                'latching': '1' if row.topic in latched else '0'})
    return str(path)


class _Turns(Clock):
    """Lets the engine's thread and the test's run in turn, never both: the engine while it works.

    When the engine waits, the test goes on, and time passes only there.
    """

    def __init__(self, node: SimulatedNode) -> None:
        self._node = node
        self._engine, self._test = threading.Semaphore(0), threading.Semaphore(0)
        self._waits = 0
        self.error: Optional[BaseException] = None

    def monotonic_ns(self) -> int:
        return round(self._node.monotonic_s() * NS_PER_S)

    def wall_ns(self) -> int:
        return round(self._node.wall_s() * NS_PER_S)

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        self._waits += 1
        if timeout_ns < FOREVER_NS:
            number = self._waits
            self._node.call_in(timeout_ns / NS_PER_S, lambda: self._time_is_over(number))
        condition.release()
        self._test.release()
        self._engine.acquire()
        condition.acquire()

    def _time_is_over(self, number: int) -> None:
        if number == self._waits:
            self.let_engine_work()

    def let_engine_work(self) -> None:
        """Let the engine go on until it waits again, or ends."""
        self._engine.release()
        self.wait_for_engine()

    def wait_for_engine(self) -> None:
        """Wait until the engine waits, or has ended."""
        assert self._test.acquire(timeout=_ANSWER_S), 'the engine does not come to a wait'
        if self.error is not None:
            raise self.error

    def end(self) -> None:
        """Take note that the engine has ended."""
        self._test.release()


class _Scheduled:
    """A message that was given to the sender."""

    def __init__(self, due_ns: int, may_be_revoked: bool, send: Callable[[], None]) -> None:
        self.due_ns, self.may_be_revoked, self._send = due_ns, may_be_revoked, send
        self.is_revoked = False

    def fire(self) -> None:
        """Send it, unless it was taken back."""
        if not self.is_revoked:
            self._send()


class SimulatedPlayer:
    """Plays a bag to a simulated node: messages, states and the service ~read of bag_player.

    It is paused at the beginning. Close it when it is no longer needed.
    """

    def __init__(self, node: SimulatedNode, bag: str) -> None:
        self._node = node
        self._recording = Recording([bag])
        self._begin_ns = self._recording.begin_ns
        self._turns = _Turns(node)
        self._timeline = Timeline(self._begin_ns, self._recording.end_ns, self._turns,
                                  HEAD_START_NS)
        self._playback = Playback(self._recording, self._timeline, self, clock=self._turns)
        self.control = PlayerControl(self._timeline, self._playback)
        self._sent: List[_Scheduled] = []
        self._topics = {it.topic for it in self._recording.index.connections}
        node.offered[f'/{BAG_PLAYER}/read'] = self._read
        self._timer = node.every(PERIOD_S, self._tell)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._turns.wait_for_engine()
        self._tell()

    def _run(self) -> None:
        try:
            self._playback.run()
        except BaseException as error:  # noqa: B902, the test's thread raises it
            self._turns.error = error
        self._turns.end()

    def close(self) -> None:
        """End: nothing follows, no state either."""
        if not self._thread.is_alive():
            return
        self._timer.shutdown()
        self._node.offered.clear()
        self._playback.close()
        self._turns.let_engine_work()
        self._thread.join(_ANSWER_S)
        self._recording.close()

    # Commands, each with its effect at once.

    def seek(self, position_s: float) -> None:
        """Go to a position [s]."""
        self._do(lambda: self.control.seek(position_s))

    def play(self, rate: float = 1.0) -> None:
        """Play at a rate."""
        self._do(lambda: self.control.set_rate(rate))
        self._do(self.control.play)

    def pause(self) -> None:
        """Pause."""
        self._do(self.control.pause)

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> None:
        """Step by messages of a topic, or (count 0) by a time [s]."""
        answers: List[Future[Any]] = []
        self._do(lambda: answers.append(self._playback.request(
            Step(count, topic, round(duration_s * NS_PER_S)))))
        answers[0].result(0.0)

    def repeat(self) -> None:
        """Publish the scene once more, as for a new subscriber."""
        self._do(self._playback.repeat_scene)

    @property
    def position_s(self) -> float:
        """The position [s]."""
        return self.control.status().position_s

    def _do(self, command: Callable[[], Any]) -> None:
        command()
        self._turns.let_engine_work()
        self._tell()
        self._node.advance(0.0)

    # What is played, as the sender sends it.

    def publish(self, connection: int, pieces: Sequence[bytes], due_ns: int) -> None:
        """See Output."""
        message = rospy.AnyMsg()
        message._buff = b''.join(pieces)
        found = self._recording.index.connections[connection]
        message._connection_header = {'type': found.type, 'md5sum': found.md5sum,
                                      'callerid': f'/{BAG_PLAYER}'}
        last_ns = self._sent[-1].due_ns if self._sent else 0
        now_ns = self._turns.monotonic_ns()
        due_ns = max(due_ns, now_ns, last_ns)
        scheduled = _Scheduled(due_ns, due_ns > now_ns, lambda: self._node.send(
            found.topic, message, found.latching))
        self._sent.append(scheduled)
        self._node.call_in((due_ns - now_ns) / NS_PER_S, scheduled.fire)

    def withdraw(self, connection: int, due_ns: int) -> None:
        """See Output."""

    def revoke(self, after_ns: int) -> int:
        """See Output."""
        until_ns = max([after_ns, *(it.due_ns for it in self._sent if not it.may_be_revoked)])
        kept = [it for it in self._sent if it.due_ns <= until_ns]
        for scheduled in self._sent[len(kept):]:
            scheduled.is_revoked = True
        count = len(self._sent) - len(kept)
        self._sent = kept[-1:]
        return count

    def jump(self, _bag_ns: int) -> None:
        """See Output; the state comes before the scene."""
        self._node.call_in(0.0, self._tell)

    def finish(self) -> bool:
        """See Output."""
        return False

    def _tell(self) -> None:
        status = self.control.status()
        offset_ns = self._turns.wall_ns() - self._turns.monotonic_ns()
        self._node.send(PLAYER_STATE_TOPIC, PlayerState(
            stamp=_time(status.monotonic_ns + offset_ns), since=_time(status.since_ns + offset_ns),
            begin=_time(self._begin_ns), duration=status.duration_s, position=status.position_s,
            rate=status.rate, achieved_rate=status.achieved_rate, paused=status.paused,
            segment=status.segment, files=list(self._recording.paths),
            topics=[TopicCount(topic, 0) for topic in sorted(self._topics)]))

    def _read(self, request: ReadTopicRequest) -> ReadTopicResponse:
        numbers = self._recording.index.connections_of(request.topic)
        if request.topic not in self._topics:
            return ReadTopicResponse(success=False, message=f'{request.topic} is not played')
        found = topic_messages(self._recording, numbers, *(
            self._begin_ns + round(it * NS_PER_S) for it in (request.begin, request.end)),
            LARGEST_BYTES)
        return ReadTopicResponse(
            success=True, type=self._recording.index.connections[numbers[0]].type,
            recording_begin=_time(self._begin_ns), end=(found.end_ns - self._begin_ns) / NS_PER_S,
            period=topic_period_s(self._recording, numbers),
            positions=[(it - self._begin_ns) / NS_PER_S for it in found.times_ns],
            sizes=[len(message) for message in found.messages], data=b''.join(found.messages))


def _time(time_ns: int) -> Time:
    return Time(*divmod(time_ns, NS_PER_S))
