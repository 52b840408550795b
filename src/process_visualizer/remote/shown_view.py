# SPDX-License-Identifier: BSD-3-Clause
"""The view of a cell that runs elsewhere, of which only what it shows is taken over."""
from __future__ import annotations

from typing import Any, Dict, Iterator, List, Mapping

import yaml

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.cell.plain_yaml import plain_yaml
from process_visualizer.rviz.onlooker_view import onlooker_view

LINK_TOPIC = '/view_link/marker_array'
"""Where the viewer says in its own scene that the cell cannot be reached."""
_LINK_DISPLAY = {'Class': 'process_visualizer/MarkerArray', 'Name': 'Connection', 'Enabled': True,
                 'Marker Topic': LINK_TOPIC}
_GROUP = 'rviz/Group'
_KNOWN = frozenset((_GROUP, 'process_visualizer/MarkerArray',
                    *(f'rviz/{name}' for name in DISPLAY_TYPES)))
_LONGEST_TEXT, _MOST_VALUES, _DEEPEST = 2 << 20, 100_000, 24
_LIMITS = {'Plane Cell Count': 1000, 'Decay Time': 60, 'Queue Size': 100, 'Buffer Length': 1000,
           'Length': 1000, 'History Length': 1000, 'Cloud Decay Time': 60}
_HINTS = ('Transport Hint', 'Depth Map Transport Hint', 'Color Transport Hint')
_GLOBALS = ('Fixed Frame', 'Background Color', 'Default Light')
View = Dict[str, Any]


def shown_view(text: str, own: View) -> View:
    """Return the content of the viewer's .rviz file.

    Args:
        text: the view of the cell. Its displays, frame and camera are taken over.
        own: the content of the default .rviz file, for the rest.

    Raises:
        ValueError: the text is no view.
    """
    manager = _mapping(_parsed(text), 'Visualization Manager')
    if not manager:
        raise ValueError('it has no "Visualization Manager"')
    result = dict(_mapping(own, 'Visualization Manager'))
    result['Displays'] = [*_displays(manager), _LINK_DISPLAY]
    options = _mapping(manager, 'Global Options')
    result['Global Options'] = {**_mapping(result, 'Global Options'),
                                **{it: options[it] for it in _GLOBALS if it in options}}
    current = _mapping(_mapping(manager, 'Views'), 'Current')
    if str(current.get('Class', '')).startswith('rviz/'):
        result['Views'] = {'Current': current, 'Saved': None}
    return onlooker_view({**own, 'Visualization Manager': result})


def fixed_frame(view: Mapping[str, Any]) -> str:
    """Return the frame of a view in which everything is shown."""
    options = _mapping(_mapping(view, 'Visualization Manager'), 'Global Options')
    return str(options.get('Fixed Frame', ''))


def model_parameters(text: str) -> List[str]:
    """Return the absolute names of the parameters from which a view's models come.

    Raises:
        ValueError: the text is no view.
    """
    return list(dict.fromkeys(_models(_mapping(_parsed(text), 'Visualization Manager'))))


def parsed_view(text: str) -> View:
    """Return the content of a view as plain values.

    Raises:
        ValueError: the text is no view, or has too much in it.
    """
    return _parsed(text)


def _models(element: Any) -> Iterator[str]:
    if isinstance(element, dict):
        name = element.get('Robot Description')
        if isinstance(name, str) and name:
            yield '/' + name.strip('/')
        for value in element.values():
            yield from _models(value)
    elif isinstance(element, list):
        for value in element:
            yield from _models(value)


def _parsed(text: str) -> View:
    if len(text) > _LONGEST_TEXT:
        raise ValueError(f'it is longer than {_LONGEST_TEXT >> 20} MB')
    try:
        content = plain_yaml(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f'it is not YAML: {" ".join(str(error).split())}') from None
    content = _Copy().of(content)
    if not isinstance(content, dict):
        raise ValueError('it is no .rviz file')
    return content


class _Copy:
    """Copies plain values, and counts them: references in YAML may multiply."""

    def __init__(self) -> None:
        self._count = 0

    def of(self, value: Any, depth: int = 0) -> Any:
        """Return a copy; raise ValueError if there is too much, or anything that is not plain."""
        self._count += 1
        if self._count > _MOST_VALUES or depth > _DEEPEST:
            raise ValueError('there is too much in it')
        if isinstance(value, dict):
            return {str(key): self.of(it, depth + 1) for key, it in value.items()}
        if isinstance(value, list):
            return [self.of(it, depth + 1) for it in value]
        if value is None or isinstance(value, (str, int, float, bool)):
            return value
        return str(value)


def _displays(element: Mapping[str, Any]) -> List[View]:
    found = element.get('Displays')
    items = [it for it in found if isinstance(it, dict)] if isinstance(found, list) else []
    return [_display(it) for it in items if it.get('Class') in _KNOWN]


def _display(display: View) -> View:
    result = {key: _limited(key, value) for key, value in display.items()}
    if display['Class'] == _GROUP:
        result['Displays'] = _displays(display)
    return result


def _limited(key: str, value: Any) -> Any:
    if key in _LIMITS:
        return min(value, _LIMITS[key]) if isinstance(value, (int, float)) else _LIMITS[key]
    return 'raw' if key in _HINTS else value


def _mapping(element: Mapping[str, Any], key: str) -> View:
    value = element.get(key)
    return value if isinstance(value, dict) else {}
