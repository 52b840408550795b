# SPDX-License-Identifier: BSD-3-Clause
"""Live data and recordings at once, which would be shown as one: who does that."""
from __future__ import annotations

from typing import Collection, List, Tuple

import rosgraph

from process_visualizer.cell.model import Device, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.launch_file import recorded_topics
from process_visualizer.health.other_publishers import (
    SHARED_TOPICS,
    Others,
    described,
    other_publishers,
    publishing_players,
)


class MixedSources(Exception):
    """What is to be launched would be mixed with what others publish; says who, and what to do."""


def others_before(choice: Choice) -> Others:
    """Return who would be mixed with a choice that is about to be launched.

    That is whoever publishes the devices' topics before a recording is played on them; in
    real-time mode only players, as drivers may be started by anybody. Without a master nobody.
    """
    topics = _topics(choice.devices)
    try:
        if choice.mode is Mode.REALTIME:
            return publishing_players(topics)
        played = recorded_topics(choice.devices)
        return other_publishers(played) if choice.bag is not None else ()
    except (rosgraph.MasterException, OSError):
        return ()


def others_beside(choice: Choice, own: Collection[str]) -> Others:
    """Return who is mixed with a choice that runs with nodes of its own.

    In playback the player itself looks at its topics, but for those that several nodes share:
    it does not know which of them belong to the cell.

    Raises:
        rosgraph.MasterException, OSError: the master does not answer.
    """
    if choice.mode is Mode.REALTIME:
        return publishing_players(_topics(choice.devices))
    shared = [topic for topic in recorded_topics(choice.devices) if topic in SHARED_TOPICS]
    return other_publishers(shared, own) if shared else ()


def refuse_mixture(choice: Choice) -> None:
    """Raise MixedSources if a choice would be mixed with what others publish."""
    others = others_before(choice)
    if others:
        raise MixedSources(explanation(choice.mode, others))


def mixture_text(mode: Mode, others: Others) -> str:
    """Return who publishes, and what would be seen, as a sentence without its full stop."""
    who = '; '.join(described(others))
    if mode is Mode.REALTIME:
        return f'{who}, which plays a recording: it would be shown as if it happened now'
    return f'{who}: live data and the recording would be shown as one'


def explanation(mode: Mode, others: Others) -> str:
    """Return who publishes, and what to do about it, for a terminal."""
    advice = 'Stop that player first' if mode is Mode.REALTIME else (
        'Stop what publishes it first, or play the recording under other names, with '
        '"bag_player FILE --prefix /recorded"')
    return f'{mixture_text(mode, others)}. {advice}'


def _topics(devices: Tuple[Device, ...]) -> List[str]:
    return list(dict.fromkeys(topic.name for device in devices for topic in device.topics))
