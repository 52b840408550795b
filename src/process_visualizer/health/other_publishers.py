# SPDX-License-Identifier: BSD-3-Clause
"""Other publishers of topics, and nodes that would mix live data and recordings."""
from __future__ import annotations

import threading
from typing import Callable, Collection, Dict, Iterable, List, NamedTuple, Set, Tuple

import rosgraph

from process_visualizer.cell.model import Device, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.launch_file import played_topics
from process_visualizer.launching.ros_api import (
    CALLER_ID,
    PATIENT_TIMEOUT_S,
    MasterClient,
    is_registered,
)
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TOPIC

SHARED_TOPICS = frozenset({TF_TOPIC, STATIC_TF_TOPIC, '/rosout', '/rosout_agg', '/clock',
                           '/diagnostics', '/diagnostics_agg', '/statistics'})
"""Topics on which several publishers are normal."""
LOOK_PERIOD_S = 0.5
"""Period of a watch [s]."""
_MAX_NAMED = 2
_PLAYER_SERVICES = ({'pause_playback'}, {'seek', 'set_loop', 'set_rate'})
"""Services in the namespace of a player: of rosbag play, of bag_player."""


class OtherPublisher(NamedTuple):
    """A node that publishes a topic."""

    topic: str
    node: str

    def __str__(self) -> str:
        return f'{self.topic} is published by {self.node}'


Others = Tuple[OtherPublisher, ...]
_SystemState = List[List[Tuple[str, List[str]]]]


def other_publishers(topics: Collection[str], own: Collection[str] = ()) -> Others:
    """Return the publishers of topics, except ``own`` nodes and nodes that do not answer.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    return _living(_publishers(_system_state(), topics, own))


def publishing_players(topics: Collection[str]) -> Others:
    """Return the players that publish some of the topics; their services identify them.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    state = _system_state()
    players = _players(state)
    return _living(it for it in _publishers(state, topics, ()) if it.node in players)


def described(others: Iterable[OtherPublisher]) -> List[str]:
    """Return a sentence for each node, with the first of its topics."""
    by_node: Dict[str, List[str]] = {}
    for it in others:
        by_node.setdefault(it.node, []).append(it.topic)
    return [_sentence(node, topics) for node, topics in by_node.items()]


class PublisherWatch:
    """Checks for other publishers periodically, in a thread, from ``begin`` to ``close``."""

    def __init__(self, look: Callable[[], Others], on_change: Callable[[Others], None]) -> None:
        """``on_change`` is called with all present publishers whenever they have changed."""
        self._look, self._on_change = look, on_change
        self._known: Others = ()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name='watch publishers', daemon=True)

    def look(self) -> None:
        """Check once, in the calling thread, before ``begin``.

        Raises:
            rosgraph.MasterException, OSError: the master does not answer.
        """
        self._take(self._look())

    def begin(self) -> None:
        """Start the periodic checks."""
        self._thread.start()

    def close(self) -> None:
        """Stop the checks; one in progress may still finish."""
        self._closed.set()

    def look_again(self) -> None:
        """Check once, as the thread does."""
        try:
            self._take(self._look())
        except (rosgraph.MasterException, OSError):
            return  # without a master no new publisher can appear; the master may return

    def _run(self) -> None:
        while not self._closed.wait(LOOK_PERIOD_S):
            self.look_again()

    def _take(self, found: Others) -> None:
        if found != self._known and not self._closed.is_set():
            self._known = found
            self._on_change(found)


def _system_state() -> _SystemState:
    state: _SystemState = MasterClient(
        CALLER_ID, timeout_s=PATIENT_TIMEOUT_S).getSystemState()
    return state


def _publishers(state: _SystemState, topics: Collection[str],
                own: Collection[str]) -> List[OtherPublisher]:
    nodes_of = dict(state[0])
    return [OtherPublisher(topic, node) for topic in topics
            for node in sorted(nodes_of.get(topic, ())) if node not in own]


def _players(state: _SystemState) -> Set[str]:
    offered: Dict[str, Set[str]] = {}
    for service, nodes in state[2]:
        for node in nodes:
            if service.startswith(f'{node}/'):
                offered.setdefault(node, set()).add(service[len(node) + 1:])
    return {node for node, names in offered.items()
            if any(services <= names for services in _PLAYER_SERVICES)}


def _living(publishers: Iterable[OtherPublisher]) -> Others:
    """Return the publishers that answer: the master still lists killed nodes."""
    found = list(publishers)
    living = {node for node in {it.node for it in found} if is_registered(node)}
    return tuple(it for it in found if it.node in living)


def _sentence(node: str, topics: List[str]) -> str:
    named, more = ', '.join(topics[:_MAX_NAMED]), len(topics) - _MAX_NAMED
    text = named + (f' and {more} more' if more > 0 else '')
    return f'{text} {"is" if len(topics) == 1 else "are"} published by {node}'


class MixedSources(Exception):
    """A launch would mix with topics of other nodes; the text names them and the remedy."""


def others_before(choice: Choice) -> Others:
    """Return the nodes whose topics would mix with a choice that is about to be launched.

    In playback mode these are all publishers of the devices' topics; in real-time mode only
    players, as drivers may be started at any time. Without a master there are none.
    """
    topics = _topics(choice.devices)
    try:
        if choice.mode is Mode.REALTIME:
            return publishing_players(topics)
        return other_publishers(played_topics(choice)) if choice.bag is not None else ()
    except (rosgraph.MasterException, OSError):
        return ()


def others_beside(choice: Choice, own: Collection[str]) -> Others:
    """Return the nodes, except the choice's ``own``, whose topics mix with a running choice.

    In playback mode the player itself watches its topics, except those that several nodes share: it
    does not know which of these nodes belong to the cell.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    if choice.mode is Mode.REALTIME:
        return publishing_players(_topics(choice.devices))
    shared = [topic for topic in played_topics(choice) if topic in SHARED_TOPICS]
    return other_publishers(shared, own) if shared else ()


def refuse_mixture(choice: Choice) -> None:
    """Raise MixedSources if a choice would mix with topics of other nodes."""
    others = others_before(choice)
    if others:
        raise MixedSources(explanation(choice.mode, others))


def mixture_text(mode: Mode, others: Others) -> str:
    """Return the publishers and the effect in the display, as a sentence without a full stop."""
    who = '; '.join(described(others))
    if mode is Mode.REALTIME:
        return f'{who}, which plays a recording: it would be shown as if it happened now'
    return f'{who}: live data and the recording would be shown as one'


def explanation(mode: Mode, others: Others) -> str:
    """Return the publishers, the effect and the remedy, for a terminal."""
    advice = 'Stop that player first' if mode is Mode.REALTIME else (
        'Stop that node first, or play the recording under other names, with '
        '"bag_player FILE --prefix /recorded"')
    return f'{mixture_text(mode, others)}. {advice}'


def _topics(devices: Tuple[Device, ...]) -> List[str]:
    return list(dict.fromkeys(topic.name for device in devices for topic in device.topics))
