# SPDX-License-Identifier: BSD-3-Clause
"""A viewer of one cell elsewhere, until RViz is closed or the user ends it."""
from __future__ import annotations

import os
import queue
import threading
import time
from functools import partial
from pathlib import Path
from typing import Callable, Collection, Dict, List, Optional, Set, Tuple

import rosgraph
import rospkg
import rospy
import yaml
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.message_definition import (
    Connection,
    DefinitionError,
    installed_connection,
)
from process_visualizer.bagio.message_layout import MessageDamaged, StampLocator
from process_visualizer.bagio.message_parts import named_meshes
from process_visualizer.cell.model import Mode
from process_visualizer.generate.launch_writer import LaunchTag, write_document
from process_visualizer.generate.plan import RVIZ_PART
from process_visualizer.health.alarm_board import AlarmBoard
from process_visualizer.health.alarm_conditions import watch_conditions
from process_visualizer.launching.cell_watch import CellLook, CellWatch
from process_visualizer.launching.part_report import NodeState
from process_visualizer.launching.run import LaunchRun
from process_visualizer.nodes.common.markers import text_marker
from process_visualizer.player.bag_publishers import TopicPublisher
from process_visualizer.player.timed_sender import TimedSender
from process_visualizer.remote.link_words import (
    clocks_apart,
    no_connection,
    still_no_connection,
    types_differ,
    versions_differ,
)
from process_visualizer.remote.offer import Offer, OfferedTopic, are_different, digest_of
from process_visualizer.remote.packets import Message
from process_visualizer.remote.shown_view import (
    LINK_TOPIC,
    ShownModels,
    fixed_frame,
    shown_models,
    shown_view,
)
from process_visualizer.robot.mesh_files import mesh_problem
from process_visualizer.ros_names import PACKAGE, RVIZ, TF_TOPIC
from process_visualizer.rviz.views import read_view
from process_visualizer.viewing.relay_connection import RelayConnection, RelaySource

_QUEUE = 20
_MAX_TOPICS, _MAX_SOURCES = 2000, 10_000
_MAX_PROBLEMS = 100
"""Maximum number of problems that are reported: a faulty cell causes new ones all the time."""
_TAIL = 6  # number of RViz's last lines that are reported if it has failed
_MAX_WAITING = 16
"""Maximum number of events from the cell that wait to be handled."""
_AMBER = (1.0, 0.7, 0.1, 1.0)
_HEIGHT_M = 0.08
_ABOVE_M = (0.0, 0.0, 1.5)


