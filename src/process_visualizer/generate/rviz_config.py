# SPDX-License-Identifier: BSD-3-Clause
"""RVizConfig: the .rviz file for a choice of devices."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy as np
import yaml

from process_visualizer.cell.model import Device
from process_visualizer.generate.processor_nodes import WATCH_TOPIC
from process_visualizer.ros_names import GHOST_TOPIC, OWN_TOPICS, PLAYER_STATE_TOPIC
from process_visualizer.rviz.camera import camera_pose, grid_below
from process_visualizer.rviz.displays import DisplayConfig, device_displays
from process_visualizer.rviz.views import merged_view, read_view
from process_visualizer.rviz.window_geometry import Rectangle, scene_aspect, window_geometry

_STATUS_DISPLAY: DisplayConfig = {
    'Class': 'process_visualizer/DisplayStatus', 'Name': 'Status report', 'Enabled': True}
CALIBRATION_TOPIC = f'{OWN_TOPICS}calibration'
_CALIBRATION_DISPLAY: DisplayConfig = {
    'Class': 'rviz/InteractiveMarkers', 'Name': 'Calibration', 'Enabled': True,
    'Update Topic': f'{CALIBRATION_TOPIC}/update'}
_WATCH_DISPLAY: DisplayConfig = {
    'Class': 'process_visualizer/MarkerArray', 'Name': 'Stale data', 'Enabled': True,
    'Marker Topic': WATCH_TOPIC}
_GHOST_DISPLAY: DisplayConfig = {
    'Class': 'process_visualizer/MarkerArray', 'Name': 'Reference run', 'Enabled': True,
    'Marker Topic': GHOST_TOPIC}
_REPLAY_DISPLAY: DisplayConfig = {
    'Class': 'process_visualizer/ReplayBand', 'Name': 'Replay', 'Enabled': True,
    'State Topic': PLAYER_STATE_TOPIC, 'Shown At Start': False}
_GRID = 'rviz/Grid'


class RVizConfig:
    """An RViz view: a default part from a file, and a group of displays for each device."""

    def __init__(self, default_file: str, fixed_frame: str) -> None:
        """Read the default part.

        Raises:
            OSError: the file cannot be read.
            ValueError: it is not a file of RViz.
        """
        self._config = read_view(default_file)
        self._manager: Dict[str, Any] = self._config['Visualization Manager']
        self._manager.setdefault('Global Options', {})['Fixed Frame'] = fixed_frame
        self._displays: List[DisplayConfig] = list(self._manager.get('Displays') or [])
        self._saved: Optional[Mapping[str, Any]] = None
        self._window: Optional[Rectangle] = None
        self._grid: Dict[str, Any] = {}

    def add_devices(self, devices: Sequence[Device]) -> None:
        """Add a group with the displays of each device that has any.

        A device with its own grid (a floor at another height) replaces the default grid. Clouds
        that are joined are switched off, because the joined cloud shows the same.
        """
        joined = {f'/{name}/points' for device in devices if device.fusion is not None
                  for name in device.fusion.sensors}
        for device in devices:
            displays = device_displays(device)
            for display in displays:
                display['Enabled'] = display.get('Topic') not in joined
            if any(display['Class'] == _GRID for display in displays):
                self._displays = [it for it in self._displays if it.get('Class') != _GRID]
            if displays:
                self._displays.append({
                    'Class': 'rviz/Group', 'Name': f'{device.name} ({device.type.value})',
                    'Enabled': True, 'Displays': displays})

    def add_ghost(self) -> None:
        """Add the robots of the reference run."""
        self._displays.append(_GHOST_DISPLAY)

    def add_replay_band(self) -> None:
        """Add the band that distinguishes a replay from the running cell."""
        self._displays.append(_REPLAY_DISPLAY)

    @property
    def current_view(self) -> Dict[str, Any]:
        """The camera, as RViz stores it."""
        view: Dict[str, Any] = self._manager.setdefault('Views', {}).setdefault('Current', {})
        return view

    def look_at(self, points: np.ndarray) -> None:
        """Adapt camera and default grid to all points (n, 3) [m] in the global frame.

        The camera keeps its angles. Call `place` first.
        """
        window = self._config.get('Window Geometry', {})
        size = self._window or Rectangle(0, 0, window.get('Width', 1), window.get('Height', 1))
        self.current_view.update(
            camera_pose(points, self.current_view, scene_aspect(size.width, size.height)))
        self._grid = grid_below(points)

    def displays_text(self) -> str:
        """Return displays and fixed frame, without camera and grid, as a text for comparison."""
        shown = [self._manager['Global Options'].get('Fixed Frame'), self._displays]
        return yaml.safe_dump(shown, sort_keys=True)

    def adopt(self, saved: Mapping[str, Any]) -> None:
        """Apply the operator's settings from a saved view (see ``merged_view``)."""
        self._saved = saved

    def place(self, window: Rectangle) -> None:
        """Place RViz's window on the screen."""
        self._window = window

    def text(self) -> str:
        """Return the content of the file."""
        displays = [{**display, **self._grid} if display.get('Class') == _GRID else display
                    for display in self._displays]
        self._manager['Displays'] = [*displays, _WATCH_DISPLAY, _CALIBRATION_DISPLAY,
                                     _STATUS_DISPLAY]
        saved = self._saved
        config = self._config if saved is None else merged_view(self._config, saved)
        if self._window is not None:
            config['Window Geometry'] = window_geometry(
                self._window, None if saved is None else saved.get('Window Geometry'))
        return yaml.safe_dump(config, sort_keys=False, width=100)
