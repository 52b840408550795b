# SPDX-License-Identifier: BSD-3-Clause
"""The real player on the clock of a simulated node, which receives all published messages."""
from __future__ import annotations

import threading
from collections import defaultdict
from concurrent.futures import Future
from typing import Any, Callable, DefaultDict, Dict, List, NamedTuple, Optional, Sequence

import rospy
from simulated_node import SimulatedNode, SimulatedPublisher, SimulatedServer
from std_srvs.srv import TriggerRequest

from process_visualizer.bagio.recording import Recording
from process_visualizer.health.other_publishers import OtherPublisher, Others
from process_visualizer.msg import PlayerState
from process_visualizer.playback.scheduled_output import RestoredStamps
from process_visualizer.playback.timeline import FOREVER_NS, NS_PER_S, Clock, Result
from process_visualizer.player.bag_player import BagPlayer, PlayerSettings, Surroundings
from process_visualizer.player.bag_publishers import OtherNodes, PlaybackListener, PublishedTopic
from process_visualizer.ros_names import BAG_PLAYER
from process_visualizer.srv import (
    ReadTopicRequest,
    SeekRequest,
    SetLoopRequest,
    SetRateRequest,
    StepRequest,
)

PLAIN = PlayerSettings()
_ROUNDING_S = 1e-9  # of times that are sums
_ANSWER_S = 60.0  # time for the engine's thread to reach its next wait


class Received(NamedTuple):
    """A message that the player has sent: time [s of the day], topic, bytes."""

    time_s: float
    topic: str
    data: bytes


class SimulatedPlayer:
    """Plays bags in the time of a simulated node, which receives all published messages.

    It is paused at the beginning. Close it when it is no longer needed.
    """

    def __init__(self, node: SimulatedNode, *bags: str,
                 settings: PlayerSettings = PLAIN, rate: float = 1.0,
                 start_s: Optional[float] = None, loop: bool = False, plays: bool = False,
                 others: Optional[SimulatedOthers] = None,
                 recording_type: Callable[[List[str]], Recording] = Recording,
                 starts: bool = True) -> None:
        """Start to play, unless ``starts`` is false."""
        self._turns = _Turns(node)
        self.node = _PlayerNode(node, self._turns)
        self._recording = recording_type(list(bags))
        self.others = others or SimulatedOthers()
        self.player = BagPlayer(self._recording, settings, Surroundings(
            self.node, self._turns, self.others, self._publish_to))
        self.player.prepare(rate, start_s, loop)
        if starts:
            self.start(plays)

    def _publish_to(self, topics: Sequence[PublishedTopic], sources: Sequence[int],
                    _queue_size: int, listener: PlaybackListener) -> SimulatedPublishers:
        self.publishers = SimulatedPublishers(topics, sources, listener, self.node)
        return self.publishers

    def start(self, plays: bool = False) -> None:
        """Begin to publish, paused or playing."""
        self.player.start(paused=not plays)
        self.node.advance(0.0)

    def close(self) -> None:
        """End: no more messages, not even a state."""
        self.player.quit()
        self.player.close()
        self._recording.close()

    def end(self) -> None:
        """Play to the end, for at most a minute."""
        while not self.player.has_ended and self.node.now_s < 60.0 + self.publishers.begin_s:
            self.node.advance(0.1)
        assert self.player.has_ended
        self.publishers.wait_until_sent(0.0)

    # The published messages.

    @property
    def received(self) -> List[Received]:
        """The sent messages, in order; the list may be cleared."""
        return self.publishers.received

    def of(self, topic: str) -> List[bytes]:
        """Return the messages sent on a topic."""
        return [it.data for it in self.received if it.topic == topic]

    def late(self, topic: str) -> List[bytes]:
        """Return the messages that a new subscriber to a topic receives now."""
        return self.publishers.late(topic)

    @property
    def states(self) -> List[PlayerState]:
        """Return all published states; the list may be cleared."""
        return self.node.sent('~state')

    @property
    def state(self) -> PlayerState:
        """The last state."""
        return self.states[-1]

    # Commands, as its services receive them. Immediate effects are complete when they return.

    def call(self, name: str, request: Any = None) -> Any:
        """Call a service, with an empty request unless one is given."""
        return self.node.call(f'~{name}', TriggerRequest() if request is None else request)

    def seek(self, position_s: float) -> Any:
        """Seek to a position [s]."""
        return self.call('seek', SeekRequest(position_s))

    def play(self, rate: Optional[float] = None) -> Any:
        """Play, at a rate if one is given."""
        if rate is not None:
            self.set_rate(rate)
        return self.call('play')

    def pause(self) -> Any:
        """Pause."""
        return self.call('pause')

    def set_rate(self, rate: float) -> Any:
        """Change the rate."""
        return self.call('set_rate', SetRateRequest(rate))

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> Any:
        """Step by messages of a topic, or (count 0) by a time [s]."""
        return self.call('step', StepRequest(count, topic, duration_s))

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> Any:
        """Loop a part, or stop looping."""
        return self.call('set_loop', SetLoopRequest(loop, begin_s, end_s))

    def read(self, topic: str, begin_s: float, end_s: float) -> Any:
        """Read messages of the recording."""
        return self.call('read', ReadTopicRequest(topic, begin_s, end_s))

    def repeat(self) -> None:
        """Send the scene once more, as for a new subscriber."""
        self.player.on_subscribe()
        self.node.let_work()

    @property
    def position_s(self) -> float:
        """The position [s]."""
        return self.player.control.status().position_s