class OwnScene:
    """Publishes messages as bytes after a check: RViz would believe any length that they claim."""

    def __init__(self, on_subscribe: Callable[[], None]) -> None:
        """``on_subscribe`` is called when a topic gets its first subscriber here."""
        self._sender = TimedSender()
        self._on_subscribe = on_subscribe
        self._lock = threading.Lock()
        self._topics: Dict[str, _OwnTopic] = {}
        self._sources: Dict[RelaySource, int] = {}
        self._problems: Dict[str, None] = {}
        self._told: Set[str] = set()
        self._link = rospy.Publisher(LINK_TOPIC, MarkerArray, queue_size=1, latch=True)

    def advertise(self, topics: Dict[str, OfferedTopic]) -> None:
        """Publish further topics."""
        for name, topic in topics.items():
            with self._lock:
                is_new = name not in self._topics and name != LINK_TOPIC
                if is_new and len(self._topics) >= _MAX_TOPICS:
                    self._note(f'more than {_MAX_TOPICS} topics are not shown')
                    break
            if is_new:
                own = _own_topic(name, topic, self._sender, self._on_subscribe)
                with self._lock:
                    if own is None:
                        self._note(f'{name} is not shown: its type cannot be understood')
                    else:
                        self._topics[name] = own
        self._on_subscribe()

    def forget(self) -> None:
        """Stop publishing the topics of a cell that is there no more."""
        with self._lock:
            topics, self._topics, self._sources = self._topics, {}, {}
        for it in topics.values():
            it.publisher.close()

    def wanted(self) -> Set[str]:
        """Return the topics with local subscribers."""
        with self._lock:
            return {name for name, it in self._topics.items() if it.publisher.subscriber_count}

    def show(self, source: RelaySource, message: Message) -> None:
        """Publish a message if it fits its topic."""
        with self._lock:
            own = self._topics.get(source.topic)
            has_room = source in self._sources or len(self._sources) < _MAX_SOURCES
            number = self._sources.setdefault(source, len(self._sources)) if has_room else 0
        problem = 'it is not offered' if own is None else own.problem(source, message.data) \
            if has_room else 'it has too many publishers'
        if own is None or problem:
            with self._lock:
                self._note(f'{source.topic}: a message is not shown: {problem}')
            return
        now_ns = time.monotonic_ns()
        own.publisher.publish(number, [message.data], now_ns)
        if not source.is_latched:  # it would be old when the next subscriber comes
            own.publisher.withdraw(number, now_ns)

    def _note(self, problem: str) -> None:
        """Note a problem that was not reported yet, unless there are too many."""
        if problem in self._told or len(self._told) > _MAX_PROBLEMS:
            return
        if len(self._told) == _MAX_PROBLEMS:
            problem = 'there are more problems like these, which are not told'
        self._told.add(problem)
        self._problems[problem] = None

    def withdraw(self, topics: Collection[str]) -> None:
        """Latch nothing of topics that nobody subscribes to here any more: it would get old."""
        now_ns = time.monotonic_ns()
        with self._lock:
            found = [(self._topics[source.topic], number) for source, number
                     in self._sources.items() if source.topic in topics
                     and source.topic in self._topics]
        for own, number in found:
            own.publisher.withdraw(number, now_ns)

    def take_problems(self) -> List[str]:
        """Return the problems since the last call in words, each once."""
        with self._lock:
            found, self._problems = list(self._problems), {}
        return found

    def tell(self, text: str, frame: str) -> None:
        """Show a text in the scene; an empty one removes it."""
        marker = text_marker('link', frame, _ABOVE_M, text, _HEIGHT_M, _AMBER) if text else \
            Marker(action=Marker.DELETEALL)
        marker.header.frame_id = frame
        self._link.publish(MarkerArray([marker]))

    def close(self) -> None:
        """Stop publishing."""
        self._sender.close()


class _OwnTopic:
    def __init__(self, connection: Connection, locator: StampLocator,
                 publisher: TopicPublisher) -> None:
        self._connection, self._locator = connection, locator
        self.publisher = publisher

    def problem(self, source: RelaySource, data: bytes) -> str:
        """Return the problem of a message; empty if there is none."""
        if source.md5sum != self._connection.md5sum:
            return f'{source.caller} sends another {source.type}'
        try:
            self._locator.check(data)
            meshes = named_meshes(self._connection, data)
        except MessageDamaged as error:
            return str(error)
        return next(filter(None, map(mesh_problem, meshes)), '')


def _own_topic(name: str, topic: OfferedTopic, sender: TimedSender,
               on_subscribe: Callable[[], None]) -> Optional[_OwnTopic]:
    connection = Connection(name, topic.type, topic.md5sum, topic.definition, False, '')
    try:
        locator = StampLocator(topic.type, topic.definition)
        publisher = TopicPublisher(name, connection, name != TF_TOPIC, sender, _QUEUE, on_subscribe)
    except (DefinitionError, rospy.ROSException):
        return None
    return _OwnTopic(connection, locator, publisher)


_STEP_S = 0.25
_THIN_S = 20.0
"""Time without loss [s] after which the link counts as carrying everything.

With a shorter time, the two reports would alternate."""
_MAX_THINNED, _MAX_REASONS = 100, 20
_STALE_AFTER_S, _ADVISE_AFTER_S = 1.0, 15.0
"""Time without a connection after which the scene shows it, and after which there is advice [s]."""
_PLAYED = 'a recording, not live'
LAUNCH_FILE, VIEW_FILE = 'view.launch', 'view.rviz'
Say = Callable[[str], None]


