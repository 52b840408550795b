# SPDX-License-Identifier: BSD-3-Clause
"""The parser: reads a configuration file into the model of the cell."""
from __future__ import annotations

import os
from dataclasses import replace
from typing import Dict, List, Mapping, Optional, Tuple

from process_visualizer.cell.arguments import passed_arguments, read_arguments, report_unknown
from process_visualizer.cell.builder import (
    build_device,
    build_event,
    build_machines,
    build_phase,
    build_run,
)
from process_visualizer.cell.confinement import confined, confined_arguments, refused_include
from process_visualizer.cell.element_reader import Element, ElementReader, Parsed, read_xml
from process_visualizer.cell.elements import DEFAULT_FRAME, ROOT
from process_visualizer.cell.errors import ConfigurationError, Problem, ProblemList, missing_file
from process_visualizer.cell.model import (
    Cell,
    Device,
    ProcessEvent,
    ProcessPhase,
    RoslaunchElement,
    RunSpan,
)
from process_visualizer.cell.outputs import with_variable_topics
from process_visualizer.cell.rules import (
    check_device,
    check_devices,
    check_event_topics,
    check_machines,
    check_node_names,
    check_outputs,
    check_run,
    check_sensors,
)
from process_visualizer.cell.trust import OPENED, Provenance

_MAX_FILES = 100
"""Maximum number of included files: nested includes can multiply."""


class XmlParser:
    """Parses a configuration and the files it includes.

    ``arguments`` are values for ``<arg>`` elements, as given on a command line. If the
    ``provenance`` makes the configuration data, everything that could run something is ignored.
    """

    def __init__(self, arguments: Optional[Mapping[str, str]] = None,
                 provenance: Provenance = OPENED) -> None:
        self._given = dict(arguments or {})
        self._provenance = provenance

    def parse(self, path: str) -> Cell:
        """Return the cell of the file.

        Raises:
            ConfigurationError: the file has problems; the error lists all of them.
        """
        cell, problems = self.read(path)
        problems.raise_if_any()
        return cell

    def read(self, path: str) -> Tuple[Cell, ProblemList]:
        """Return the cell as far as it could be read, and the problems found.

        A cell with problems may have further errors that were not found.

        Raises:
            ConfigurationError: the file is not a configuration at all.
        """
        problems = ProblemList()
        root = _read_root(path)
        reading = _Reading(problems, self._provenance)
        given, ignored = confined_arguments(self._given, path, self._provenance)
        reading.ignored.extend(ignored)
        reading.read(root, given, (path,), None)
        check_devices(reading.devices, reading.frame or DEFAULT_FRAME, problems)
        check_machines(reading.machines, reading.devices, problems)
        check_run(reading.events, reading.runs, reading.phases, problems)
        devices = tuple(map(self._confined, _build_devices(
            reading.devices, reading.frame or DEFAULT_FRAME, problems)))
        check_event_topics(reading.events, devices, problems)
        if not len(problems) and not devices:
            problems.add(root.location, ROOT, 'lists no device; add a <device>')
        if len(problems):
            problems.extend(reading.ignored)  # may be the cause of a problem
        return Cell(os.path.abspath(path), reading.frame or DEFAULT_FRAME, devices,
                    reading.machine_elements(), tuple(reading.files), given,
                    reading.process_events(), reading.run_span(), self._provenance,
                    tuple(reading.ignored), reading.parts_of_runs()), problems

    def _confined(self, device: Device) -> Device:
        """Return the device, with its model marked as data if the configuration is data."""
        if device.model is None or not self._provenance.is_data:
            return device
        return replace(device, model=replace(device.model, confined_to=self._provenance.folder))


def _read_root(path: str) -> Element:
    """Return the root element of the file.

    Raises:
        ConfigurationError: the root is not a ``<visualizer>``.
    """
    root = read_xml(path)
    if root.tag != ROOT:
        problems = ProblemList()
        problems.add(root.location, root.tag, f'a configuration begins with <{ROOT}>; '
                                              f'write <{ROOT}> instead')
        problems.raise_if_any()
    return root


