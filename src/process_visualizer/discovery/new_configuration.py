# SPDX-License-Identifier: BSD-3-Clause
"""New configurations, and the models written beside them."""
from __future__ import annotations

import os
import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Container, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import numpy as np

from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.confinement import confined, confined_arguments
from process_visualizer.cell.element_reader import read_xml
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.file_edit import (
    PoseEditError,
    PoseEditor,
    encoding_of,
    start_tags,
    tag_text,
    with_last,
    without,
)
from process_visualizer.cell.model import Cell, Device, Model, Pose
from process_visualizer.cell.stored_configuration import (
    MODEL_ENDINGS,
    StoredConfiguration,
    with_models_beside,
    write_configuration,
)
from process_visualizer.cell.trust import Origin, Provenance, trusted_packages
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.discovery.bag_look import look_into
from process_visualizer.discovery.draft import comment_lines, draft_text, element_lines, is_topic
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.model_search import ModelSearch
from process_visualizer.discovery.moving_frames import recorded_motions
from process_visualizer.discovery.process import (
    Process,
    StateNumber,
    proposed_process,
    recorded_states,
)
from process_visualizer.discovery.robot_topics import FoundModel
from process_visualizer.discovery.seen import FrameForest, Seen
from process_visualizer.discovery.topic_groups import device_topics
from process_visualizer.robot.description import (
    ModelError,
    describe_devices,
    load_robot_description,
    model_path,
)
from process_visualizer.robot.rotations import matrix_from_ypr

_REASON = 'as in the configuration of the recording'


def recorded_models(recording: Recording) -> Tuple[List[FoundModel], List[str]]:
    """Return the models of a recording's configuration, and remarks on unusable ones."""
    configuration = recorded_configuration(recording)
    if configuration is None:
        return [], []
    models: List[FoundModel] = []
    remarks = ['The recording holds the configuration that it was made with: "cell configuration" '
               'writes it.']
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        for device, model in _devices(configuration, folder, remarks):
            try:
                models.append(_found(device, model))
            except ModelError as error:
                remarks.append(f'The model of {device.name} cannot be used: {error}')
    return models, remarks


def _devices(configuration: StoredConfiguration, folder: str,
             remarks: List[str]) -> List[Tuple[Device, Model]]:
    try:
        path = write_configuration(configuration, folder)
        cell = XmlParser(configuration.arguments,
                         Provenance(Origin.BAG, folder)).parse(path)
    except (OSError, ConfigurationError) as error:
        remarks.append(f'That configuration cannot be read: {error}')
        return []
    return [(device, device.model) for device in cell.devices if device.model is not None]


def _found(device: Device, model: Model) -> FoundModel:
    description = load_robot_description(model_path(model), model.arguments,
                                         confined_to=model.confined_to)
    if not model.package:
        return FoundModel(f'/{device.name}', device.name, description, reason=_REASON,
                          prefix=model.prefix)
    return FoundModel(f'/{device.name}', device.name, description, model.package, model.path,
                      _REASON, model.arguments, model.prefix)


# A new configuration based on a stored one: that of a bag or of a running cell.

_SAME_M = _SAME_RAD = 1e-5


class StoredCell(NamedTuple):
    """The text of a configuration, the texts of files beside it by name, its cell and process."""

    text: str
    files: Dict[str, str]
    cell: Cell
    process: Optional[Process] = None


