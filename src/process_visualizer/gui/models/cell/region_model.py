# SPDX-License-Identifier: BSD-3-Clause
"""The boxes that clouds are cropped to: moved while everything runs, saved into the file."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject

from process_visualizer.cell.model import Device, RegionOfInterest
from process_visualizer.gui.models.cell.edited_values import EditedValues
from process_visualizer.gui.toolkit.tasks import Tasks

Apply = Callable[[str, RegionOfInterest], Any]
"""Gives a device (its name) a box in the running nodes; blocks until it is done."""


class RegionModel(EditedValues[RegionOfInterest]):
    """The boxes of the depth sensors that have one; numbers are centre and edge lengths [m]."""

    _what = _moves_what = 'box'

    def __init__(self, tasks: Tasks, move: Apply, parent: Optional[QObject] = None) -> None:
        super().__init__(tasks, 'region', move, parent)

    @property
    def region(self) -> Optional[RegionOfInterest]:
        """The present box of the chosen device."""
        return self.value_of(self._device)

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Set the devices of the configuration; unsaved edits are kept."""
        self._set_in_file({it.name: it.roi for it in devices
                           if it.roi is not None and it.has_cloud})

    def take_dragged(self, device: str, region: RegionOfInterest) -> None:
        """Accept the box as it was dragged in RViz, where it is not moved again."""
        if device == self._device:
            self._take_dragged(region)

    def _numbers(self, value: RegionOfInterest) -> Tuple[float, ...]:
        return (*value.center, *value.size)

    def _with_numbers(self, value: RegionOfInterest,
                      numbers: Sequence[float]) -> RegionOfInterest:
        x, y, z, length, width, height = numbers
        return replace(value, center=(x, y, z), size=(length, width, height))
