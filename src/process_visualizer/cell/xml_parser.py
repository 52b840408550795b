"""XmlParser: from a configuration file to the model of the cell."""
from __future__ import annotations

import os
from typing import Dict, List, Mapping, Optional, Tuple

from process_visualizer.cell.builder import build_device, build_machines
from process_visualizer.cell.element_reader import ElementReader, Parsed
from process_visualizer.cell.errors import ConfigurationError, ProblemList
from process_visualizer.cell.language import ROOT
from process_visualizer.cell.model import Cell, Device, RoslaunchElement
from process_visualizer.cell.rules import check_device, check_devices
from process_visualizer.cell.suggestions import advice
from process_visualizer.cell.xml_reader import Element, read_xml

DEFAULT_FRAME = 'world'


class XmlParser:
    """Parses a configuration and the files it includes.

    ``arguments`` are values for ``<arg>`` elements, as given on a command line.
    """

    def __init__(self, arguments: Optional[Mapping[str, str]] = None) -> None:
        self._given = dict(arguments or {})

    def parse(self, path: str) -> Cell:
        """The cell of the file; raises ConfigurationError with every problem found."""
        problems = ProblemList()
        parts = _FileParser(path, self._given, problems, ()).parse()
        if not len(problems) and not parts.devices:
            problems.add(parts.root.location, ROOT, 'lists no device; add a <device>')
        problems.raise_if_any()
        return Cell(os.path.abspath(path), parts.frame or DEFAULT_FRAME,
                    tuple(parts.devices), tuple(parts.machines))


class _Parts:
    """What a file and the files it includes contain."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.frame: Optional[str] = None
        self.parsed_devices: List[Parsed] = []
        self.devices: List[Device] = []
        self.machines: List[RoslaunchElement] = []


class _FileParser:
    """Parses one file; ``chain`` are the files that include it, outermost first."""

    def __init__(self, path: str, given: Mapping[str, str], problems: ProblemList,
                 chain: Tuple[str, ...]) -> None:
        self._path = path
        self._given = given
        self._problems = problems
        self._chain = chain + (os.path.abspath(path),)

    def parse(self) -> _Parts:
        root = self._read_root()
        parts = _Parts(root)
        if root.tag != ROOT:
            return parts
        self._collect(root, parts)
        if len(self._chain) == 1:
            check_devices(parts.parsed_devices, parts.frame or DEFAULT_FRAME, self._problems)
            self._build(parts)
        return parts

    def _read_root(self) -> Element:
        try:
            root = read_xml(self._path)
        except ConfigurationError as error:
            if len(self._chain) == 1:
                raise
            self._problems.extend(error.problems)
            return Element('', {}, error.problems[0].location)
        if root.tag != ROOT:
            self._problems.add(root.location, root.tag,
                               f'a configuration begins with <{ROOT}>; '
                               f'write <{ROOT}> instead of <{root.tag}>')
        return root

    def _collect(self, root: Element, parts: _Parts) -> None:
        arguments = self._arguments(root)
        reader = ElementReader(arguments, self._problems)
        own = Element(root.tag, root.attributes, root.location, root.text,
                      [child for child in root.children if child.tag != 'arg'])
        parsed = reader.read(own)
        if parsed is None:
            return
        parts.frame = parsed.values['frame'] if 'frame' in parsed.given else None
        parts.machines = build_machines(parsed)
        for child in parsed.children:
            if child.tag == 'device':
                parts.parsed_devices.append(child)
            elif child.tag == 'include' and child.sound:
                self._include(child, parts)

    def _arguments(self, root: Element) -> Dict[str, str]:
        """Values of the ``<arg>`` elements in file order, like roslaunch's."""
        values: Dict[str, str] = {}
        for element in root.children:
            if element.tag != 'arg':
                continue
            parsed = ElementReader(values, self._problems).read(element)
            if parsed is None or not parsed.sound:
                continue
            name = parsed.values['name']
            value = self._argument_value(parsed)
            if value is None:
                self._problems.add(element.location, 'arg',
                                   f'no value for "{name}"; give {name}:=… or a default')
            values[name] = value or ''
        self._report_unknown(values, root)
        return values

    def _argument_value(self, parsed: Parsed) -> Optional[str]:
        if parsed.values['value'] is not None:
            return str(parsed.values['value'])
        given = self._given.get(parsed.values['name'])
        if given is not None:
            return given
        default = parsed.values['default']
        return None if default is None else str(default)

    def _report_unknown(self, values: Mapping[str, str], root: Element) -> None:
        for name in self._given:
            if name not in values:
                known = advice(name, values) if values else 'the file declares none'
                self._problems.add(root.location, ROOT, f'there is no argument "{name}"; {known}')

    def _include(self, parsed: Parsed, parts: _Parts) -> None:
        folder = os.path.dirname(self._path)
        path = os.path.abspath(os.path.join(folder, parsed.values['file']))
        if path in self._chain:
            self._problems.add(parsed.location, 'include',
                               'includes itself: ' + ' -> '.join(self._chain + (path,)))
            return
        if not os.path.isfile(path):
            self._problems.add(parsed.location, 'include', f'there is no file "{path}"')
            return
        given = {child.values['name']: child.values['value'] or ''
                 for child in parsed.all('arg')}
        included = _FileParser(path, given, self._problems, self._chain).parse()
        self._merge(included, parts, parsed)

    def _merge(self, included: _Parts, parts: _Parts, parsed: Parsed) -> None:
        parts.parsed_devices.extend(included.parsed_devices)
        parts.machines.extend(included.machines)
        if parts.frame is None:
            parts.frame = included.frame
        elif included.frame not in (None, parts.frame):
            self._problems.add(parsed.location, 'include',
                               f'uses the global frame "{included.frame}", this file '
                               f'"{parts.frame}"; write the same')

    def _build(self, parts: _Parts) -> None:
        frame = parts.frame or DEFAULT_FRAME
        for parsed in parts.parsed_devices:
            if parsed.readable:
                device = build_device(parsed, frame)
                check_device(device, self._problems)
                parts.devices.append(device)

