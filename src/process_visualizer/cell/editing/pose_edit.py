# SPDX-License-Identifier: BSD-3-Clause
"""Writes poses of base frames and tools, and boxes, into the configuration file."""
from __future__ import annotations

import hashlib
import math
import os
import re
import stat
import tempfile
from pathlib import Path
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional

from process_visualizer.cell.editing.number_text import number_text
from process_visualizer.cell.editing.start_tags import (
    StartTag,
    TagText,
    encoding_of,
    start_tags,
    tag_text,
)
from process_visualizer.cell.editing.tool_edit import with_tool
from process_visualizer.cell.errors import Location, quoted
from process_visualizer.cell.model import BaseFrame, Cell, Pose, RegionOfInterest, Vector3

_WORD = re.compile(r'\S+')


class PoseEditError(ValueError):
    """A pose was not written; the text says where, why, and what to do."""


class SavedPose(NamedTuple):
    """A file that was changed, and the backup beside it; ``digest`` is that of the new content."""

    file: str
    backup: str
    digest: str


class PoseEditor:
    """Edits the files of a configuration that has just been parsed.

    Only numbers change in a file, and <tool> is added: comments, layout, quotes, encoding and line
    ends stay. A file that has been changed in the meantime is not touched.
    """

    def __init__(self, cell: Cell) -> None:
        """``cell`` must have been parsed just now.

        Raises:
            PoseEditError: a file can no longer be read.
        """
        self._cell = cell
        self._digests = {os.path.abspath(file): _digest(_read(file)) for file in cell.files}

    def save(self, device: str, pose: Pose) -> Optional[SavedPose]:
        """Write the pose of a device's base frame; None if the file already has it.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        return self._save_element(device, 'base', self._base(device).location,
                                  lambda data, tag: with_pose(data, tag, pose))

    def save_region(self, device: str, region: RegionOfInterest) -> Optional[SavedPose]:
        """Write the centre and the edge lengths of a depth sensor's box; None if they are there.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        found = self._cell.device(device)
        if found.roi is None:
            raise PoseEditError(f'{found.location}: the device "{device}" has no <roi> any more')
        return self._save_element(device, 'roi', found.roi.location, lambda data, tag: with_vectors(
            data, tag, {'xyz': region.center, 'size': region.size}))

    def _save_element(self, device: str, name: str, here: Location,
                      change: Callable[[bytes, StartTag], bytes]) -> Optional[SavedPose]:
        data = self._unchanged(here)
        tag = self._tag(device, name, here, data)
        try:
            changed = change(data, tag)
        except ValueError as error:
            raise PoseEditError(f'{here}: <{name}>: {error}') from error
        return None if changed == data else self._save(here.file, data, changed)

    def save_tool(self, device: str, frame: str, pose: Pose) -> SavedPose:
        """Write the tool of a robot that has none in the file: its pose in a frame.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        found = self._cell.device(device)
        here = found.location
        data = self._unchanged(here)
        tags = [tag for tag in start_tags(data) if (tag.tag, tag.line) == ('device', here.line)]
        shared = [it.name for it in self._cell.devices if it.location == here]
        if found.tool is not None or len(tags) != 1 or len(shared) != 1:
            raise PoseEditError(f'{here}: the device "{device}" has a <tool>, or its start tag is '
                                'shared by several devices; edit it by hand')
        try:
            return self._save(here.file, data, with_tool(data, tags[0], frame, pose))
        except ValueError as error:
            raise PoseEditError(f'{here}: <device>: {error}') from error

    def _save(self, file: str, before: bytes, after: bytes) -> SavedPose:
        saved = _replace(file, before, after)
        self._digests[os.path.abspath(saved.file)] = saved.digest
        return saved

    def revert(self, saved: SavedPose) -> None:
        """Restore a file as it was before it was saved, and remove the backup.

        Raises:
            PoseEditError: the file has been changed since, or the backup cannot be read.
        """
        if _digest(_read(saved.file)) != saved.digest:
            raise PoseEditError(f'{saved.file}: has been changed since the pose was saved; '
                                f'the previous version is in {saved.backup}')
        before = _read(saved.backup)
        _write(saved.file, before)
        os.remove(saved.backup)
        self._digests[os.path.abspath(saved.file)] = _digest(before)

    def _base(self, device: str) -> BaseFrame:
        found = self._cell.device(device)
        if found.base is None:
            raise PoseEditError(f'{found.location}: the device "{device}" has no <base>; add '
                                f'<base frame="{device}/base" />')
        return found.base

    def _unchanged(self, location: Location) -> bytes:
        data = _read(location.file)
        if self._digests.get(os.path.abspath(location.file)) != _digest(data):
            raise PoseEditError(f'{location.file}: has been changed since it was loaded; '
                                'load the configuration again')
        return data

    def _tag(self, device: str, name: str, here: Location, data: bytes) -> StartTag:
        """The start tag of a <base> or <roi> that is not shared with another device."""
        tags = [tag for tag in start_tags(data) if (tag.tag, tag.line) == (name, here.line)]
        if len(tags) > 1:
            tags = [tag for tag in tags if tag.parent.get('name') == device]
            if len(tags) != 1:
                raise PoseEditError(f'{here}: the line has several <{name}>; put each on a line of '
                                    'its own')
        elif len(sharing := self._sharing(name, here)) > 1:
            raise PoseEditError(f'{here}: this <{name}> is shared by {" and ".join(sharing)}, as '
                                'the file is included more than once; edit it by hand')
        return tags[0]

    def _sharing(self, name: str, location: Location) -> List[str]:
        elements = [(it.name, it.base if name == 'base' else it.roi) for it in self._cell.devices]
        return [device for device, element in elements
                if element is not None and element.location == location]


def with_pose(data: bytes, tag: StartTag, pose: Pose) -> bytes:
    """Return a document with a new pose in a ``<base>``; all other bytes stay.

    Numbers that are equal when rounded to DECIMALS are left as written; a missing attribute is
    added only if it is not zero.

    Raises:
        ValueError: the pose cannot be written there; the text says why.
    """
    angles = 'rpy' if 'rpy' in tag.attributes else 'ypr'
    return with_vectors(data, tag, {'xyz': pose.xyz, angles: pose.ypr})


def with_vectors(data: bytes, tag: StartTag, vectors: Mapping[str, Vector3]) -> bytes:
    """Return a document with other numbers in attributes of an element, as `with_pose` does.

    Raises:
        ValueError: they cannot be written there; the text says why.
    """
    if not all(math.isfinite(number) for vector in vectors.values() for number in vector):
        raise ValueError('finite numbers are needed')
    written = tag_text(data, tag)
    edits = {name: _edited(tag, written, name, vector) for name, vector in vectors.items()}
    text = _with_values(written, edits)
    encoding = encoding_of(data)
    result = data[:tag.offset] + text.encode(encoding)
    _check(data, result, tag, edits)
    return result


def _edited(tag: StartTag, written: TagText, name: str, vector: Vector3) -> str:
    """The new text of an attribute; empty if it is missing and not needed."""
    value = tag.attributes.get(name)
    new = [number_text(part) for part in vector]
    if value is None:
        return '' if new == ['0', '0', '0'] else ' '.join(new)
    if '$(' in value:
        raise ValueError(f'{name}={quoted(value)} comes from a substitution argument; change '
                         'that, or write numbers in its place')
    raw = written.text[slice(*written.values[name])]
    if raw.split() != value.split() or len(raw.split()) != 3:
        raise ValueError(f'{name}={quoted(raw)} is not written as three plain numbers; write '
                         f'"{" ".join(new)}"')
    parts = iter(new)
    return _WORD.sub(lambda word: _kept_or(word.group(), next(parts)), raw)


def _kept_or(old: str, new: str) -> str:
    return old if number_text(float(old)) == new else new


def _with_values(written: TagText, edits: Dict[str, str]) -> str:
    added = ''.join(f' {name}="{value}"' for name, value in edits.items()
                    if value and name not in written.values)
    text = written.text[:written.end] + added + written.text[written.end:]
    present = [name for name in edits if name in written.values]
    for name in sorted(present, key=lambda it: written.values[it], reverse=True):
        begin, end = written.values[name]
        text = text[:begin] + edits[name] + text[end:]
    return text


def _check(before: bytes, after: bytes, tag: StartTag, edits: Dict[str, str]) -> None:
    """Make sure that only the attributes have changed, whatever the file looks like."""
    if len(start_tags(before)) != len(start_tags(after)):
        raise ValueError('it cannot be changed without other changes; edit it by hand')
    for old, new in zip(start_tags(before), start_tags(after)):
        expected = dict(old.attributes)
        if old.offset == tag.offset:
            expected.update({name: ' '.join(value.split()) for name, value in edits.items()
                             if value})
            new = new._replace(attributes={name: ' '.join(value.split()) if name in edits else value
                                           for name, value in new.attributes.items()})
        if (new.tag, new.line, new.attributes) != (old.tag, old.line, expected):
            raise ValueError('it cannot be changed without other changes; edit it by hand')


def _replace(path: str, before: bytes, after: bytes) -> SavedPose:
    real = os.path.realpath(path)
    backup = _write_backup(real, before)
    try:
        _write(real, after)
    except PoseEditError:
        os.remove(backup)
        raise
    return SavedPose(path, backup, _digest(after))


def _write_backup(path: str, data: bytes) -> str:
    """Write a backup under the first name that is free."""
    number = 0
    while True:
        backup = f'{path}.bak{number or ""}'
        try:
            with open(backup, 'xb') as file:
                file.write(data)
                os.fchmod(file.fileno(), stat.S_IMODE(os.stat(path).st_mode))
            return backup
        except FileExistsError:
            number += 1
        except OSError as error:
            raise PoseEditError(f'{backup}: the backup cannot be written: {error.strerror}; '
                                'the configuration stays as it was') from error


def _write(path: str, data: bytes) -> None:
    """Replace a file (not a link to it) in one step; its permissions stay."""
    real = os.path.realpath(path)
    folder, name = os.path.split(real)
    try:
        descriptor, unfinished = tempfile.mkstemp(prefix=f'.{name}.', dir=folder)
        try:
            with open(descriptor, 'wb') as file:
                file.write(data)
                os.fchmod(file.fileno(), stat.S_IMODE(os.stat(real).st_mode))
                file.flush()
                os.fsync(file.fileno())
            os.replace(unfinished, real)
        except BaseException:
            os.remove(unfinished)
            raise
    except OSError as error:
        raise PoseEditError(f'{path}: cannot be written: {error.strerror}; it stays as it was'
                            ) from error


def _read(path: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise PoseEditError(f'{path}: cannot be read: {error.strerror}') from error


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