def from_stored(stored: StoredConfiguration, seen: Seen, source: str,
                origin: Origin = Origin.BAG, states: Sequence[StateNumber] = ()) -> StoredCell:
    """Return a stored configuration, with base frames at the poses observed last.

    ``source`` is a text that says where it was stored. Elements that would run or read something
    are left out, except nodes of packages that the user trusts; comments name the elements left
    out. If the configuration does not define a run, one is proposed from the recorded ``states``.

    Raises:
        ConfigurationError: the configuration is not valid on this machine.
        ValueError: its files or models cannot be used.
        OSError: the configuration cannot be written.
    """
    stored = with_models_beside(stored)
    beside = {path: os.path.relpath(path, os.path.dirname(stored.file)) for path in stored.files
              if path != stored.file}
    if any(name.startswith(os.pardir) for name in beside.values()):
        raise ValueError('it includes files that are not below its folder')
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        path = write_configuration(stored, folder)
        provenance = Provenance(origin, folder, trusted_packages())
        given = confined_arguments(stored.arguments, path, provenance)[0]
        left_out = _confine(path, folder, provenance, given)
        Path(path).write_bytes(_with_arguments(Path(path).read_bytes(), given))
        cell = XmlParser(provenance=provenance).parse(path)
        problems = describe_devices(cell.devices, cell.frame)[1]
        if problems or cell.ignored:
            raise ValueError(str([*problems, *cell.ignored][0]))
        models, without_meshes = _plain_models(cell)
        remarks = [_origin(stored, source), *left_out, *without_meshes,
                   *_with_seen_poses(cell, seen), *_not_named(cell, seen)]
        process = _process_of(cell, states)
        data = _with_comment(_with_process(Path(path).read_bytes(), process), remarks)
        beside_it = {name: os.path.realpath(os.path.join(os.path.dirname(path), name))
                     for name in beside.values()}
        files = {name: models[file] if file in models else _text(Path(file).read_bytes())
                 for name, file in beside_it.items()
                 if file in models or not file.endswith(MODEL_ENDINGS)}
    return StoredCell(_text(data), files, cell, process)


_EVALUATED = re.compile(r'\$+(?=[{(])')
"""The dollar signs of a xacro expression; one more makes xacro keep the text unchanged."""
_SAFE_NAME, _SAFE_VALUE = re.compile(r'\w+'), re.compile(r"[^'\"\\\\$\x00-\x1f]*")
"""Argument names and values that are safe in a Python expression."""
_NOT_GIVEN = '(not given)'


def _plain_models(cell: Cell) -> Tuple[Dict[str, str], List[str]]:
    """Return the texts of the models stored with a cell, by path, and remarks on missing parts.

    The new configuration belongs to the user, so its models will be read without limits. Therefore
    the texts are the results of reading the models with limits; nothing in them is evaluated again.

    Raises:
        ValueError: two devices need different texts of one file that cannot be combined.
    """
    variants: Dict[str, Dict[Tuple[Tuple[str, str], ...], str]] = {}
    remarks: List[str] = []
    for device in cell.devices:
        model = device.model
        if model is None or model.package:
            continue
        path = os.path.realpath(model_path(model))
        description = load_robot_description(path, model.arguments, confined_to=model.confined_to)
        variants.setdefault(path, {})[tuple(sorted(dict(model.arguments).items()))] = \
            description.text
        remarks += [f'The model of {device.name} had the mesh or texture "{it}", which is not in '
                    'an installed package.' for it in description.ignored]
    return {path: _one_text(os.path.basename(path), texts) for path, texts in variants.items()
            }, remarks


def _one_text(name: str, texts: Mapping[Tuple[Tuple[str, str], ...], str]) -> str:
    """Return one text that combines a model's texts for different arguments."""
    if not name.endswith('.xacro'):
        return next(iter(texts.values()))
    names = sorted({argument for given in texts for argument, _ in given})
    values = [value for given in texts for _, value in given] if len(texts) > 1 else []
    if not (all(map(_SAFE_NAME.fullmatch, names)) and all(map(_SAFE_VALUE.fullmatch, values))):
        raise ValueError(f'the arguments of {name} cannot be kept')
    plain = [(dict(given), ElementTree.fromstring(_EVALUATED.sub(r'\g<0>$', text)))
             for given, text in texts.items()]
    robot = ElementTree.Element('robot', plain[0][1].attrib)
    robot.set('xmlns:xacro', 'http://www.ros.org/wiki/xacro')
    for argument in names:
        ElementTree.SubElement(robot, 'xacro:arg', {'name': argument, 'default': _NOT_GIVEN})
    for given, root in plain:
        alike = ' and '.join(f"'$(arg {argument})' == '{given.get(argument, _NOT_GIVEN)}'"
                             for argument in names)
        part = robot if len(plain) == 1 else ElementTree.SubElement(
            robot, 'xacro:if', {'value': f'${{{alike}}}'})
        part.extend(root)
    return ElementTree.tostring(robot, 'unicode')


def _process_of(cell: Cell, states: Sequence[StateNumber]) -> Optional[Process]:
    """Return a process proposed from numbers of the cell's devices; None if the cell has one."""
    if cell.run is not None or cell.events:
        return None
    recorded = {topic.name for device in cell.devices for topic in device.topics if topic.record}
    labels = {(variable.topic, variable.field): variable.label for device in cell.devices
              for variable in device.variables}
    return proposed_process([
        replace(state, label=labels.get((state.topic, state.field), state.label))
        for state in states if (state.topic, state.field) in labels
        or state.topic in recorded and state.field == 'data'])


