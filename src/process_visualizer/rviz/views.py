# SPDX-License-Identifier: BSD-3-Clause
"""Views of RViz: those that operators save, merged with the generated one, or for onlookers."""
from __future__ import annotations

import copy
import hashlib
import os
from collections import defaultdict, deque
from pathlib import Path
from typing import Any, DefaultDict, Deque, Dict, Iterable, List, Mapping, Optional, Tuple
from urllib.parse import quote, unquote

import numpy as np
import rospkg
import yaml

from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.cell.errors import Problem
from process_visualizer.cell.model import Cell
from process_visualizer.cell.values import plain_yaml
from process_visualizer.rviz.camera import seen_points
from process_visualizer.rviz.window_geometry import scene_aspect
from process_visualizer.whole_file import small_file, write_small_file

_MAX_VIEW_BYTES = 1 << 20
"""Maximum size, as YAML is read slowly; RViz writes about 20 kB."""


def read_view(path: str) -> Dict[str, Any]:
    """Return the content of an RViz file.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is not an RViz file.
    """
    try:
        content = plain_yaml(small_file(path, _MAX_VIEW_BYTES).decode())
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f'{path}: not YAML: {" ".join(str(error).split())}') from None
    if not isinstance(content, dict) or not isinstance(content.get('Visualization Manager'), dict):
        raise ValueError(f'{path}: not an RViz configuration: it has no "Visualization Manager"')
    return content


_ENDING = '.rviz'
_CHOSEN_FILE = 'chosen.txt'


class SavedViewError(Exception):
    """A view cannot be saved or read; the text says which and why."""


class SavedViews:
    """The views for some devices of a configuration, as copies of RViz's own files.

    The files are in ``~/.ros/process_visualizer/views``, in a folder for each set of devices.
    """

    def __init__(self, configuration: str, devices: Iterable[str]) -> None:
        """Set the path of the configuration file and the names of the chosen devices."""
        path = os.path.abspath(configuration)
        key = hashlib.sha256('\0'.join([path, *sorted(devices)]).encode('utf-8', 'surrogateescape'))
        self.folder = (Path(rospkg.get_ros_home()) / 'process_visualizer' / 'views'
                       / f'{Path(path).stem}-{key.hexdigest()[:16]}')

    def names(self) -> List[str]:
        """Return the names of all views, in alphabetical order."""
        return sorted(unquote(path.stem) for path in self.folder.glob(f'*{_ENDING}'))

    def save(self, name: str, rviz_file: str) -> None:
        """Save a copy of a file written by RViz, and choose it; replaces a view of that name.

        Raises:
            SavedViewError: the view cannot be written, or the file is not an RViz file.
        """
        if not name.strip():
            raise SavedViewError('a view needs a name')
        try:
            read_view(rviz_file)
            self.folder.mkdir(parents=True, exist_ok=True)
            write_small_file(str(self._path(name)), Path(rviz_file).read_bytes())
        except (OSError, ValueError) as error:
            raise SavedViewError(f'the view "{name}" cannot be saved: {_reason(error)}') from None
        self.choose(name)

    def load(self, name: str) -> Dict[str, Any]:
        """Return the content of a view's file.

        Raises:
            SavedViewError: the view cannot be read.
        """
        try:
            return read_view(str(self._path(name)))
        except (OSError, ValueError) as error:
            raise SavedViewError(f'the view "{name}" cannot be read: {_reason(error)}; the '
                                 'generated view is used') from None

    def remove(self, name: str) -> None:
        """Delete a view.

        Raises:
            SavedViewError: the view cannot be removed.
        """
        try:
            self._path(name).unlink()
        except OSError as error:
            raise SavedViewError(f'the view "{name}" cannot be removed: {_reason(error)}') from None
        if self.chosen() is None:
            self.choose(None)

    def choose(self, name: Optional[str]) -> None:
        """Choose the view for the next launch; None is the generated one.

        Raises:
            SavedViewError: the choice cannot be written.
        """
        try:
            if name is None:
                (self.folder / _CHOSEN_FILE).unlink(missing_ok=True)
            else:
                write_small_file(str(self.folder / _CHOSEN_FILE),
                                 name.encode('utf-8', 'surrogatepass'))
        except OSError as error:
            raise SavedViewError('the choice of a view cannot be saved: '
                                 f'{_reason(error)}') from None

    def chosen(self) -> Optional[str]:
        """Return the name of the chosen view; None if none is chosen, or it no longer exists."""
        try:
            name = small_file(str(self.folder / _CHOSEN_FILE)).decode('utf-8', 'surrogatepass')
        except (OSError, UnicodeDecodeError):
            return None
        return name if self._path(name).is_file() else None

    def _path(self, name: str) -> Path:
        """Return the file of a view; dots and characters not allowed in file names are encoded."""
        return self.folder / (quote(name, safe=' ', errors='surrogatepass').replace('.', '%2E')
                              + _ENDING)


def _reason(error: Exception) -> str:
    return getattr(error, 'strerror', None) or str(error)


ViewConfig = Dict[str, Any]
_MANAGER = 'Visualization Manager'
_MAX_NUMBER = 1e9
_GENERATED_KEYS = ('Class', 'Name', 'Displays')


