# SPDX-License-Identifier: BSD-3-Clause
"""Names for what is made of other names: devices after namespaces, words that names share."""
from __future__ import annotations

import re
from typing import Collection, FrozenSet

from process_visualizer.cell.values import PATTERNS

_NO_WORDS = frozenset({'', 'robot', 'description', 'driver', 'state', 'states', 'controller',
                       'joint', 'joints', 'topic', 'sensor', 'data'})
_TOPIC, _FRAME, _FIELD = (re.compile(f'(?:{PATTERNS[kind]})\\Z')
                          for kind in ('topic', 'frame', 'field'))


def is_topic(name: str) -> bool:
    """Return whether a configuration can name this topic."""
    last = name.rpartition('/')[2]
    return bool(_TOPIC.match(name)) and '//' not in name and last[:1].isalpha()


def is_frame(name: str) -> bool:
    """Return whether a configuration can name this frame."""
    return bool(_FRAME.match(name)) and not name.startswith('/')


def is_field(path: str) -> bool:
    """Return whether a configuration can name this field."""
    return bool(_FIELD.match(path))


def device_name(text: str, default: str) -> str:
    """Return a valid name of a device like a text, such as the end of a namespace."""
    name = re.sub('[^A-Za-z0-9_]+', '_', text).strip('_')
    if not name:
        return default
    return name if name[0].isalpha() else f'{default}_{name}'


def free_name(wanted: str, taken: Collection[str], ending: str = '') -> str:
    """Return the wanted name, or one like it, that is not taken."""
    names = [wanted, *([f'{wanted}_{ending}'] if ending else [])]
    number = 2
    while names[0] in taken:
        names.pop(0)
        if not names:
            names.append(f'{wanted}_{number}')
            number += 1
    return names[0]


def words(name: str) -> FrozenSet[str]:
    """Return the words of a name that tell it from others, in lower case."""
    parts = re.split('[/_.-]+', re.sub('([a-z])([A-Z])', r'\1_\2', name))
    return frozenset(part.lower() for part in parts) - _NO_WORDS
