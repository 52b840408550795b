# SPDX-License-Identifier: BSD-3-Clause
"""A new configuration that begins from one that there is: that of a bag, or of a cell that runs."""
from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Sequence

import numpy as np

from process_visualizer.cell.confinement import confined, confined_arguments
from process_visualizer.cell.editing.left_out import without
from process_visualizer.cell.editing.pose_edit import PoseEditError, PoseEditor
from process_visualizer.cell.editing.start_tags import encoding_of, start_tags, tag_text
from process_visualizer.cell.model import Cell, Pose
from process_visualizer.cell.provenance import Origin, Provenance
from process_visualizer.cell.stored_configuration import (
    StoredConfiguration,
    with_models_beside,
    write_configuration,
)
from process_visualizer.cell.trusted_packages import trusted_packages
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.cell.xml_reader import read_xml
from process_visualizer.descriptions.robot_description import describe_devices
from process_visualizer.discovery.draft_text import comment_lines
from process_visualizer.discovery.evidence.frame_forest import FrameForest
from process_visualizer.discovery.evidence.own_topics import device_topics
from process_visualizer.discovery.evidence.seen import Seen
from process_visualizer.motion.rotations import matrix_from_ypr

_SAME_M = _SAME_RAD = 1e-5


class StoredCell(NamedTuple):
    """The text of a configuration, those of the files beside it by name, and what it holds."""

    text: str
    files: Dict[str, str]
    cell: Cell


def from_stored(stored: StoredConfiguration, seen: Seen, source: str,
                origin: Origin = Origin.BAG) -> StoredCell:
    """Return a configuration as it was stored, with base frames where they were seen last.

    ``source`` says in words where it was stored. What it would run or read is left out, but nodes
    of packages that the user trusts; comments say what stood there.

    Raises:
        ConfigurationError: it is none on this machine.
        ValueError: its files or models cannot be used.
        OSError: it cannot be written.
    """
    stored = with_models_beside(stored)
    beside = {path: os.path.relpath(path, os.path.dirname(stored.file)) for path in stored.files
              if path != stored.file}
    if any(name.startswith(os.pardir) for name in beside.values()):
        raise ValueError('it includes files that are not below its folder')
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        path = write_configuration(stored, folder)
        provenance = Provenance(origin, folder, trusted_packages())
        left_out = _confine(folder, provenance)
        given = confined_arguments(stored.arguments, path, provenance)[0]
        Path(path).write_bytes(_with_arguments(Path(path).read_bytes(), given))
        cell = XmlParser(provenance=provenance).parse(path)
        problems = describe_devices(cell.devices, cell.frame)[1]
        if problems or cell.ignored:
            raise ValueError(str([*problems, *cell.ignored][0]))
        remarks = [_origin(stored, source), *left_out, *_with_seen_poses(cell, seen),
                   *_not_named(cell, seen)]
        data = _with_comment(Path(path).read_bytes(), remarks)
        files = {name: _text(Path(os.path.dirname(path), name).read_bytes())
                 for name in beside.values()}
    return StoredCell(_text(data), files, cell)


def _confine(folder: str, provenance: Provenance) -> List[str]:
    """Take what is not trusted out of the files of a configuration; say what it is."""
    ignored: List[str] = []
    for path in sorted(Path(folder).rglob('*.xml')):
        found = confined(read_xml(str(path)), provenance)
        path.write_bytes(without(path.read_bytes(), found.removals))
        ignored += [f'{path.name}:{it.location.line}: <{it.element}> {it.message}.'
                    for it in found.ignored]
    return ignored


def _origin(stored: StoredConfiguration, source: str) -> str:
    words = ' '.join(f'{name}:={value}' for name, value in stored.arguments.items())
    return (f'Made by "cell new" from {source}: the configuration {os.path.basename(stored.file)} '
            'as it was' + (f', run with {words}.' if words else '.'))


def _with_arguments(data: bytes, arguments: Mapping[str, str]) -> bytes:
    """The file with the values of the command line as the defaults of its arguments."""
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
    """Write base frames that were calibrated meanwhile into the file; what cannot be is told."""
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
    own = tuple(f'/{device.name}/' for device in cell.devices)  # what its nodes send
    others = [it.name for it in device_topics(seen.topics)
              if it.name not in named and not it.name.startswith(own)]
    return [f'It does not name these topics, which are there too: {", ".join(others)}.'] \
        if others else []


def _with_comment(data: bytes, remarks: Sequence[str]) -> bytes:
    """The file with a comment before its root."""
    offset = start_tags(data)[0].offset
    text = '\n'.join([*comment_lines(remarks, ''), ''])
    return data[:offset] + text.encode(encoding_of(data), 'replace') + data[offset:]


def _text(data: bytes) -> str:
    return data.decode('utf-8', 'surrogateescape')
