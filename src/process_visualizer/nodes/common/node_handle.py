# SPDX-License-Identifier: BSD-3-Clause
"""A node's connection to ROS and to the clocks, in one object that a test can replace."""
from __future__ import annotations

import logging
import os
import queue
import signal
import sys
import threading
import time
from logging.handlers import QueueHandler, QueueListener
from typing import Any, Callable, FrozenSet, Iterator, List, NoReturn, Optional, Tuple

import rospy
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.rosout import RosOutHandler

from process_visualizer.clients.service_connection import ServiceConnection
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.node_server import answer_patiently, serve_patiently
from process_visualizer.playback.playback_clock import ClockState, PlaybackClock
from process_visualizer.ros_names import PLAYER_STATE_TOPIC
from process_visualizer.shown_text import shown

MAX_NAME_CHARACTERS = 255  # as in common/required_name.hpp
_SHOWN_CHARACTERS = 100

# Starts and ends the process of a rospy node; rospy alone does not always end it.

_SHUTDOWN_S = 5.0
"""Time limit for the whole shutdown. It suffices to unregister many topics at a busy master, which
would otherwise keep listing the node, and is less than the 15 s after which roslaunch kills it."""


def start_node(name: str, argv: Optional[List[str]] = None) -> None:
    """Make this process a node that SIGINT and SIGTERM shut down, even while it initializes.

    Call it in the main thread instead of ``rospy.init_node``. rospy's own handlers shut down in the
    thread that the signal interrupts. If that thread is just calling the master, it holds the lock
    that unregistering needs, and waits for itself forever.
    """
    serve_patiently()
    received = threading.Event()

    def shut_down() -> None:
        received.wait()
        rospy.signal_shutdown('a signal')

    threading.Thread(target=shut_down, name='end at a signal', daemon=True).start()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: received.set())
    try:
        rospy.init_node(name, argv=argv, disable_signals=True)
    except rospy.ROSInitException:
        if not rospy.is_shutdown():
            raise
        end_process(0)
    answer_patiently()
    log_without_waiting(logging.getLogger('rosout'))


def log_without_waiting(log: logging.Logger) -> None:
    """Send the messages of a log to /rosout from a thread.

    rospy asks the master before each message, without a timeout: while the master hangs, every
    thread that logs would block.
    """
    for handler in [it for it in log.handlers if isinstance(it, RosOutHandler)]:
        waiting: 'queue.Queue[logging.LogRecord]' = queue.Queue()
        log.removeHandler(handler)
        log.addHandler(QueueHandler(waiting))
        QueueListener(waiting, handler).start()


def at_shutdown(hook: Callable[[], None]) -> None:
    """Call a function once when the node shuts down, even if the shutdown has begun.

    rospy itself ignores a function that is registered while it calls the earlier ones.
    """
    uncalled = threading.Lock()

    def call() -> None:
        if uncalled.acquire(blocking=False):
            hook()

    rospy.on_shutdown(call)
    if rospy.is_shutdown():
        call()


def spin_to_end(*cleanups: Callable[[], None]) -> NoReturn:
    """Wait until ROS shuts the node down, then end its process with code 0.

    The cleanups are called at the shutdown. They and rospy share a limit of 5 s; then the process
    ends even if something hangs. roslaunch would wait 15 s.
    """
    begin = _limit(0)
    for hook in (begin, *cleanups):  # rospy calls them one after the other
        at_shutdown(hook)
    rospy.spin()
    end_process(0)


def end_process(code: int) -> NoReturn:
    """Shut down the node, if there is one, and end the process within 5 s.

    rospy writes to each subscriber in a thread that is not a daemon. If the subscriber leaves
    while the node shuts down, that thread may never end, and the interpreter would wait for it
    forever, ignoring SIGINT and SIGTERM.
    """
    _limit(code)()
    rospy.signal_shutdown('the program ends')
    # It returns at once if another thread is shutting down, perhaps before the node is unregistered
    # at the master. Registering a function waits until that is done.
    rospy.on_shutdown(lambda: None)
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _limit(code: int) -> Callable[[], None]:
    """Return a function that starts the countdown to the end of the process.

    The countdown's thread is started in advance, and only ends the process: a thread that hangs
    may hold the locks of logging and of a full pipe.
    """
    begun = threading.Event()

    def end() -> None:
        begun.wait()
        time.sleep(_SHUTDOWN_S)
        os._exit(code)

    threading.Thread(target=end, name='limit of the shutdown', daemon=True).start()
    return begun.set


class Worker:
    """A thread that calls a function whenever it is woken, never twice at a time."""

    def __init__(self, step: Callable[[], Optional[float]], name: str) -> None:
        """Start the thread; ``step`` returns the time until its next call [s], or None.

        `wake` calls it earlier; after None, only `wake` does. The time is real time, not ROS time.
        """
        self._step = step
        self._woken = threading.Event()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def wake(self) -> None:
        """Let the function be called soon; several wake-ups before that lead to one call."""
        self._woken.set()

    def _run(self) -> None:
        wait_s: Optional[float] = None
        while not rospy.is_shutdown():
            self._woken.wait(wait_s)
            self._woken.clear()
            wait_s = self._step()