def merged_view(generated: Mapping[str, Any], saved: Mapping[str, Any]) -> ViewConfig:
    """Return the saved view with the displays, topics and global frame of the generated one.

    The operator's settings in RViz are kept: camera, colors, disabled displays, added displays,
    panels. The configuration determines the displays of its devices and their topics. Both views
    are contents of ``.rviz`` files.
    """
    result: ViewConfig = copy.deepcopy({**generated, **saved})
    generated_manager, saved_manager = (
        _mapping(generated, _MANAGER), _mapping(saved, _MANAGER))
    result[_MANAGER] = copy.deepcopy({
        **generated_manager, **saved_manager,
        'Displays': _merged_displays(_mappings(generated_manager, 'Displays'),
                                     _mappings(saved_manager, 'Displays')),
        'Global Options': {
            **_mapping(generated_manager, 'Global Options'),
            **_mapping(saved_manager, 'Global Options'),
            'Fixed Frame': _mapping(generated_manager, 'Global Options').get('Fixed Frame')}})
    result['Preferences'] = {**_mapping(saved, 'Preferences'), **_mapping(generated, 'Preferences')}
    return result


def _merged_displays(generated: List[ViewConfig], saved: List[ViewConfig]) -> List[ViewConfig]:
    """Return the generated displays with the settings of the saved ones, then the other saved ones.

    Several displays may have the same type and name: the operator can add such displays.
    """
    rest = dict(enumerate(saved))
    numbers: DefaultDict[Tuple[str, str], Deque[int]] = defaultdict(deque)
    for number, display in rest.items():
        numbers[_identity(display)].append(number)
    merged = []
    for display in generated:
        alike = numbers[_identity(display)]
        merged.append(_merged_display(display, rest.pop(alike.popleft()) if alike else {}))
    return merged + list(rest.values())


def _merged_display(generated: ViewConfig, saved: ViewConfig) -> ViewConfig:
    result = {**generated, **saved}
    for key in (*_GENERATED_KEYS, _topic_key(generated)):
        if key in generated:
            result[key] = generated[key]
    if 'Displays' in generated:
        result['Displays'] = _merged_displays(_mappings(generated, 'Displays'),
                                              _mappings(saved, 'Displays'))
    return result


def _identity(display: ViewConfig) -> Tuple[str, str]:
    return _type(display), str(display.get('Name'))


def _type(display: ViewConfig) -> str:
    """Return the type without its library: older saved views use RViz's display for our markers."""
    return str(display.get('Class')).split('/')[-1]


def _topic_key(display: ViewConfig) -> str:
    display_type = DISPLAY_TYPES.get(_type(display))
    return (display_type.topic_key or '') if display_type else ''


def _mapping(config: Mapping[str, Any], key: str) -> Dict[str, Any]:
    """Return the mapping below a key; empty if a hand-edited file has another value there."""
    value = config.get(key)
    return value if isinstance(value, dict) else {}


def _number(config: Mapping[str, Any], key: str, default: float) -> float:
    """Return the number below a key; the default if a hand-edited file has another value there."""
    try:
        number = float(config.get(key, default))
    except (TypeError, ValueError, OverflowError):
        return default
    return number if abs(number) <= _MAX_NUMBER else default  # also if it is not a number


def _mappings(config: Mapping[str, Any], key: str) -> List[Dict[str, Any]]:
    """Return the mappings in the list below a key, without anything else that is written there."""
    value = config.get(key)
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


_ORBITS = ('rviz/Orbit', 'rviz/XYOrbit')


def view_warnings(cell: Cell, name: str, content: Mapping[str, Any],
                  extent: Mapping[str, np.ndarray]) -> List[Problem]:
    """Return warnings about devices that are not visible in a saved view.

    ``content`` is the content of the view's file; ``extent`` has points (n, 3) around each device.
    Only orbiting cameras in the global frame are checked: the view of other cameras is unknown
    before RViz runs.
    """
    view = _orbit(cell, content)
    if view is None:
        return []
    window = _mapping(content, 'Window Geometry')
    aspect = scene_aspect(_number(window, 'Width', 1), _number(window, 'Height', 1))
    return [Problem(device.location, 'device',
                    f'"{device.name}" is not visible in the chosen view "{name}"; '
                    'move the camera in RViz and save it again, or choose the generated view')
            for device in cell.devices
            if len(extent.get(device.name, ()))
            and not seen_points(extent[device.name], view, aspect).any()]


def _orbit(cell: Cell, content: Mapping[str, Any]) -> Optional[Mapping[str, Any]]:
    """Return the camera if it orbits a point of the global frame, else None."""
    view = _mapping(_mapping(_mapping(content, _MANAGER), 'Views'), 'Current')
    if view.get('Class') not in _ORBITS \
            or view.get('Target Frame') not in ('<Fixed Frame>', cell.frame):
        return None
    focus = _mapping(view, 'Focal Point')
    return {**{key: _number(view, key, 0.0) for key in ('Pitch', 'Yaw', 'Distance')},
            'Focal Point': {axis: _number(focus, axis, 0.0) for axis in 'XYZ'}}


_CHANGING_DISPLAYS = ('process_visualizer/DisplayStatus', 'process_visualizer/ReplayBand',
                      'rviz/InteractiveMarkers')
"""Displays that publish, or that the launcher of the cell controls."""
_CHANGING_TOOLS = ('rviz/Interact', 'rviz/SetInitialPose', 'rviz/SetGoal', 'rviz/PublishPoint')


def onlooker_view(config: Dict[str, Any]) -> Dict[str, Any]:
    """Return the content of an .rviz file without displays and tools that publish anything."""
    manager = dict(_mapping(config, _MANAGER))
    manager['Displays'] = _without(manager, 'Displays', _CHANGING_DISPLAYS)
    manager['Tools'] = _without(manager, 'Tools', _CHANGING_TOOLS)
    return {**config, _MANAGER: manager}


def _without(config: ViewConfig, key: str, classes: Tuple[str, ...]) -> List[ViewConfig]:
    """Return the items in the list below a key that have other classes, also within groups."""
    return [{**it, 'Displays': _without(it, 'Displays', classes)} if it.get('Displays') else it
            for it in _mappings(config, key) if it.get('Class') not in classes]