class Viewer:
    """Connects, starts RViz when the cell has sent its offer, and reports in words.

    This process must be a node of the viewer's own master. The methods ``on_*`` are called in the
    thread of the connection, ``run`` in the main thread.
    """

    def __init__(self, name: str, address: Tuple[str, int], find: Callable[[], Tuple[str, int]],
                 folder: str, say: Say, with_rviz: bool) -> None:
        """``name`` is the user's name for the cell; ``folder`` receives files.

        ``address`` is that of the cell's relay; for ``find`` see RelayConnection.
        """
        self._name, self._folder, self._say = name, folder, say
        self._with_rviz = with_rviz
        self._events: 'queue.Queue[Callable[[], None]]' = queue.Queue()
        self._room = threading.Semaphore(_MAX_WAITING)
        self._is_closing = False
        self._scene = OwnScene(self._changed_wants)
        self._connection = RelayConnection(address, self, find)
        self._said: Dict[str, str] = {}
        self._losses: Set[str] = set()  # reasons reported for the present loss
        self._left_out_s: Dict[str, float] = {}  # when a topic was last thinned
        self._offer: Optional[Offer] = None
        self._offered: Optional[Offer] = None  # the newest one, in the thread of the connection
        self._run: Optional[LaunchRun] = None
        self._watch = CellWatch(self._running, lambda look: self._events.put(
            partial(self._take_look, look)))
        self._board = AlarmBoard()
        self._frame = ''
        self._models: Set[str] = set()  # the parameters that have been set
        self._lost_s: Optional[float] = None  # time of the last data before the present loss
        self._tried_s = 0.0  # time of the first failed attempt since then
        self._wanted: Tuple[str, ...] = ()
        self._wants_lock = threading.Lock()  # or an older wish could be sent last
        self._awaited: Dict[str, str] = {}
        self._is_ended = False

    def run(self) -> int:
        """Show the cell until it is ended here; return the exit code."""
        self._say(f'connecting to {self._name}')
        self._connection.start()
        self._watch.begin()
        while not self._is_ended:
            self._next_event(_STEP_S)()
            self._step()
        failed = None if self._run is None else self._run.failed_required
        if failed is None or not failed.exit_code:
            return 0
        self._say('\n  '.join([f'RViz: {failed.end_words}', *failed.log_tail[-_TAIL:]]))
        return 1

    def _next_event(self, longest_s: float) -> Callable[[], None]:
        try:
            return self._events.get(timeout=longest_s)
        except queue.Empty:
            return lambda: None

    def close(self) -> None:
        """End RViz and the connection."""
        self._is_closing = True
        self._watch.close()
        self._connection.close()
        self._stop_rviz()
        self._scene.close()

    def _put(self, act: Callable[[], None]) -> None:
        """Queue an action for the main thread; wait for room, as the cell may send without end."""
        while not self._room.acquire(timeout=_STEP_S):
            if self._is_closing:
                return
        self._events.put(partial(self._act, act))

    def _act(self, act: Callable[[], None]) -> None:
        self._room.release()
        act()

    def on_offer(self, offer: Offer) -> None:
        """See Listener."""
        if self._offered is not None and offer != self._offered:
            self._scene.forget()  # here, as the topics of this offer follow in this thread
        self._offered = offer
        self._put(partial(self._take_offer, offer))

    def on_topics(self, topics: Dict[str, OfferedTopic]) -> None:
        """See Listener."""
        self._scene.advertise(topics)
        ours = {it.type: installed_connection('/', it.type) for it in topics.values()}
        sums = {kind: it.md5sum for kind, it in ours.items() if it is not None}
        for sentence in types_differ(topics, sums):
            self._put(partial(self._tell, sentence, sentence))

    def on_message(self, source: RelaySource, message: Message) -> None:
        """See Listener."""
        self._scene.show(source, message)

    def on_left_out(self, counts: Dict[str, int]) -> None:
        """See Listener."""
        self._put(partial(self._take_left_out, counts))

    def on_lost(self, reason: str, heard_s: float) -> None:
        """See Listener."""
        self._put(partial(self._take_loss, reason, heard_s))

    def _take_offer(self, offer: Offer) -> None:
        before, self._offer = self._offer, offer
        if before is not None and self._lost_s is not None:
            self._say(f'connected again after {time.monotonic() - self._lost_s:.1f} s')
        if before is None or offer.mode != before.mode:
            self._say(f'{"connected: " if before is None else ""}the cell is in '
                      f'{_printable(offer.mode) or "unknown"} mode')
        self._lost_s = None
        self._scene.tell('', self._frame or 'world')
        if offer == before:
            return
        differing = versions_differ(offer.version, _own_version())
        if differing:
            self._tell('version', differing)
        if before is not None:
            self._say('another cell is there now' if are_different(offer.cell, before.cell) else
                      'the cell shows something else now')
        self._stop_rviz()
        try:
            self._start(offer)
        except (OSError, ValueError) as error:
            self._say(f'the view of the cell cannot be used: {error}')

    def _start(self, offer: Offer) -> None:
        default = os.path.join(rospkg.RosPack().get_path(PACKAGE), 'rviz_config', 'default.rviz')
        view = shown_view(offer.view, read_view(default))
        self._frame = fixed_frame(view)
        models = shown_models(offer.models, offer.meshes, self._folder)
        for uri in models.left_out:
            self._say(f'the cell does not send the mesh {_printable(uri)}: it is not shown')
        self._forget_models(models.texts)
        Path(self._folder, VIEW_FILE).write_text(yaml.safe_dump(view, sort_keys=False),
                                                 encoding='utf-8')
        launch = LaunchTag('launch')
        for number, (name, text) in enumerate(models.texts.items()):
            Path(self._folder, f'{number}.urdf').write_text(text, encoding='utf-8')
            launch.add('param', {'name': name, 'textfile': f'$(dirname)/{number}.urdf'})
        if self._with_rviz:
            node = launch.add('node', {
                'pkg': PACKAGE, 'type': RVIZ, 'name': RVIZ, 'output': 'log', 'required': 'true',
                'args': f'-d "$(dirname)/{VIEW_FILE}"'})
            node.add('env', {'name': 'DISABLE_ROS1_EOL_WARNINGS', 'value': '1'})
        Path(self._folder, LAUNCH_FILE).write_text(write_document(launch), encoding='utf-8')
        self._fetch(offer, models)
        if not models.wanted:
            self._launch()

    def _forget_models(self, names: Collection[str]) -> None:
        """Delete the parameters of models that are no longer among these."""
        for name in self._models.difference(names):
            try:
                rospy.delete_param(name)
            except (KeyError, rospy.ROSException, rosgraph.MasterException, OSError):
                continue  # it is gone, or the master here is
        self._models = set(names)

    def _fetch(self, offer: Offer, models: ShownModels) -> None:
        """Request meshes; RViz starts when all have arrived, as it reads each only once."""
        self._awaited = dict(models.wanted)
        size = sum(offer.meshes[uri].size for uri in models.wanted)
        if models.wanted:
            self._say(f'getting {len(models.wanted)} meshes from the cell, {size / 1e6:.1f} MB')
        for uri, path in models.wanted.items():
            self._connection.fetch(uri, partial(self._on_mesh, offer, uri, path))

    def _on_mesh(self, offer: Offer, uri: str, path: str, data: bytes) -> None:
        self._put(partial(self._take_mesh, offer, uri, path, data))

    def _take_mesh(self, offer: Offer, uri: str, path: str, data: bytes) -> None:
        if offer is not self._offer or self._awaited.pop(uri, None) is None:
            return  # for a view that is no longer shown
        if digest_of(data) == offer.meshes[uri].digest:
            Path(path).write_bytes(data)
        else:
            self._say(f'the mesh {_printable(uri)} of the cell has changed: it is not shown')
        if not self._awaited:
            self._launch()

    def _launch(self) -> None:
        self._run = LaunchRun(os.path.join(self._folder, LAUNCH_FILE), lambda report: None,
                              on_end=lambda code: self._events.put(partial(self._take_end, code)))
        self._say('RViz is starting' if self._with_rviz else 'ready')

    def _take_end(self, code: int) -> None:
        """End with RViz; without RViz roslaunch ends as soon as the models are set."""
        if self._with_rviz and self._run is not None and self._run.wait(0.0):
            self._is_ended = True

    def _running(self) -> Set[str]:
        """Return the nodes here that should answer."""
        run = self._run
        return set() if run is None or self._is_closing else \
            {it.name for it in run.reports() if it.state is NodeState.RUNNING}

    def _take_look(self, look: CellLook) -> None:
        """Report nodes that no longer answer here, and those that answer again."""
        count = len(self._board.events)
        self._board = self._board.seen(watch_conditions(
            Mode.REALTIME, look, dict.fromkeys(look.silent, RVIZ_PART)), time.monotonic())
        for event in self._board.events[count:]:
            self._say(event.text)

    def _stop_rviz(self) -> None:
        run, self._run = self._run, None
        if run is not None:
            run.stop()

    def _take_loss(self, reason: str, heard_s: float) -> None:
        if self._lost_s is None:
            self._lost_s, self._tried_s = heard_s, time.monotonic()
        if reason not in self._losses and len(self._losses) < _MAX_REASONS:
            self._say(f'no connection to {self._name}: {_printable(reason)}; trying again')
            self._losses.add(reason)

    def _take_left_out(self, counts: Dict[str, int]) -> None:
        """Report the topics that are thinned; each until it has arrived in full for some time."""
        now_s = time.monotonic()
        self._left_out_s.update(dict.fromkeys(counts, now_s))
        recent = [it for it in self._left_out_s.items() if now_s - it[1] < _THIN_S]
        self._left_out_s = dict(recent[-_MAX_THINNED:])  # a relay may invent names
        names = ', '.join(sorted(_printable(it) for it in self._left_out_s))
        self._tell('thin', f'not everything of {names} arrives: the link, or one of the computers, '
                   'is too slow for it, or its messages have more than 64 MB'
                   if names else ('the link carries everything' if 'thin' in self._said else ''))

    def _step(self) -> None:
        """Report changes in words."""
        self._changed_wants()
        for problem in self._scene.take_problems():
            self._tell(problem, _printable(problem))
        lost_for_s = 0.0 if self._lost_s is None else time.monotonic() - self._lost_s
        if self._lost_s is not None and time.monotonic() - self._tried_s > _ADVISE_AFTER_S:
            self._tell('lost', still_no_connection(self._name))
        elif self._lost_s is None:
            self._said.pop('lost', None)
        if lost_for_s > _STALE_AFTER_S and self._frame:
            self._scene.tell(no_connection(self._name, lost_for_s), self._frame)
        elif self._lost_s is None:
            self._losses.clear()
            if self._offer is not None and self._offer.mode == Mode.PLAYBACK.value:
                self._scene.tell(_PLAYED, self._frame)  # again and again: RViz may start later
        if self._connection.clock.is_known:
            sentence = clocks_apart(self._connection.clock.ahead_s)
            if sentence and 'clock' not in self._said:
                self._tell('clock', sentence)

    def _tell(self, key: str, sentence: str) -> None:
        if sentence and self._said.get(key) != sentence:
            self._said[key] = sentence
            self._say(sentence)

    def _changed_wants(self) -> None:
        """Tell the relay what has subscribers here; called in several threads, in turn."""
        with self._wants_lock:
            wanted = tuple(sorted(self._scene.wanted()))
            if wanted != self._wanted:
                self._scene.withdraw(set(self._wanted).difference(wanted))
                self._wanted = wanted
                self._connection.want(wanted)


def _own_version() -> str:
    return str(rospkg.RosPack().get_manifest(PACKAGE).version)


def _printable(text: str) -> str:
    return ''.join(it if it.isprintable() else '?' for it in text)[:300]
