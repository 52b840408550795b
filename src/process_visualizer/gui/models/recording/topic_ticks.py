# SPDX-License-Identifier: BSD-3-Clause
"""Ticks of the recorded topics: preset by the configuration, changed by the operator."""
from __future__ import annotations

from enum import Enum
from typing import Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

from process_visualizer.cell.model import Device
from process_visualizer.gui.ros.snapshots import TopicSnapshot
from process_visualizer.health.topic_watch import TopicWatch


class TopicHealth(Enum):
    """The health of a topic; the recorder reports only on those that it watches."""

    UNKNOWN = 'unknown'
    GOOD = 'good'
    NO_PUBLISHER = 'no publisher'
    NO_MESSAGE = 'no message yet'
    SILENT = 'silent'


class TopicRow(NamedTuple):
    """A topic as the operator sees it; rate in Hz and silence in s are None where not known."""

    name: str
    device: str
    is_ticked: bool
    health: TopicHealth
    rate_hz: Optional[float] = None
    silence_s: Optional[float] = None
    dropped: int = 0
    lost: int = 0
    is_latched: bool = False


class TopicTicks:
    """The topics of the chosen devices; what the operator ticked stays when the devices change."""

    def __init__(self) -> None:
        self._topics: Dict[str, Tuple[str, bool]] = {}  # device, preset
        self._changed: Dict[str, bool] = {}
        self._seen: Dict[str, TopicSnapshot] = {}
        self._watch = TopicWatch()
        self._stale: Set[str] = set()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Take the chosen devices; a topic of two devices is listed with the first."""
        self._topics = {}
        for device in devices:
            for topic in device.topics:
                owner, record = self._topics.get(topic.name, (device.name, False))
                self._topics[topic.name] = (owner, record or topic.record)

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Record a topic, or do not."""
        self._changed[topic] = is_ticked

    def preset(self) -> None:
        """Tick what the configuration says."""
        self._changed.clear()

    def take(self, topics: Sequence[TopicSnapshot]) -> None:
        """Note what the recorder says of the topics that it watches."""
        if not topics:
            self._watch = TopicWatch()  # of another run
        self._seen = {topic.name: topic for topic in topics}
        self._stale = {it.name for it in topics if self._watch.update(
            it.name, it.rate_hz, it.silence_s, it.messages).is_stale}

    def ticked(self) -> Tuple[str, ...]:
        """The names of the topics to record."""
        return tuple(name for name in self._topics if self._is_ticked(name))

    def rows(self) -> List[TopicRow]:
        """All topics, in the order of the devices."""
        return [self._row(name) for name in self._topics]

    def _is_ticked(self, name: str) -> bool:
        return self._changed.get(name, self._topics[name][1])

    def _row(self, name: str) -> TopicRow:
        device, _ = self._topics[name]
        seen = self._seen.get(name)
        if seen is None:
            return TopicRow(name, device, self._is_ticked(name), TopicHealth.UNKNOWN)
        return TopicRow(name, device, self._is_ticked(name), self._health(seen), seen.rate_hz,
                        seen.silence_s, seen.dropped, seen.lost, seen.is_latched)

    def _health(self, topic: TopicSnapshot) -> TopicHealth:
        if topic.publishers == 0:
            return TopicHealth.NO_PUBLISHER
        if topic.silence_s is None:
            return TopicHealth.NO_MESSAGE
        return TopicHealth.SILENT if topic.name in self._stale else TopicHealth.GOOD
