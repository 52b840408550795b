# SPDX-License-Identifier: BSD-3-Clause
"""Rules of the ``<rviz>`` elements."""
from __future__ import annotations

from typing import Sequence, Set

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.cell.errors import ProblemList
from process_visualizer.cell.model import Display, Property


def check_display(display: Display, problems: ProblemList) -> None:
    """Check that type, topic, properties and children of a display fit together."""
    display_type = DISPLAY_TYPES[display.type]
    what = f'a display of type "{display.type}"'
    if display_type.needs_topic and display.topic is None:
        problems.add(display.location, 'rviz', f'{what} needs the attribute "topic" '
                                               f'({display_type.message_type})')
    if display_type.topic_key is None and display.topic is not None:
        problems.add(display.location, 'rviz', f'{what} shows no topic; remove the attribute '
                                               '"topic"')
    if display.children and display.type != 'Group':
        problems.add(display.location, 'rviz', f'{what} cannot hold others; only "Group" can')
    _check_properties(display, display.properties, problems)
    for child in display.children:
        check_display(child, problems)


def _check_properties(display: Display, properties: Sequence[Property],
                      problems: ProblemList) -> None:
    names: Set[str] = set()
    for item in properties:
        where = item.location or display.location
        if item.name in names:
            problems.add(where, 'property', f'the property "{item.name}" is given twice; keep one')
        if item.value is None and not item.children:
            problems.add(where, 'property', 'has neither a value nor properties below it; give '
                                            'the attribute "value"')
        names.add(item.name)
        _check_properties(display, item.children, problems)