def _with_process(data: bytes, process: Optional[Process]) -> bytes:
    """Return the file with the elements of the process at its end."""
    if process is None:
        return data
    return with_last(data, ''.join(f'{line}\n' for element in process.elements
                                   for line in element_lines(element, '  ')))


def _confine(main: str, folder: str, provenance: Provenance,
             given: Mapping[str, str]) -> List[str]:
    """Remove untrusted elements from the files of a configuration; return remarks on them.

    Arguments that the main file passes to another file are unknown here: names that depend on them
    are checked when the configuration is parsed.
    """
    ignored: List[str] = []
    for path in sorted(Path(folder).rglob('*.xml')):
        found = confined(read_xml(str(path)), provenance, given if str(path) == main else {})
        path.write_bytes(without(path.read_bytes(), found.removals))
        ignored += [f'{path.name}:{it.location.line}: <{it.element}> {it.message}.'
                    for it in found.ignored]
    return ignored


def _origin(stored: StoredConfiguration, source: str) -> str:
    words = ' '.join(f'{name}:={value}' for name, value in stored.arguments.items())
    return (f'Made by "cell new" from {source}: the configuration {os.path.basename(stored.file)} '
            'as it was' + (f', run with {words}.' if words else '.'))


def _with_arguments(data: bytes, arguments: Mapping[str, str]) -> bytes:
    """Return the file with command-line values as the defaults of its arguments."""
    encoding = encoding_of(data)
    for name, value in arguments.items():
        for tag in start_tags(data):
            if tag.tag != 'arg' or tag.attributes.get('name') != name or 'value' in tag.attributes:
                continue
            written = tag_text(data, tag)
            begin, end = written.values.get('default', (written.end, written.end))
            new = _escaped(value)
            new = new if 'default' in written.values else f' default="{new}"'
            text = written.text[:begin] + new + written.text[end:]
            data = data[:tag.offset] + text.encode(encoding)
            break
    return data


def _escaped(value: str) -> str:
    for sign, entity in (('&', '&amp;'), ('<', '&lt;'), ('"', '&quot;'), ("'", '&apos;')):
        value = value.replace(sign, entity)
    return value


def _with_seen_poses(cell: Cell, seen: Seen) -> List[str]:
    """Write poses of base frames calibrated since then to the file; return remarks on changes."""
    forest, editor = FrameForest(seen.transforms), PoseEditor(cell)
    remarks = []
    for device in cell.devices:
        base = device.base
        pose = forest.pose(base.frame, cell.frame) if base is not None else None
        if base is None or pose is None or _are_same(pose, base.pose):
            continue
        try:
            editor.save(device.name, pose)
            remarks.append(f'The base frame of {device.name} is where it was calibrated to be.')
        except PoseEditError as error:
            remarks.append(f'The base frame of {device.name} was elsewhere: {error}')
    return remarks


def _are_same(one: Pose, other: Pose) -> bool:
    return bool(np.allclose(one.xyz, other.xyz, rtol=0.0, atol=_SAME_M) and np.allclose(
        matrix_from_ypr(one.ypr), matrix_from_ypr(other.ypr), rtol=0.0, atol=_SAME_RAD))


def _not_named(cell: Cell, seen: Seen) -> List[str]:
    named = {topic.name for device in cell.devices for topic in device.topics}
    own = tuple(f'/{device.name}/' for device in cell.devices)  # topics of its nodes
    others = [it.name for it in device_topics(seen.topics)
              if it.name not in named and not it.name.startswith(own)]
    return [f'It does not name these topics, which are there too: {", ".join(others)}.'] \
        if others else []


def _with_comment(data: bytes, remarks: Sequence[str]) -> bytes:
    """Return the file with a comment before its root."""
    offset = start_tags(data)[0].offset
    text = '\n'.join([*comment_lines(remarks, ''), ''])
    return data[:offset] + text.encode(encoding_of(data), 'replace') + data[offset:]


def _text(data: bytes) -> str:
    return data.decode('utf-8', 'surrogateescape')


class NewConfiguration(NamedTuple):
    """The texts of a configuration and of the models beside it, and a summary in words."""

    text: str
    models: Dict[str, str]
    summary: str