class SimulatedOthers(OtherNodes):
    """Other nodes, as defined by the test."""

    def __init__(self) -> None:
        self.nodes: Dict[str, List[str]] = {}
        """Publishing nodes, by topic."""
        self.headers: Dict[str, Dict[str, str]] = {}
        """Headers of the publishers that answer, by node."""

    def publishing(self) -> Dict[str, List[str]]:
        """See OtherNodes."""
        return self.nodes

    def header(self, topic: str, node: str) -> Dict[str, str]:
        """See OtherNodes."""
        return self.headers.get(node, {})

    def beside(self, topics: Any) -> Others:
        """See OtherNodes."""
        return tuple(OtherPublisher(topic, node) for topic in topics
                     for node in self.nodes.get(topic, []))


class SimulatedPublishers:
    """Sends the player's messages, as BagPublishers do, to a node and to a list."""

    dropped = 0
    all_subscribed = True

    def __init__(self, topics: Sequence[PublishedTopic], sources: Sequence[int],
                 listener: PlaybackListener, node: _PlayerNode) -> None:
        self._by_number = {number: topic for topic in topics for number in topic.numbers}
        self._sources, self.listener, self._node = sources, listener, node
        self.begin_s = node.now_s
        self.published: Dict[str, int] = {topic.name: 0 for topic in topics}
        self.received: List[Received] = []
        self._latched: DefaultDict[str, Dict[int, bytes]] = defaultdict(dict)
        self._given: List[_Scheduled] = []

    def late(self, topic: str) -> List[bytes]:
        """Return the messages to a new subscriber, which the player notices."""
        self.listener.on_subscribe()
        self._node.let_work()
        return list(self._latched[topic].values())

    def publish(self, connection: int, pieces: Sequence[bytes], due_ns: int) -> None:
        """See BagPublishers."""
        topic, data = self._by_number[connection], b''.join(pieces)
        self._give(due_ns, lambda: self._send(topic, self._sources[connection], data))

    def withdraw(self, connection: int, due_ns: int) -> None:
        """See BagPublishers."""
        latched = self._latched[self._by_number[connection].name]
        self._give(due_ns, lambda: latched.pop(self._sources[connection], None))

    def revoke(self, after_ns: int) -> int:
        """See BagPublishers."""
        until_ns = max([after_ns, *(it.due_ns for it in self._given if not it.may_be_revoked)])
        kept = [it for it in self._given if it.due_ns <= until_ns]
        for scheduled in self._given[len(kept):]:
            scheduled.is_revoked = True
        count = len(self._given) - len(kept)
        self._given = kept[-1:]
        return count

    def jump(self, bag_ns: int) -> None:
        """See BagPublishers."""
        self.listener.on_jump(bag_ns)

    def restored(self, stamps: RestoredStamps) -> None:
        """See BagPublishers."""
        self.listener.on_restored(stamps)

    def finish(self) -> bool:
        """See BagPublishers."""
        return self.listener.on_finish()

    def wait_until_sent(self, _timeout_s: float) -> bool:
        """See BagPublishers."""
        if self._given:
            left_s = self._given[-1].due_ns / NS_PER_S - self._node.now_s
            self._node.advance(max(left_s, 0.0) + _ROUNDING_S)
        return True

    def close(self) -> None:
        """See BagPublishers."""
        self.revoke(0)

    def _give(self, due_ns: int, send: Callable[[], Any]) -> None:
        now_ns = round(self._node.now_s * NS_PER_S)
        last_ns = self._given[-1].due_ns if self._given else 0
        scheduled = _Scheduled(max(due_ns, now_ns, last_ns), due_ns > now_ns, send)
        self._given.append(scheduled)
        self._node.call_in((scheduled.due_ns - now_ns) / NS_PER_S, scheduled.fire)

    def _send(self, topic: PublishedTopic, source: int, data: bytes) -> None:
        self.published[topic.name] += 1
        self.received.append(Received(self._node.wall_s(), topic.name, data))
        if topic.latch:
            self._latched[topic.name].pop(source, None)
            self._latched[topic.name][source] = data
        message = rospy.AnyMsg()
        message._buff = data
        message._connection_header = {'type': topic.connection.type,
                                      'md5sum': topic.connection.md5sum,
                                      'callerid': f'/{BAG_PLAYER}'}
        self._node.receiver.send(topic.name, message, topic.latch)