class _Greeter(rospy.SubscribeListener):
    """Sends a message to each new subscriber."""

    def __init__(self, greeting: Callable[[], Any]) -> None:
        self._greeting = greeting

    def peer_subscribe(self, _topic: str, _publish: Callable[[Any], None],
                       publish_to_peer: Callable[[Any], None]) -> None:
        """See SubscribeListener."""
        message = self._greeting()
        if message is not None:
            publish_to_peer(message)


class NodeHandle:
    """Everything that a node needs from rospy and the clocks.

    Our nodes use a handle instead of calling rospy. A test passes one whose clock it advances
    itself, so that a second of a node passes at once and reproducibly.
    """

    @property
    def name(self) -> str:
        """The node's full name."""
        return str(rospy.get_name())

    def resolve(self, name: str) -> str:
        """Return the full name of a topic, service or parameter."""
        return str(rospy.resolve_name(name))

    def ros_s(self) -> float:
        """Return ROS time [s], which can stop or jump under /use_sim_time."""
        return float(rospy.get_time())

    def now(self) -> rospy.Time:
        """Return ROS time as a stamp, to the nanosecond."""
        return rospy.Time.now()

    def is_wall_clock(self) -> bool:
        """Return whether ROS time is the time of day, not a simulated one."""
        return bool(rospy.rostime.is_wallclock())

    def wall_s(self) -> float:
        """Return the time of day [s since 1970]; it jumps when the clock is set."""
        return time.time()

    def monotonic_s(self) -> float:
        """Return the time [s] of a monotonic clock."""
        return time.monotonic()

    def is_shutdown(self) -> bool:
        """Return whether the node is shutting down."""
        return bool(rospy.is_shutdown())

    def at_shutdown(self, hook: Callable[[], None]) -> None:
        """Call a function once when the node shuts down."""
        at_shutdown(hook)

    def param(self, name: str, default: Any = None) -> Any:
        """Return a parameter of the parameter server, or the default.

        Raises:
            ValueError: no parameter can have this name.
        """
        return rospy.get_param(required_name(name), default)

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter of the parameter server.

        Raises:
            OSError, rospy.ROSException: the master does not answer.
        """
        rospy.set_param(name, value)

    def follow_param(self, name: str) -> Callable[[], Any]:
        """Return a function that returns a parameter's present value; None if it is not set.

        Reading needs no call to the master, which reports each change. rospy.get_param_cached asks
        the master at every access to an unset parameter, so it is called only once here, and then
        its cache is read.
        """
        full_name = self.resolve(name)
        rospy.get_param_cached(full_name, None)

        def value() -> Any:
            try:
                return get_param_server_cache().get(full_name)
            except KeyError:
                return None

        return value

    def publisher(self, topic: str, message_class: type, queue_size: int = 10,
                  latch: bool = False, tcp_nodelay: bool = False,
                  greeting: Optional[Callable[[], Any]] = None) -> Any:
        """Advertise a topic; return rospy's publisher.

        ``greeting`` returns a message that only a new subscriber receives, or None.
        """
        return rospy.Publisher(topic, message_class, queue_size=queue_size, latch=latch,
                               tcp_nodelay=tcp_nodelay,
                               subscriber_listener=None if greeting is None else _Greeter(greeting))

    def subscribe(self, topic: str, message_class: type, callback: Callable[[Any], None],
                  queue_size: Optional[int] = None, buff_size: int = 1 << 16) -> Any:
        """Subscribe without Nagle's delay; return rospy's subscriber.

        ``callback`` runs in a thread of the connection. With rospy.AnyMsg as the class, it receives
        the serialized message, with the publisher's header in ``_connection_header``. Data is read
        from the socket in pieces of at most ``buff_size`` bytes.

        Raises:
            ValueError: no topic can have this name.
        """
        return rospy.Subscriber(required_name(topic), message_class, callback,
                                queue_size=queue_size, buff_size=buff_size, tcp_nodelay=True)

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any]) -> Any:
        """Offer a service; return rospy's service. See `checking_names`."""
        return rospy.Service(name, service_class, checking_names(service_class, handler))

    def connect(self, name: str, service_class: Any, timeout_s: float) -> ServiceConnection:
        """Return a connection to another node's service, which is opened by the first call."""
        return ServiceConnection(self.resolve(name), service_class, timeout_s)

    def every(self, period_s: float, callback: Callable[[], None]) -> Any:
        """Call a function each period of ROS time, in a thread; ``shutdown()`` ends it."""
        return rospy.Timer(rospy.Duration.from_sec(period_s), lambda _event: callback(),
                           reset=True)

    def every_real(self, period_s: float, callback: Callable[[], None]) -> None:
        """Call a function each period of real time, even while ROS time is stopped."""
        pause = threading.Event()  # never set

        def run() -> None:
            while not rospy.is_shutdown():
                callback()
                pause.wait(period_s)

        threading.Thread(target=run, name=f'every {period_s:g} s', daemon=True).start()

    def worker(self, step: Callable[[], Optional[float]], name: str) -> Worker:
        """Start a thread for work that must not delay the callbacks; see `Worker`."""
        return Worker(step, name)

    def thread(self, work: Callable[[], None], name: str) -> threading.Thread:
        """Start a thread for work that waits with `playback.clock`; return it."""
        thread = threading.Thread(target=work, name=name, daemon=True)
        thread.start()
        return thread

    def info(self, text: str) -> None:
        """Log information about something that is not a problem."""
        rospy.loginfo('%s', shown(text))

    def warn(self, text: str) -> None:
        """Log a warning."""
        rospy.logwarn('%s', shown(text))

    def error(self, text: str) -> None:
        """Log an error."""
        rospy.logerr('%s', shown(text))


