# SPDX-License-Identifier: BSD-3-Clause
"""The differences between two versions of a configuration."""
from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Mapping, Tuple

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell


@dataclass(frozen=True)
class Changes:
    """Names of devices in the order of the configuration (``removed``: of the old one).

    ``cell_changed`` is true if the global frame or the machines, which belong to no device, differ.
    """

    added: Tuple[str, ...]
    removed: Tuple[str, ...]
    changed: Tuple[str, ...]
    same: Tuple[str, ...]
    cell_changed: bool

    def __bool__(self) -> bool:
        return bool(self.added or self.removed or self.changed or self.cell_changed)


def changes(old: Cell, new: Cell) -> Changes:
    """Compare the contents of two configurations, regardless of their locations in the files.

    The contents of models and launch files are not compared here, but as parts of a plan
    (``Part.digest``).
    """
    before = {device.name: device for device in old.devices}
    after = {device.name: device for device in new.devices}
    kept = [name for name in after if name in before]
    same = [name for name in kept if content(before[name]) == content(after[name])]
    return Changes(
        added=tuple(name for name in after if name not in before),
        removed=tuple(name for name in before if name not in after),
        changed=tuple(name for name in kept if name not in same), same=tuple(same),
        cell_changed=content((old.frame, old.machines)) != content((new.frame, new.machines)))


def content(value: Any) -> Any:
    """Return a piece of the model as tuples and dictionaries, without locations in files."""
    if is_dataclass(value):
        return type(value), {field.name: content(getattr(value, field.name))
                             for field in fields(value)
                             if not isinstance(getattr(value, field.name), Location)}
    if isinstance(value, tuple):
        return tuple(content(item) for item in value)
    if isinstance(value, Mapping):
        return {key: content(item) for key, item in value.items()}
    return value
