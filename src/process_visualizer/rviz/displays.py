# SPDX-License-Identifier: BSD-3-Clause
"""The RViz displays of a device: those of its type, and those added by the configuration."""
from __future__ import annotations

import copy
import re
from typing import Any, Dict, List, Optional, Set, Tuple

from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.cell.model import Device, DeviceType, Display, Property
from process_visualizer.ros_names import OBJECTS_MARKERS, ROI_FILTER

DisplayConfig = Dict[str, Any]

_NUMBER = re.compile(r'-?(0|[1-9][0-9]{0,15})(\.[0-9]{1,15})?')
_OWN_DISPLAYS = ('MarkerArray', 'RobotModel')
"""Types for which our own RViz plugin has a display of the same name and the same properties."""
_SETTLED = ('Class', 'Name', 'Displays')
"""Keys set by the ``<rviz>`` element itself; properties do not change them."""
_DEFAULT_NAMES = {
    'RobotModel': 'Model',
    'MarkerArray': 'Arrows and numbers',
    'Marker': 'Marker',
    'PointCloud2': 'Points',
}


def device_displays(device: Device) -> List[DisplayConfig]:
    """Return the displays of a device in RViz's terms; explicit ones replace matching defaults."""
    explicit = [_config(display, device) for display in device.displays]
    defaults = [_config(display, device) for display in _default_displays(device)]
    taken = [_identity(config) for config in explicit]
    kept = [config for config in defaults if _identity(config) not in taken]
    return _with_unique_names(kept + explicit)


def _default_displays(device: Device) -> List[Display]:
    types: List[str] = []
    if device.model is not None:
        types.append('RobotModel')
    if device.type is DeviceType.ROBOT or any(it.is_shown for it in device.variables):
        types.append('MarkerArray')
    if device.type is DeviceType.DEPTH_SENSOR:
        types.append('PointCloud2')
    displays = [Display(type_name, None, None, (), (), device.location) for type_name in types]
    if device.roi is not None and device.has_cloud:
        displays.append(Display('Marker', 'Region of interest',
                                f'/{device.name}/{ROI_FILTER}/outline', (), (), device.location))
    if device.objects is not None:
        displays.append(Display('MarkerArray', 'Objects', f'/{device.name}/{OBJECTS_MARKERS}',
                                (), (), device.location))
    return displays


def _config(display: Display, device: Device) -> DisplayConfig:
    display_type = DISPLAY_TYPES[display.type]
    config: DisplayConfig = {
        'Class': _class_of(display.type),
        'Name': display.name or _DEFAULT_NAMES.get(display.type, display.type),
        'Enabled': True,
        **copy.deepcopy(display_type.properties),
    }
    config.update((key, f'/{device.name}/{name}')
                  for key, name in display_type.device_names.items())
    if display_type.topic_key is not None:
        config[display_type.topic_key] = display_topic(display, device)
    if display.type == 'Group':
        config['Displays'] = [_config(child, device) for child in display.children]
    config.update((item.name, property_value(item)) for item in display.properties
                  if item.name not in _SETTLED)
    if display.type == 'TF':
        config['Frames'] = _frame_states(config['Frames'])
    return config


def _class_of(display_type: str) -> str:
    library = 'process_visualizer' if display_type in _OWN_DISPLAYS else 'rviz'
    return f'{library}/{display_type}'


def _frame_states(frames: Any) -> Any:
    """Return frame states as mappings with the key "Value": RViz takes all others as disabled."""
    if not isinstance(frames, dict):
        return frames
    return {name: state if isinstance(state, dict) or name == 'All Enabled' else {'Value': state}
            for name, state in frames.items()}


def display_topic(display: Display, device: Device) -> str:
    """Return the topic (or, for a robot model, the parameter) that the display shows."""
    if display.topic is not None:
        return display.topic
    return f'/{device.name}/{DISPLAY_TYPES[display.type].default_topic}'


def property_value(item: Property) -> Any:
    """Return the value in YAML's terms (number, true/false, text), or a mapping of properties."""
    if not item.children:
        return _scalar(item.value)
    below = {child.name: property_value(child) for child in item.children}
    return below if item.value is None else {'Value': _scalar(item.value), **below}


def _scalar(text: Optional[str]) -> Any:
    """Return a number or truth value if the text is clearly one; otherwise the text."""
    word = (text or '').lower()
    if word in ('true', 'false'):
        return word == 'true'
    match = _NUMBER.fullmatch(word)
    if match is None:
        return text or ''
    return float(word) if match[2] else int(word)


def _identity(config: DisplayConfig) -> Tuple[str, Any]:
    key = DISPLAY_TYPES[config['Class'].split('/')[1]].topic_key
    return config['Class'], None if key is None else config[key]


def _with_unique_names(configs: List[DisplayConfig]) -> List[DisplayConfig]:
    """Number displays that share a name, since RViz finds displays by name."""
    taken: Set[str] = set()
    for config in configs:
        name, count = config['Name'], 1
        while config['Name'] in taken:
            count += 1
            config['Name'] = f'{name} {count}'
        taken.add(config['Name'])
        _with_unique_names(config.get('Displays', []))
    return configs