def required_name(name: str) -> str:
    """Return the name of a topic or parameter from another program, if the master can accept it.

    rospy retries forever to send a name that XML cannot represent, and keeps the lock that all its
    subscribers and publishers need.

    Raises:
        ValueError: the name is empty, too long or not printable.
    """
    if not name or not name.isprintable():
        raise ValueError(f'{name[:_SHOWN_CHARACTERS]!a} is not a name of a topic or parameter')
    if len(name) > MAX_NAME_CHARACTERS:
        raise ValueError(_too_long('a name', name))
    return name


def checking_names(service_class: Any, handler: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a handler of service requests that refuses texts which cannot be names.

    All texts in requests to our nodes are names. The handler may pass them to other programs or
    repeat them in its answer, so they must not have megabytes.
    """
    def answer(request: Any) -> Any:
        for field, text in _texts(request):
            if len(text) > MAX_NAME_CHARACTERS:
                return service_class._response_class(success=False, message=_too_long(field, text))
            if not text.isprintable():
                return service_class._response_class(
                    success=False, message=f'{field}: {text!a} is not a name')
        return handler(request)

    return answer


def _too_long(what: str, name: str) -> str:
    return f'{what} has {len(name)} characters; at most {MAX_NAME_CHARACTERS} are allowed'


def _texts(message: Any) -> Iterator[Tuple[str, str]]:
    """Yield the texts in a message, each with the name of its field."""
    for field, kind in zip(message.__slots__, message._slot_types):
        value = getattr(message, field)
        values = value if kind.endswith(']') else (value,)
        kind = kind.partition('[')[0]
        if kind == 'string':
            yield from ((field, it) for it in values)
        elif '/' in kind:
            for part in values:
                yield from _texts(part)


class PlaybackFollower:
    """Keeps a playback clock up to date; costs nothing in real-time mode."""

    def __init__(self, node: NodeHandle) -> None:
        """Subscribe to the player's state."""
        self._node = node
        self.clock = PlaybackClock()
        self._not_begun: FrozenSet[str] = frozenset()
        self._has_complained = False
        node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._receive)

    def data_time_s(self) -> float:
        """Return the present time [s] of the clock for the arrival of data (see PlaybackClock)."""
        return self.clock.data_time_s(self._node.ros_s())

    def age_s(self, arrival_s: float) -> float:
        """Return the present age [s] of data that arrived at a time of that clock."""
        return self.clock.age_s(arrival_s, self._node.ros_s())

    def is_from_before(self, arrival_s: float) -> bool:
        """Return whether data that arrived at a time of that clock is not from the present player.

        Such data is from another recording, or from a live cell.
        """
        return self.clock.is_from_before(arrival_s) and \
            self.clock.follows_player(self._node.ros_s())

    def has_begun(self, topic: str) -> bool:
        """Return whether a topic (full name) has a message up to the position, or none is played.

        If a topic has not begun, a node's data of it is from another position, or from another
        source.
        """
        return topic not in self._not_begun or not self.clock.follows_player(self._node.ros_s())

    def _receive(self, state: PlayerState) -> None:
        self._not_begun = frozenset(state.not_begun)
        reported = ClockState(state.stamp.to_sec(), state.position, state.rate,
                              state.paused, state.segment, state.since.to_sec(),
                              '\n'.join(state.files))
        if not reported.is_usable() and not self._has_complained:
            self._has_complained = True
            self._node.warn(f'a state on {PLAYER_STATE_TOPIC} is left out: position '
                            f'{reported.position_s} s, rate {reported.rate}. Its publisher is not '
                            'a player')
        self.clock.add(reported)
