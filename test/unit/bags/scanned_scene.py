# SPDX-License-Identifier: BSD-3-Clause
"""The expected scene at a time, found by scanning a recording from its beginning."""
from __future__ import annotations

from typing import Dict, List, Sequence

from playback_stage import (
    CONNECTIONS,
    LATCHED,
    MARKERS,
    MOMENT_MS,
    PATH,
    PICTURE,
    SOURCES,
    STATIC,
    Message,
    Stage,
    number_in,
    static_in,
)


def shown_positions(messages: Sequence[Message], count: int) -> Dict[int, int]:
    """The newest message of each source after some messages, or its topic's first if it is soon."""
    newest = {SOURCES[it.connection]: position for position, it in enumerate(messages[:count])}
    present = {CONNECTIONS[source].topic for source in newest}
    for position, it in enumerate(messages):
        topic = CONNECTIONS[it.connection].topic
        if topic not in present and it.time_ms <= messages[0].time_ms + MOMENT_MS:
            newest[SOURCES[it.connection]] = position
            present.add(topic)
    return newest


def static_positions(messages: Sequence[Message], count: int) -> Dict[str, float]:
    """The frames of all static transforms up to a number of messages, or soon after."""
    return {f'frame{position % 3}': position for position, it in enumerate(messages)
            if SOURCES[it.connection] == STATIC
            and (position < count or it.time_ms <= messages[0].time_ms + MOMENT_MS)}


def check_seen(stage: Stage, count: int) -> None:
    """Compare the viewer's scene, and later subscribers', with the scene after some messages.

    Numbers of a topic without a message so far cannot be taken back from a viewer that received
    them.
    """
    shown, viewer = shown_positions(stage.messages, count), stage.viewer
    numbers = {source: it for source, it in shown.items() if source < STATIC or source == PICTURE}
    assert {source: viewer.seen.get(source) for source in numbers} == numbers
    topics: Dict[str, int] = {}
    for source, position in sorted(numbers.items(), key=lambda it: it[1]):
        topics[CONNECTIONS[source].topic] = position
    assert {topic: viewer.newest.get(topic) for topic in topics} == topics
    assert viewer.markers[-1:] == [str(it) for it in _of(shown, MARKERS)]
    assert viewer.path == _of(shown, PATH)
    static = static_positions(stage.messages, count)
    assert {frame: viewer.static.get(frame) for frame in static} == static
    check_latched(stage, shown, static)


def check_latched(stage: Stage, shown: Dict[int, int], static: Dict[str, float]) -> None:
    """Compare a later subscriber's messages with the scene: the same ones in its order, no more."""
    latched = dict(stage.viewer.latched)
    assert static_in(latched.pop(STATIC, bytes(4))) == static
    assert [number_in(data) for data in latched.values()] == sorted(
        position for source, position in shown.items() if LATCHED <= source < STATIC)


def _of(shown: Dict[int, int], source: int) -> List[int]:
    return [shown[source]] if source in shown else []
