# SPDX-License-Identifier: BSD-3-Clause
"""Values of the ``<arg>`` elements of a file."""
from __future__ import annotations

from typing import Dict, Mapping, Optional

from process_visualizer.cell.element_reader import Element, ElementReader, Parsed
from process_visualizer.cell.elements import ROOT
from process_visualizer.cell.errors import Location, ProblemList, advice
from process_visualizer.cell.substitution import Arguments


def read_arguments(root: Element, given: Mapping[str, str],
                   problems: ProblemList) -> Arguments:
    """Return the values of the arguments in file order; an argument may refer to earlier ones."""
    values: Dict[str, Optional[str]] = {}
    for element in root.children:
        if element.tag != 'arg':
            continue
        parsed = ElementReader(values, problems).read(element)
        if parsed is None or not parsed.values['name']:
            continue
        name = str(parsed.values['name'])
        if name in values:
            problems.add(element.location, 'arg', f'the argument "{name}" already exists; choose '
                                                  'another name')
        values[name] = _value(parsed, given, problems) if parsed.sound else None
    return values


def _value(parsed: Parsed, given: Mapping[str, str], problems: ProblemList) -> Optional[str]:
    name, fixed, default = (parsed.values[key] for key in ('name', 'value', 'default'))
    if fixed is not None:
        if name in given:
            problems.add(parsed.location, 'arg', f'"{name}" has a fixed value and cannot be given '
                                                 'another; write default instead of value')
        return str(fixed)
    if name in given:
        return given[name]
    if default is None:
        problems.add(parsed.location, 'arg', f'no value for "{name}"; give {name}:=… or a default')
        return None
    return str(default)


def report_unknown(given: Mapping[str, str], root: Element, place: Optional[Parsed],
                   problems: ProblemList) -> None:
    """Report values for arguments that a file does not declare.

    ``place`` is the ``<include>`` that gives the values; None for a command line.
    """
    declared = [element.attributes.get('name', '') for element in root.children
                if element.tag == 'arg']
    for name in given:
        if name not in declared:
            known = advice(name, declared) if declared else 'the file declares none'
            location = root.location if place is None else _place_of(name, place)
            problems.add(location, ROOT if place is None else 'arg',
                         f'there is no argument "{name}"; {known}')


def _place_of(name: str, parent: Parsed) -> Location:
    return next(child.location for child in parent.all('arg') if child.values['name'] == name)


def passed_arguments(parsed: Parsed, problems: ProblemList) -> Dict[str, str]:
    """Return name and value of each ``<arg>`` of an ``<include>`` or ``<launch>``."""
    values: Dict[str, str] = {}
    for child in parsed.all('arg'):
        name = child.values['name']
        if name in values:
            problems.add(child.location, 'arg', f'"{name}" is given twice; keep one')
        values[name] = child.values['value']
    return values