class _Scheduled:
    """A message given to the sender."""

    def __init__(self, due_ns: int, may_be_revoked: bool, send: Callable[[], Any]) -> None:
        self.due_ns, self.may_be_revoked, self._send = due_ns, may_be_revoked, send
        self.is_revoked = False

    def fire(self) -> None:
        """Send it, unless it was canceled."""
        if not self.is_revoked:
            self._send()


class _PlayerNode(SimulatedNode):
    """The player's handle, in the time of the receiving node.

    After each event of the player, its engine has completed the immediate effects.
    """

    def __init__(self, receiver: SimulatedNode, turns: _Turns) -> None:
        self.receiver, self._turns = receiver, turns
        super().__init__(f'/{BAG_PLAYER}')

    @property
    def now_s(self) -> float:
        """The time [s]."""
        return self.receiver.now_s

    @now_s.setter
    def now_s(self, _value: float) -> None:
        """Do nothing: the time is the receiver's."""

    def wall_s(self) -> float:
        """Return the time of day [s]."""
        return self.receiver.wall_s()

    def let_work(self) -> None:
        """Let the engine work, and let all parts complete the immediate effects."""
        self._turns.let_engine_work()
        self.advance(0.0)

    def publisher(self, topic: str, message_class: type, queue_size: int = 10,
                  latch: bool = False, tcp_nodelay: bool = False,
                  greeting: Optional[Callable[[], Any]] = None) -> SimulatedPublisher:
        """Advertise; the receiver gets the published messages."""
        own, name = super().publisher(topic, message_class), self.resolve(topic)

        def send(message: Any) -> None:
            own.messages.append(message)
            self.receiver.call_in(0.0, lambda: self.receiver.send(name, message, latch))
        found = SimulatedPublisher(message_class, [])
        found.publish = send
        return found

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any]
              ) -> SimulatedServer:
        """Offer a service, to the receiver too."""
        self.receiver.offered[self.resolve(name)] = handler
        return super().serve(name, service_class, handler)

    def call(self, service: str, request: Any) -> Any:
        """Return the answer of a service; its effect is complete."""
        answer = super().call(service, request)
        self.let_work()
        return answer

    def call_in(self, wait_s: float, callback: Callable[[], None]) -> None:
        """Call a function after a time, and let the engine work then."""
        def act() -> None:
            callback()
            self._turns.let_engine_work()
        self.receiver.call_in(wait_s, act)

    def advance(self, duration_s: float) -> None:
        """Let time pass."""
        self.receiver.advance(duration_s)

    def thread(self, work: Callable[[], None], name: str) -> _EngineThread:
        """Start the engine's thread; it has completed its immediate work."""
        thread = _EngineThread(work, self._turns)
        self._turns.begin(thread)
        return thread


class _EngineThread(threading.Thread):
    """A thread that works only when it is its turn."""

    def __init__(self, work: Callable[[], None], turns: _Turns) -> None:
        super().__init__(daemon=True)
        self._work, self._turns = work, turns

    def run(self) -> None:
        """Work to the end."""
        try:
            self._work()
        finally:
            self._turns.end()

    def join(self, timeout: Optional[float] = None) -> None:
        """Wait for its end."""
        self._turns.let_engine_work()
        super().join(_ANSWER_S)
        assert not self.is_alive()


class _Turns(Clock):
    """Lets the engine's thread and the test's run in turn, never both: the engine while it works.

    When the engine waits, the test continues, and time passes only there.
    """

    def __init__(self, node: SimulatedNode) -> None:
        self._node = node
        self._engine, self._test = threading.Semaphore(0), threading.Semaphore(0)
        self._works = False
        self._waits = 0

    def monotonic_ns(self) -> int:
        """Return the node's time [ns]."""
        return round(self._node.monotonic_s() * NS_PER_S)

    def wall_ns(self) -> int:
        """Return the node's time of day [ns]."""
        return round(self._node.wall_s() * NS_PER_S)

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        """Let the test continue; the engine checks again after each event, and after the time."""
        self._waits += 1
        if timeout_ns < FOREVER_NS:
            number = self._waits
            self._node.call_in(timeout_ns / NS_PER_S, lambda: self._time_is_over(number))
        condition.release()
        self._test.release()
        self._engine.acquire()
        condition.acquire()

    def result(self, answer: Future[Result], timeout_s: float) -> Result:
        """Return the engine's answer."""
        self.let_engine_work()
        return answer.result(0.0)

    def begin(self, thread: threading.Thread) -> None:
        """Start the engine's thread."""
        self._works = True
        thread.start()
        self._wait_for_engine()

    def let_engine_work(self) -> None:
        """Let the engine continue until it waits again, or ends."""
        if self._works:
            self._engine.release()
            self._wait_for_engine()

    def _time_is_over(self, number: int) -> None:
        if number == self._waits:  # it has not checked since then
            self.let_engine_work()

    def end(self) -> None:
        """Record that the engine has ended."""
        self._works = False
        self._test.release()

    def _wait_for_engine(self) -> None:
        assert self._test.acquire(timeout=_ANSWER_S), 'the engine does not come to a wait'
