# SPDX-License-Identifier: BSD-3-Clause
"""The names of a draft's devices and frames, so that none collides with another."""
from __future__ import annotations

from typing import Dict, Iterable, Set

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.cell.outputs import outputs
from process_visualizer.discovery.names import device_name, free_name

_ENDINGS: Dict[str, str] = {'robot': 'robot', 'depth_sensor': 'sensor', 'other': 'device'}
_NOWHERE = Location('', 0)


class CellNames:
    """Gives names, each once."""

    def __init__(self, topics: Iterable[str], frames: Iterable[str]) -> None:
        """Take the topics and descriptions of all drivers, and the frames of all models."""
        self._topics = set(topics)
        self._frames: Set[str] = set(frames)
        self._devices: Set[str] = set()

    def device(self, kind: str, wanted: str) -> str:
        """Return a device's name like a wanted one; none of its outputs is a seen topic."""
        name = device_name(wanted, kind)
        taken = set(self._devices)
        while True:
            found = free_name(name, taken, _ENDINGS[kind])
            if not _outputs(found) & self._topics:
                self._devices.add(found)
                return found
            taken.add(found)

    def frame(self, wanted: str) -> str:
        """Return a frame's name, the wanted one if nobody has it."""
        found = free_name(wanted, self._frames)
        self._frames.add(found)
        return found

    def is_free(self, frame: str) -> bool:
        """Return whether nobody has this frame."""
        return frame not in self._frames


def _outputs(name: str) -> Set[str]:
    """Return what the program would publish for a device of that name, of whatever type."""
    return {topic for kind in DeviceType for topic in outputs([Device(kind, name, _NOWHERE)])} \
        | {f'/{name}/marker_array', f'/{name}/robot_description'}
