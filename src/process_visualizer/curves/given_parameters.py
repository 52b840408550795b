# SPDX-License-Identifier: BSD-3-Clause
"""The parameters that a configuration gives a device in roslaunch's words."""
from __future__ import annotations

from typing import Any, Dict, Iterator, Tuple

import yaml
from rosgraph.names import ns_join

from process_visualizer.cell.model import Device, RoslaunchElement
from process_visualizer.cell.plain_yaml import plain_yaml

_Named = Iterator[Tuple[str, Any]]


def given_parameters(device: Device, group: str) -> Dict[str, Any]:
    """Return what <param> and <rosparam> set below a group of a device's namespace, by name.

    Of values that stand elsewhere (files, commands) only YAML files are read. What roslaunch
    would refuse is left out: then the cell does not run, but a recording can be looked at.
    """
    begin = ns_join(f'/{device.name}', group) + '/'
    return {name[len(begin):]: value for element in device.parameters
            for name, value in _set_by(element, f'/{device.name}') if name.startswith(begin)}


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
    """Yield each value of a group by its whole name."""
    if not isinstance(value, dict):
        yield name, value
        return
    for key, inner in value.items():
        yield from _values(ns_join(name, str(key)), inner)