def _build_devices(parsed_devices: List[Parsed], frame: str,
                   problems: ProblemList) -> Tuple[Device, ...]:
    devices = []
    for parsed in parsed_devices:
        device = build_device(parsed, frame)
        check_device(device, parsed, problems)
        devices.append(device)
    check_node_names(devices, problems)
    check_outputs(devices, problems)
    check_sensors(devices, problems)
    return with_variable_topics(devices)


class _Reading:
    """Contents of a file and of the files it includes, in file order."""

    def __init__(self, problems: ProblemList, provenance: Provenance) -> None:
        self.frame: Optional[str] = None
        self.devices: List[Parsed] = []
        self.machines: List[Parsed] = []
        self.events: List[Parsed] = []
        self.runs: List[Parsed] = []
        self.phases: List[Parsed] = []
        self.files: Dict[str, None] = {}
        self._lists = {'device': self.devices, 'machine': self.machines, 'event': self.events,
                       'run': self.runs, 'phase': self.phases}
        self.ignored: List[Problem] = []
        self._problems = problems
        self._provenance = provenance
        self._includes = 0

    def machine_elements(self) -> Tuple[RoslaunchElement, ...]:
        """Return the ``<machine>`` elements for roslaunch."""
        return build_machines(self.machines)

    def process_events(self) -> Tuple[ProcessEvent, ...]:
        """Return the events of the process."""
        return tuple(build_event(parsed) for parsed in self.events if parsed.complete)

    def run_span(self) -> Optional[RunSpan]:
        """Return the definition of a run, if the configuration has one."""
        return next((build_run(parsed) for parsed in self.runs if parsed.complete), None)

    def parts_of_runs(self) -> Tuple[ProcessPhase, ...]:
        """Return the phases of a run."""
        return tuple(build_phase(parsed) for parsed in self.phases if parsed.complete)

    def read(self, root: Element, given: Mapping[str, str], chain: Tuple[str, ...],
             place: Optional[Parsed]) -> None:
        """Read a file; ``chain`` are the paths down to it, ``place`` is its ``<include>``."""
        self._problems.begin_file(root.location.file)
        remaining = confined(root, self._provenance, given)
        root = remaining.root
        self.ignored.extend(remaining.ignored)
        self.files[os.path.abspath(chain[-1])] = None
        arguments = read_arguments(root, given, self._problems)
        report_unknown(given, root, place, self._problems)
        others = [child for child in root.children if child.tag != 'arg']
        own = Element(root.tag, root.attributes, root.location, root.text, others)
        parsed = ElementReader(arguments, self._problems).read(own)
        if parsed is None:
            return
        self._set_frame(parsed)
        for child in parsed.children:
            if child.tag in self._lists:
                self._lists[child.tag].append(child)
            elif child.sound:
                self._include(child, chain)

    def _set_frame(self, root: Parsed) -> None:
        frame = root.values['frame'] if 'frame' in root.given else None
        if self.frame is None:
            self.frame = frame
        elif frame not in (None, self.frame):
            self._problems.add(root.location, ROOT, f'the global frame is already "{self.frame}", '
                                                    f'not "{frame}"; write the same name')

    def _include(self, parsed: Parsed, chain: Tuple[str, ...]) -> None:
        folder = os.path.dirname(chain[-1])
        path = os.path.abspath(os.path.join(folder, parsed.values['file']))
        ignored = refused_include(path, parsed.location, self._provenance)
        if ignored is not None:
            self.ignored.append(ignored)
            return
        self._includes += 1
        reason = self._refusal(path, chain)
        if reason:
            self._problems.add(parsed.location, 'include', reason)
            return
        try:
            root = _read_root(path)
        except ConfigurationError as error:
            self._problems.extend(error.problems)
            return
        self.read(root, passed_arguments(parsed, self._problems), chain + (path,), parsed)

    def _refusal(self, path: str, chain: Tuple[str, ...]) -> str:
        """Return why the file cannot be included; empty if it can."""
        if os.path.realpath(path) in map(os.path.realpath, chain):
            return 'includes itself: ' + ' -> '.join(chain + (path,))
        if self._includes > _MAX_FILES:
            return f'is one of more than {_MAX_FILES} includes; remove those that repeat'
        return '' if os.path.isfile(path) else missing_file(path)
