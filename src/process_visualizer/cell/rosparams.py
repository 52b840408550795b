# SPDX-License-Identifier: BSD-3-Clause
"""Values of the ROS parameters that a configuration sets with <param> and <rosparam>."""
from __future__ import annotations

from typing import Any, Dict, Iterable, Iterator, Tuple

import yaml
from rosgraph.names import ns_join

from process_visualizer.cell.model import Device, RoslaunchElement
from process_visualizer.cell.values import plain_yaml

_Named = Iterator[Tuple[str, Any]]


def given_parameters(device: Device, group: str) -> Dict[str, Any]:
    """Return the values that <param> and <rosparam> set below a group of a device, by name."""
    begin = ns_join(f'/{device.name}', group) + '/'
    return {name[len(begin):]: value
            for name, value in set_values(device.parameters, f'/{device.name}').items()
            if name.startswith(begin)}


def set_values(elements: Iterable[RoslaunchElement], namespace: str = '/') -> Dict[str, Any]:
    """Return the values that <param> and <rosparam> set in a namespace, by full name.

    Of values stored elsewhere (files, commands), only YAML files are read. Values that roslaunch
    would refuse are skipped: the cell would not run with them, but its recording can be viewed.
    """
    return dict(it for element in elements if element.tag in ('param', 'rosparam')
                for it in _set_by(element, namespace))


def _set_by(element: RoslaunchElement, namespace: str) -> _Named:
    given = element.attributes
    if element.tag == 'param':
        return _values(ns_join(namespace, given['name']), _loaded(given.get('value', '')))
    if given.get('command', 'load') != 'load':
        return iter(())
    place = ns_join(ns_join(namespace, given.get('ns', '')), given.get('param', ''))
    return _values(place, _loaded(_text(element)))


def _text(element: RoslaunchElement) -> str:
    if 'file' not in element.attributes:
        return element.text
    try:
        with open(element.attributes['file'], encoding='utf-8') as file:
            return file.read()
    except (OSError, UnicodeDecodeError):
        return ''


def _loaded(text: str) -> Any:
    try:
        return plain_yaml(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None


def _values(name: str, value: Any) -> _Named:
    """Yield each value of a group by its full name."""
    if not isinstance(value, dict):
        yield name, value
        return
    for key, inner in value.items():
        yield from _values(ns_join(name, str(key)), inner)
