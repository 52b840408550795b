# SPDX-License-Identifier: BSD-3-Clause
"""Checks that a view that the operator has saved still shows the cell."""
from __future__ import annotations

from typing import Any, List, Mapping, Optional

import numpy as np

from process_visualizer.cell.errors import Problem
from process_visualizer.cell.model import Cell
from process_visualizer.rviz.camera import seen_points
from process_visualizer.rviz.window_geometry import scene_aspect

_ORBITS = ('rviz/Orbit', 'rviz/XYOrbit')


def view_warnings(cell: Cell, name: str, content: Mapping[str, Any],
                  extent: Mapping[str, np.ndarray]) -> List[Problem]:
    """Warnings about devices that are not visible in a saved view.

    ``content`` is that of its file, ``extent`` has points (n, 3) around each device. Only orbiting
    cameras in the global frame are checked: the view of others is unknown before RViz runs.
    """
    view = _orbit(cell, content)
    if view is None:
        return []
    window = content.get('Window Geometry') or {}
    aspect = scene_aspect(window.get('Width', 1), window.get('Height', 1))
    return [Problem(device.location, 'device',
                    f'"{device.name}" is not visible in the chosen view "{name}"; '
                    'move the camera in RViz and save it again, or choose the generated view')
            for device in cell.devices
            if len(extent.get(device.name, ()))
            and not seen_points(extent[device.name], view, aspect).any()]


def _orbit(cell: Cell, content: Mapping[str, Any]) -> Optional[Mapping[str, Any]]:
    """The camera, if it is one that orbits a point of the global frame."""
    view: Any = content
    for key in ('Visualization Manager', 'Views', 'Current'):
        view = view.get(key) if isinstance(view, Mapping) else None
    if not isinstance(view, Mapping) or view.get('Class') not in _ORBITS:
        return None
    return view if view.get('Target Frame') in ('<Fixed Frame>', cell.frame) else None
