# SPDX-License-Identifier: BSD-3-Clause
"""The operator's choice: devices, mode, and how RViz is started."""
from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Iterable, List, Mapping, Optional, Tuple

from process_visualizer.cell.errors import advice
from process_visualizer.cell.model import Cell, Device, LaunchFile, Mode, Node
from process_visualizer.rviz.window_geometry import Rectangle


class RvizStart(Enum):
    """The start of RViz: none, optional, or required for the run."""

    NONE = 'none'
    OPTIONAL = 'optional'
    REQUIRED = 'required'


@dataclass(frozen=True)
class Viewers:
    """Permitted viewers of ``cell view``: those on other computers only if ``is_remote``.

    The relay listens on the first free one of the ``ports`` (FIRST-LAST); empty: the default ports.
    """

    is_remote: bool = False
    ports: str = ''

    def options(self) -> List[str]:
        """Return the equivalent command-line options."""
        return ['--remote'] * self.is_remote + (['--ports', self.ports] if self.ports else [])


@dataclass(frozen=True)
class Choice:
    """Devices of a cell and how to run them; ``bag`` is an absolute path (playback only).

    ``further_bags`` are the other files of a split recording, ``left_out`` its topics that are not
    played. ``is_replay``: the bag holds the last seconds of a cell that runs elsewhere.
    ``viewers`` are the permitted viewers of the cell.
    ``window`` is the position and size of RViz on the screen, ``view`` the content of an RViz file
    that the operator has saved (see ``SavedViews``). If given, ``bag_folder`` is a folder into
    which the recorder may record, in addition to those always allowed.
    """

    cell: Cell
    mode: Mode
    devices: Tuple[Device, ...]
    rviz: RvizStart = RvizStart.REQUIRED
    bag: Optional[str] = None
    window: Optional[Rectangle] = None
    view: Optional[Mapping[str, Any]] = None
    further_bags: Tuple[str, ...] = ()
    left_out: Tuple[str, ...] = ()
    is_replay: bool = False
    viewers: Viewers = Viewers()
    bag_folder: str = ''

    def with_device(self, device: Device) -> Choice:
        """Return the choice with another version of a device."""
        def others(devices: Tuple[Device, ...]) -> Tuple[Device, ...]:
            return tuple(device if it.name == device.name else it for it in devices)

        return replace(self, cell=replace(self.cell, devices=others(self.cell.devices)),
                       devices=others(self.devices))

    def in_mode(self, device: Device) -> Device:
        """Return a device with only those nodes and launch files that run in this mode."""
        return replace(device, nodes=self.nodes(device), launch_files=self.launch_files(device))

    def nodes(self, device: Device) -> Tuple[Node, ...]:
        """Return the device's own nodes that run in this mode."""
        return tuple(node for node in device.nodes if node.mode in (None, self.mode))

    def launch_files(self, device: Device) -> Tuple[LaunchFile, ...]:
        """Return the device's launch files that are included in this mode."""
        return tuple(file for file in device.launch_files if file.mode in (None, self.mode))


def choose_devices(cell: Cell, names: Optional[Iterable[str]] = None) -> Tuple[Device, ...]:
    """Return the named devices in the order of the configuration; None: all devices.

    Raises:
        ValueError: a name is unknown, or the list of names is empty.
    """
    if names is None:
        return cell.devices
    wanted = list(names)
    known = [device.name for device in cell.devices]
    for name in wanted:
        if name not in known:
            raise ValueError(f'there is no device "{name}"; {advice(name, known)}')
    if not wanted:
        raise ValueError('no device is chosen; expected one of: ' + ', '.join(known))
    return tuple(device for device in cell.devices if device.name in wanted)