def new_configuration(seen: Seen, known: Sequence[FoundModel] = (),
                      search: Optional[ModelSearch] = None,
                      process: Optional[Process] = None) -> NewConfiguration:
    """Return a configuration for the observations; searches the packages for models.

    Models that are ``known`` are not searched for. ``process`` defines one run.

    Raises:
        ValueError: no device was seen.
    """
    search = search or ModelSearch()
    made = make_draft(seen, search.find(seen, known), process)
    made.draft.remarks.extend(search.remarks)
    if not made.draft.devices:
        advice = '; start the drivers first' if seen.is_moment else ''
        raise ValueError(f'{seen.where}: no device was seen, only what the program and ROS publish '
                         f'themselves{advice}')
    return NewConfiguration(draft_text(made.draft), made.models,
                            _summary([it.type for it in made.draft.devices], process))


def _summary(types: Sequence[str], process: Optional[Process]) -> str:
    counts = [(name, types.count(kind)) for kind, name in
              (('robot', 'robot'), ('depth_sensor', 'depth sensor'), ('other', 'other device'))]
    text = ', '.join(f'{count} {name}{"" if count == 1 else "s"}' for name, count in counts
                     if count)
    return text if process is None else f'{text}; {process.summary}'


_MAX_GAPS = 5


def from_bags(paths: Sequence[str]) -> NewConfiguration:
    """Return a configuration for a recording.

    Raises:
        BagError: the recording cannot be read.
        ValueError: the recording shows no device.
    """
    with Recording(paths) as recording:
        seen = look_into(recording)
        stored = recorded_configuration(recording)
        states = recorded_states(
            recording, [it.name for it in device_topics(seen.topics) if is_topic(it.name)])
        refused: List[str] = []
        if stored is not None:
            try:
                return of_stored(stored, seen, seen.where, states=states)
            except (ConfigurationError, ValueError, OSError) as error:
                refused = [f'The configuration in the recording is not used: {error}']
        models, of_models = recorded_models(recording)
        motions = recorded_motions(recording)
        of_bags = (*recording.remarks, *map(str, recording.gaps[:_MAX_GAPS]))
    remarks = (*refused, *(f'{it}.' for it in of_bags), *of_models,
               *(() if models else seen.remarks))
    try:
        return new_configuration(replace(seen, remarks=remarks), models,
                                 ModelSearch(motions=motions), proposed_process(states))
    except ValueError as error:
        raise ValueError('; '.join([str(error), *of_bags])) from None


def of_stored(stored: StoredConfiguration, seen: Seen, source: str,
              origin: Origin = Origin.BAG,
              states: Sequence[StateNumber] = ()) -> NewConfiguration:
    """Return a stored configuration, as far as it can be used: see from_stored.

    Raises:
        ConfigurationError, ValueError, OSError: the configuration cannot be used here.
    """
    made = from_stored(stored, seen, source, origin, states)
    return NewConfiguration(made.text, made.files, _summary(
        [it.type.value for it in made.cell.devices], made.process))


def write_new(new: NewConfiguration, path: str,
              may_overwrite: Optional[Container[str]] = ()) -> Tuple[str, ...]:
    """Write a configuration and its models; return their paths, the configuration first.

    Existing files are overwritten only if ``may_overwrite`` names them (None: all may be). An
    existing model with the same text is not an error.

    Raises:
        FileExistsError: one of the files exists and may not be overwritten.
        OSError: a file cannot be written.
    """
    folder = os.path.dirname(os.path.abspath(path))
    texts = {path: new.text, **{os.path.join(folder, name): text
                                for name, text in new.models.items()}}
    for file in texts if may_overwrite is not None else ():
        if file not in (may_overwrite or ()) and os.path.lexists(file) and (
                file == path or not _holds(file, texts[file])):
            raise FileExistsError(f'"{file}" already exists')
    for file, text in reversed(list(texts.items())):
        if file != path and os.path.dirname(file) != folder:
            os.makedirs(os.path.dirname(file), exist_ok=True)
        with open(file, 'w', encoding='utf-8', errors='surrogateescape', newline='') as stream:
            stream.write(text)
    return tuple(texts)


def _holds(file: str, text: str) -> bool:
    try:
        with open(file, encoding='utf-8', errors='surrogateescape', newline='') as stream:
            return stream.read() == text
    except OSError:
        return False
