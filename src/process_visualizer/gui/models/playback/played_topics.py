# SPDX-License-Identifier: BSD-3-Clause
"""Played topics of a recording: those of the devices, less those that are not ticked."""
from __future__ import annotations

from typing import FrozenSet, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Device


class PlayedTopics(QObject):
    """All are ticked when a recording is opened."""

    changed = pyqtSignal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._of_devices: FrozenSet[str] = frozenset()
        self._unticked: Set[str] = set()
        self._paths: Tuple[str, ...] = ()

    @property
    def left_out(self) -> Tuple[str, ...]:
        """The topics of the devices that are not to be played, by name."""
        return tuple(sorted(self._unticked & self._of_devices))

    def is_offered(self, topic: str) -> bool:
        """Return whether it is one of the devices', the only ones that are ever played."""
        return topic in self._of_devices

    def is_ticked(self, topic: str) -> bool:
        """Return whether it is to be played."""
        return topic in self._of_devices - self._unticked

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Play a topic, or do not."""
        if is_ticked != self.is_ticked(topic):
            (self._unticked.discard if is_ticked else self._unticked.add)(topic)
            self.changed.emit()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Take the devices whose topics are played."""
        topics = frozenset(topic.name for device in devices for topic in device.topics
                           if topic.record)
        if topics != self._of_devices:
            self._of_devices = topics
            self.changed.emit()

    def set_recording(self, paths: Tuple[str, ...]) -> None:
        """Take the files of the recording; of another one, all topics are ticked."""
        if paths != self._paths:
            self._paths = paths
            self._unticked.clear()
            self.changed.emit()
