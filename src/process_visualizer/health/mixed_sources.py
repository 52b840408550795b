# SPDX-License-Identifier: BSD-3-Clause
"""Detection of nodes that would mix live data and recordings in one display."""
from __future__ import annotations

from typing import Collection, List, Tuple

import rosgraph

from process_visualizer.cell.model import Device, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.launch_file import played_topics
from process_visualizer.health.other_publishers import (
    SHARED_TOPICS,
    Others,
    described,
    other_publishers,
    publishing_players,
)


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

    In playback mode the player itself watches its topics, except those that several nodes share:
    the player does not know which of these nodes belong to the cell.

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
