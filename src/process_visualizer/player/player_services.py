# SPDX-License-Identifier: BSD-3-Clause
"""The player's services, its published state, and reading of its recording."""
from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Optional, Sequence, Type

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.topic_messages import (
    TopicMessages,
    topic_messages,
    topic_period_s,
)
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.timeline import NS_PER_S, CommandRefused
from process_visualizer.player.bag_publishers import PublishedTopic
from process_visualizer.ros_names import PLAYBACK_RATE
from process_visualizer.srv import (
    ReadTopic,
    ReadTopicRequest,
    ReadTopicResponse,
    Seek,
    SeekResponse,
    SetLoop,
    SetLoopResponse,
    SetRate,
    SetRateResponse,
    Step,
    StepResponse,
)

_ENDED = 'the player is ending'


class PlayerServices:
    """One service for each command; each answers with success and a message.

    The services stay advertised until the node ends, when rospy unregisters them all. rospy shuts
    down in a thread of its own, and would leave a service registered with the master if another
    thread was just unregistering it.
    """

    def __init__(self, control: PlayerControl, after: Callable[[], None],
                 node: NodeHandle) -> None:
        """Advertise the services; ``after`` is called after each command."""
        self._after = after
        self._node = node
        self._has_ended = False
        triggers: Dict[str, Callable[[], str]] = {
            'play': control.play, 'pause': control.pause, 'stop': control.stop,
            'toggle_paused': control.toggle_paused, 'repeat': control.repeat}
        for name, do in triggers.items():
            self._offer(name, Trigger, TriggerResponse, _without_request(do))
        self._offer('seek', Seek, SeekResponse, lambda it: control.seek(it.position))
        self._offer('set_rate', SetRate, SetRateResponse, lambda it: control.set_rate(it.rate))
        self._offer('step', Step, StepResponse,
                    lambda it: control.step(it.count, it.topic, it.duration))
        self._offer('set_loop', SetLoop, SetLoopResponse,
                    lambda it: control.set_loop(it.loop, it.begin, it.end))

    def close(self) -> None:
        """Refuse all later commands."""
        self._has_ended = True

    def _offer(self, name: str, service: Type[Any], response: Type[Any],
               command: Callable[[Any], str]) -> None:
        def answer(request: Any) -> Any:
            if self._has_ended:
                return response(False, _ENDED)
            try:
                result = response(True, command(request))
            except CommandRefused as refusal:
                result = response(False, str(refusal))
            self._after()
            return result

        self._node.serve(f'~{name}', service, answer)


def _without_request(command: Callable[[], str]) -> Callable[[Any], str]:
    return lambda request: command()


PERIOD_S = 0.09


class StatePublisher:
    """A thread that publishes ~state, latched, and keeps the rate parameter up to date."""

    def __init__(self, state: Callable[[], PlayerState], node: NodeHandle) -> None:
        """Set the function that returns the message; nothing is published before ``begin``."""
        self._state, self._node = state, node
        self._publisher = node.publisher('~state', PlayerState, latch=True, queue_size=10,
                                         tcp_nodelay=True)
        self._publishing = threading.Lock()
        self._begun = self._closed = False
        self._rate = 0.0  # value of the parameter
        self._worker = node.worker(self._work, 'player state')

    def begin(self) -> None:
        """Begin to publish: receivers of a state may send commands."""
        self._begun = True
        self._worker.wake()

    def update(self) -> None:
        """Publish soon, as something has changed."""
        self._worker.wake()

    def close(self) -> None:
        """Publish for the last time and end."""
        with self._publishing:
            self._closed = True
            if self._begun:
                self._publish()
                self._follow_rate(1.0)  # live data or another recording may follow

    def _work(self) -> Optional[float]:
        with self._publishing:
            if not self._begun or self._closed:
                return None
            self._publish()
        return PERIOD_S

    def _publish(self) -> None:
        state = self._state()
        self._follow_rate(state.rate)
        try:
            self._publisher.publish(state)
        except rospy.ROSException as error:  # the node is shutting down
            rospy.logdebug('the state is not published: %s', error)

    def _follow_rate(self, rate: float) -> None:
        """Update the parameter for nodes that read it; the position is only in ~state."""
        if rate == self._rate:
            return
        try:
            self._node.set_param(PLAYBACK_RATE, rate)
            self._rate = rate
        except (OSError, rospy.ROSException) as error:
            rospy.logwarn_throttle(10.0, f'{PLAYBACK_RATE} cannot be set: {error}')


MAX_BYTES = 1 << 20
_MAX_S = 1e9  # from the beginning of a recording; times farther away are invalid


class TopicReadingService:
    """The service ~read: the messages of a topic between two positions, as recorded.

    The answer begins with the newest message of each joint before the first position, however old:
    a joint keeps its last reported position.
    """

    def __init__(self, recording: Recording, topics: Sequence[PublishedTopic], node: NodeHandle,
                 held: Callable[[str, int], Sequence[int]]) -> None:
        """Advertise the service for the played topics.

        ``held`` returns the rows of such messages in the index, for a recorded topic and a bag
        time [ns].
        """
        self._recording, self._held = recording, held
        self._begin_ns = recording.begin_ns
        self._topics = {node.resolve(topic.name): topic for topic in topics}
        self._periods_s: Dict[str, float] = {}
        self._has_ended = False
        node.serve('~read', ReadTopic, self._read)

    def close(self) -> None:
        """Refuse all later requests."""
        self._has_ended = True

    def _read(self, request: ReadTopicRequest) -> ReadTopicResponse:
        if self._has_ended:
            return ReadTopicResponse(success=False, message=_ENDED)
        topic = self._topics.get(request.topic)
        if topic is None:
            return ReadTopicResponse(success=False, message=f'{request.topic} is not played')
        if not -_MAX_S < request.begin <= request.end < _MAX_S:
            return ReadTopicResponse(success=False, message='begin and end must be positions in '
                                     f's, not {request.begin} and {request.end}')
        begin_ns = self._bag_ns(request.begin)
        return self._answer(topic, topic_messages(
            self._recording, topic.numbers, begin_ns, self._bag_ns(request.end), MAX_BYTES,
            self._held(topic.connection.topic, begin_ns)))

    def _answer(self, topic: PublishedTopic, found: TopicMessages) -> ReadTopicResponse:
        return ReadTopicResponse(
            success=True, type=topic.connection.type,
            recording_begin=rospy.Time(*divmod(self._begin_ns, NS_PER_S)),
            end=self._position_s(found.end_ns), period=self._period_s(topic),
            positions=[self._position_s(time_ns) for time_ns in found.times_ns],
            sizes=[len(message) for message in found.messages],
            data=b''.join(found.messages))

    def _period_s(self, topic: PublishedTopic) -> float:
        if topic.name not in self._periods_s:
            self._periods_s[topic.name] = topic_period_s(self._recording, topic.numbers)
        return self._periods_s[topic.name]

    def _bag_ns(self, position_s: float) -> int:
        return self._begin_ns + round(position_s * NS_PER_S)

    def _position_s(self, bag_ns: int) -> float:
        return (bag_ns - self._begin_ns) / NS_PER_S
