# SPDX-License-Identifier: BSD-3-Clause
"""Combines a view that the operator has saved with the generated one."""
from __future__ import annotations

import copy
from typing import Any, Dict, List, Mapping, Tuple

from process_visualizer.cell.displays import DISPLAY_TYPES

ViewConfig = Dict[str, Any]
_MANAGER = 'Visualization Manager'
_GENERATED_KEYS = ('Class', 'Name', 'Displays')


def merged_view(generated: Mapping[str, Any], saved: Mapping[str, Any]) -> ViewConfig:
    """The saved view with the displays, topics and global frame of the generated one.

    The operator's settings in RViz are kept: camera, colours, what is switched off, added
    displays, panels. The configuration decides which displays its devices have, and what they
    show. Both are contents of ``.rviz`` files.
    """
    result: ViewConfig = copy.deepcopy({**generated, **saved})
    ours, his = _mapping(generated, _MANAGER), _mapping(saved, _MANAGER)
    result[_MANAGER] = copy.deepcopy({
        **ours, **his, 'Displays': _merged_displays(_displays(ours), _displays(his)),
        'Global Options': {**_mapping(ours, 'Global Options'), **_mapping(his, 'Global Options'),
                           'Fixed Frame': _mapping(ours, 'Global Options').get('Fixed Frame')}})
    result['Preferences'] = {**_mapping(saved, 'Preferences'), **_mapping(generated, 'Preferences')}
    return result


def _merged_displays(generated: List[ViewConfig], saved: List[ViewConfig]) -> List[ViewConfig]:
    by_identity = {_identity(display): display for display in saved}
    merged = [_merged_display(display, by_identity.pop(_identity(display), {}))
              for display in generated]
    return merged + list(by_identity.values())


def _merged_display(generated: ViewConfig, saved: ViewConfig) -> ViewConfig:
    result = {**generated, **saved}
    for key in (*_GENERATED_KEYS, _topic_key(generated)):
        if key in generated:
            result[key] = generated[key]
    if 'Displays' in generated:
        result['Displays'] = _merged_displays(_displays(generated), _displays(saved))
    return result


def _identity(display: ViewConfig) -> Tuple[str, str]:
    return _type(display), str(display.get('Name'))


def _type(display: ViewConfig) -> str:
    """The type without its library: views saved earlier show our markers with RViz's display."""
    return str(display.get('Class')).split('/')[-1]


def _topic_key(display: ViewConfig) -> str:
    display_type = DISPLAY_TYPES.get(_type(display))
    return (display_type.topic_key or '') if display_type else ''


def _mapping(config: Mapping[str, Any], key: str) -> Dict[str, Any]:
    """The mapping below a key; empty if a file edited by hand has something else there."""
    value = config.get(key)
    return value if isinstance(value, dict) else {}


def _displays(config: Mapping[str, Any]) -> List[ViewConfig]:
    value = config.get('Displays')
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []
