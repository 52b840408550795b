# SPDX-License-Identifier: BSD-3-Clause
"""Observation of a running system, from its parameters and a short time of all topics."""
from __future__ import annotations

import threading
import time
from collections import defaultdict
from dataclasses import replace
from typing import Any, Dict, Iterable, List, Optional, Set, Tuple

import rosgraph
import rospy

from process_visualizer.bagio.json_text import parsed_json
from process_visualizer.bagio.message_definition import (
    Connection,
    definition_problem,
    with_definition,
)
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.stored_configuration import StoredConfiguration, stored_configuration
from process_visualizer.cell.trust import Origin
from process_visualizer.discovery.bag_look import (
    is_description,
    seen_descriptions,
    seen_topics,
    seen_transforms,
)
from process_visualizer.discovery.new_configuration import (
    NewConfiguration,
    new_configuration,
    of_stored,
)
from process_visualizer.discovery.seen import Seen, SeenDescription, SeenTopic, Source
from process_visualizer.discovery.topic_groups import device_topics
from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, MasterClient, is_registered
from process_visualizer.ros_names import BAG_RECORDER, STATIC_TF_TOPIC, TF_TOPIC

LOOK_S = 3.0
"""Time of listening to the topics [s]."""
_MAX_MESSAGES, _LARGE_BYTES = 100, 100_000
_FRAME_TOPICS = (TF_TOPIC, STATIC_TF_TOPIC)
_DESCRIPTION = 'robot_description'
_RECORDER = f'/{BAG_RECORDER}'
_CONFIGURATION = f'{_RECORDER}/configuration'


def from_system() -> NewConfiguration:
    """Return a configuration for the running system; this process must be a node.

    The configuration of a running cell is returned if there is one.

    Raises:
        ValueError: nothing is running that belongs in a configuration, or the master does not
            answer.
    """
    try:
        master = MasterClient(rospy.get_name(), timeout_s=PATIENT_TIMEOUT_S)
        seen, stored = look_at_system(master), running_configuration(master)
        return new_configuration(seen) if stored is None else _of_stored(stored, seen)
    except (rosgraph.MasterException, OSError) as error:
        raise ValueError(f'the ROS master is not responding: {error}') from error


def _of_stored(stored: StoredConfiguration, seen: Seen) -> NewConfiguration:
    """Return the running cell's configuration; if it is unusable, one made from the topics."""
    try:
        return of_stored(stored, seen, f'the cell running at {rosgraph.get_master_uri()}',
                         Origin.NETWORK)
    except (ConfigurationError, ValueError, OSError) as error:
        remark = f'The configuration of the running cell is not used: {error}'
        return new_configuration(replace(seen, remarks=(remark, *seen.remarks)))


def running_configuration(master: MasterClient) -> Optional[StoredConfiguration]:
    """Return the configuration of the running cell, from its recorder, or None.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    if not master.hasParam(_CONFIGURATION) or not is_registered(_RECORDER):
        return None  # the master keeps the parameter after the cell has ended
    try:
        return stored_configuration(parsed_json(master.getParam(_CONFIGURATION)))
    except (TypeError, AttributeError, ValueError):
        return None


def look_at_system(master: MasterClient, look_s: float = LOOK_S) -> Seen:
    """Return the observations of the running system; this process must be a node.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    known = _published(master)
    wanted = {it.name for it in device_topics(known)} | {
        it.name for it in known if it.name in _FRAME_TOPICS}
    listener = _Listener(wanted)
    sources = listener.listen(look_s)
    heard = seen_topics(sources)
    names = {topic.name for topic in heard}
    silent = [it for it in known if it.name in wanted - names - set(_FRAME_TOPICS)]
    descriptions = {it.namespace: it for it in (*seen_descriptions(sources),
                                                *_descriptions(master))}
    return Seen(f'what is running at {master.master_uri}', (*heard, *silent),
                seen_transforms(sources), tuple(descriptions.values()),
                (*_remarks(silent), *(f'{it}.' for it in listener.problems)),
                is_moment=True)


def _published(master: MasterClient) -> List[SeenTopic]:
    types = dict(master.getTopicTypes())
    publishers = master.getSystemState()[0]
    return [SeenTopic(name, types.get(name, ''), tuple(nodes)) for name, nodes in publishers
            if types.get(name, '*') != '*']


def _descriptions(master: MasterClient) -> Iterable[SeenDescription]:
    for name in sorted(master.getParamNames()):
        if name.rpartition('/')[2] == _DESCRIPTION:
            text = master.getParam(name)
            if is_description(text):
                yield SeenDescription(name.rpartition('/')[0], text)


def _remarks(silent: Iterable[SeenTopic]) -> Tuple[str, ...]:
    names = [it.name for it in silent]
    if not names:
        return ()
    return (f'Nothing was received within {LOOK_S:g} s on {", ".join(names)}: whether they hold '
            'variables '
            'is unknown.',)


class _Listener:
    """Subscribes to topics of any type and keeps some messages of each publisher.

    ``problems`` are messages about topics whose definitions cannot be parsed.
    """

    def __init__(self, topics: Set[str]) -> None:
        self._topics = topics
        self._changed = threading.Condition()
        self._messages: Dict[Tuple[str, str], List[bytes]] = defaultdict(list)
        self._headers: Dict[Tuple[str, str], Dict[str, str]] = {}
        self._enough: Set[str] = set()
        self.problems: Tuple[str, ...] = ()

    def listen(self, look_s: float) -> List[Source]:
        subscribers = {topic: rospy.Subscriber(topic, rospy.AnyMsg, self._take, topic)
                       for topic in sorted(self._topics)}
        try:
            self._wait(look_s, subscribers)
        finally:
            for subscriber in subscribers.values():
                subscriber.unregister()
        with self._changed:
            found = [(_connection(topic, self._headers[topic, node]), tuple(messages))
                     for (topic, node), messages in self._messages.items()]
        self.problems = tuple(filter(None, (definition_problem(its) for its, _ in found)))
        return [Source(its.topic, its.type, its.message_definition, its.caller_id, messages)
                for its, messages in found]

    def _wait(self, look_s: float, subscribers: Dict[str, rospy.Subscriber]) -> None:
        """Wait; unsubscribe after the first message of a topic with large messages."""
        end_s = time.monotonic() + look_s
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._enough, max(0.0, end_s - time.monotonic()))
                enough, self._enough = self._enough, set()
            if not enough:
                return
            for topic in enough & set(subscribers):
                subscribers.pop(topic).unregister()

    def _take(self, message: Any, topic: str) -> None:
        header = message._connection_header
        node = header.get('callerid', '')
        with self._changed:
            messages = self._messages[topic, node]
            self._headers[topic, node] = header
            if len(messages) < _MAX_MESSAGES:
                messages.append(bytes(message._buff))
            if len(message._buff) > _LARGE_BYTES:
                self._enough.add(topic)
                self._changed.notify()


def _connection(topic: str, header: Dict[str, str]) -> Connection:
    """Return the connection described by a publisher's header, which may lack the definition."""
    return with_definition(Connection(
        topic, header.get('type', ''), header.get('md5sum', ''),
        header.get('message_definition', ''), False, header.get('callerid', '')))
