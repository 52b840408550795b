# SPDX-License-Identifier: BSD-3-Clause
"""Rules of the elements that are passed on to roslaunch, which would refuse them only later."""
from __future__ import annotations

from typing import Callable, Dict, Iterable, List, Tuple

import yaml

from process_visualizer.cell.element_reader import Parsed
from process_visualizer.cell.errors import ProblemList, quoted, shortened
from process_visualizer.cell.model import Node, RoslaunchElement
from process_visualizer.cell.plain_yaml import plain_yaml
from process_visualizer.cell.suggestions import advice
from process_visualizer.cell.values import boolean, number

_VALUE_TYPES: Dict[str, Tuple[Callable[[str], object], str]] = {
    'int': (int, 'a whole number'),
    'double': (number, 'a number'),
    'bool': (boolean, 'True or False'),
    'boolean': (boolean, 'True or False'),
}


def check_machines(machines: Iterable[Parsed], devices: Iterable[Parsed],
                   problems: ProblemList) -> None:
    """Check that names of machines are unique, and that nodes run on declared machines.

    A password is refused: it would stand in launch files, parameters and recordings.
    """
    names: List[str] = []
    for machine in machines:
        name = machine.values['name']
        if 'password' in machine.given:
            problems.add(machine.location, 'machine', _no_password(machine))
        if name in names:
            problems.add(machine.location, 'machine', f'a machine named {quoted(name)} already '
                                                      'exists; choose another name')
        names += [name] if name else []
    for node in (child for device in devices for child in device.all('node')):
        name = node.values['machine']
        if name and name not in names:
            problems.add(node.location, 'node', f'there is no machine {quoted(name)}; '
                         + (advice(name, names) if names else 'no <machine> is declared'))


def _no_password(machine: Parsed) -> str:
    user, address = machine.values['user'], machine.values['address']
    whom = f'{user}@{address}' if user and address else 'USER@ADDRESS'
    return ('the attribute "password" is not accepted: it would stand in launch files, parameters '
            f'and recordings; remove it, and let SSH use a key ("ssh-copy-id {whom}", with an '
            'agent: "ssh-add")')


def check_node(node: Node, problems: ProblemList) -> None:
    """Check that attributes and parameters of a node fit together."""
    if all(boolean(node.attributes.get(name, 'False')) for name in ('respawn', 'required')):
        problems.add(node.location, 'node', '"respawn" and "required" cannot both be True; '
                                            'keep one')
    for child in node.children:
        check_parameter(child, problems)


def check_parameter(element: RoslaunchElement, problems: ProblemList) -> None:
    """Check that the value of a ``<param>`` has its type, and that a ``<rosparam>`` is YAML."""
    if element.tag == 'param':
        _check_param(element, problems)
    elif element.tag == 'rosparam':
        _check_rosparam(element, problems)


def _check_param(element: RoslaunchElement, problems: ProblemList) -> None:
    value, value_type = (element.attributes.get(name) for name in ('value', 'type'))
    if value is None or value_type not in (*_VALUE_TYPES, 'yaml'):
        return
    if value_type == 'yaml':
        _check_yaml(value, element, problems)
        return
    convert, what = _VALUE_TYPES[value_type]
    try:
        convert(value)
    except ValueError:
        problems.add(element.location, 'param', f'{quoted(value)} is not {what}, which the type '
                                                f'"{value_type}" requires')


def _check_rosparam(element: RoslaunchElement, problems: ProblemList) -> None:
    command = element.attributes.get('command', 'load')
    file = element.attributes.get('file')
    if command == 'dump' and file is None:
        problems.add(element.location, 'rosparam', 'the attribute "file" is missing; dump writes '
                                                   'to a file')
    if command == 'delete' and file is not None:
        problems.add(element.location, 'rosparam', 'delete needs no file; remove the attribute '
                                                   '"file"')
    if command == 'load' and file is None:
        value = _check_yaml(element.text, element, problems)
        if not isinstance(value, (dict, type(None))) and 'param' not in element.attributes:
            problems.add(element.location, 'rosparam', 'the YAML is a single value; give the '
                                                       'attribute "param" to name it')


def _check_yaml(text: str, element: RoslaunchElement, problems: ProblemList) -> object:
    try:
        return plain_yaml(text)
    except yaml.MarkedYAMLError as error:
        reason = error.problem or 'not understood'
    except (yaml.YAMLError, ValueError) as error:
        reason = str(error)
    except RecursionError:
        reason = 'it is nested too deeply'
    problems.add(element.location, element.tag, f'not valid YAML: {shortened(reason)}')
    return None
