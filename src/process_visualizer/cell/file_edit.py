# SPDX-License-Identifier: BSD-3-Clause
"""Edits the text of a configuration file, leaving everything else in it unchanged."""
from __future__ import annotations

import codecs
import hashlib
import math
import os
import re
import stat
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from process_visualizer.cell.confinement import Removal
from process_visualizer.cell.errors import Location, quoted
from process_visualizer.cell.model import BaseFrame, Cell, Pose, RegionOfInterest, Vector3
from process_visualizer.whole_file import whole_file

# Finds start tags and their attributes in the bytes of an XML file.

_BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, 'utf-8'), (codecs.BOM_UTF16_LE, 'utf-16-le'),
                     (codecs.BOM_UTF16_BE, 'utf-16-be'))
_NAME = re.compile(r'<[^\s/>]+')
_ATTRIBUTE = re.compile(r'\s+([^\s=/>]+)\s*=\s*("[^"]*"|\'[^\']*\')')


class StartTag(NamedTuple):
    """A start tag: its values as parsed from XML, its line (from 1), and its first byte.

    ``parent`` has the attributes of the enclosing element.
    """

    tag: str
    attributes: Dict[str, str]
    line: int
    offset: int
    parent: Dict[str, str]


class TagText(NamedTuple):
    """The text from a start tag onward, with start and end of each value inside its quotes.

    ``end`` is the position after the last attribute, where another can be inserted.
    """

    text: str
    values: Dict[str, Tuple[int, int]]
    end: int


def start_tags(data: bytes) -> List[StartTag]:
    """Return all start tags of a document in order.

    Raises:
        ValueError: the document is not well-formed.
    """
    parser = expat.ParserCreate()
    found: List[StartTag] = []
    around: List[Dict[str, str]] = [{}]

    def start(tag: str, attributes: Dict[str, str]) -> None:
        found.append(StartTag(tag, attributes, parser.CurrentLineNumber, parser.CurrentByteIndex,
                              around[-1]))
        around.append(attributes)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _tag: around.pop()
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:
        raise ValueError(f'it is not well-formed: {error}') from error
    return found


def encoding_of(data: bytes) -> str:
    """Return the name of the encoding of a well-formed document."""
    for mark, name in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return name
    declared: List[Optional[str]] = []
    parser = expat.ParserCreate()
    parser.XmlDeclHandler = lambda _version, encoding, _standalone: declared.append(encoding)
    parser.Parse(data, True)
    return (declared[0] if declared else None) or 'utf-8'


def tag_text(data: bytes, tag: StartTag) -> TagText:
    """Return the text of a start tag.

    Raises:
        ValueError: the parts of the tag cannot be found in the bytes.
    """
    text = data[tag.offset:].decode(encoding_of(data))
    name = _NAME.match(text)
    if name is None:
        raise ValueError('there is no start tag where one is expected')
    values: Dict[str, Tuple[int, int]] = {}
    end = name.end()
    attribute = _ATTRIBUTE.match(text, end)
    while attribute:
        begin, end = attribute.span(2)
        values[attribute.group(1)] = begin + 1, end - 1
        attribute = _ATTRIBUTE.match(text, end)
    if values.keys() != tag.attributes.keys():
        raise ValueError('its attributes cannot be distinguished')
    return TagText(text, values, end)


DECIMALS = 6
"""Decimals of meters and radians: a resolution of one micrometer."""


def number_text(value: float) -> str:
    """Return a number as text with at most DECIMALS decimals, such as 0.1 or -3; never -0."""
    text = f'{round(value, DECIMALS) + 0.0:.{DECIMALS}f}'  # -0.0 + 0.0 is 0.0
    return text.rstrip('0').rstrip('.')


# Writes the elements <tool> of a robot and <expected> of a sensor into the text of a configuration.

_TAG_END = re.compile(r'\s*(/?)>')
_REST_OF_LINE = re.compile(r'[ \t]*(<!--(?:(?!-->)[^\n])*-->)?[ \t]*(?=\r?\n)')
_INDENT = re.compile(r'(\r?\n)([ \t]*)$')
_CHILD = re.compile(r'\r?\n([ \t]*)<')
_LINE = re.compile(r'^([ \t]*)<', re.MULTILINE)


def tool_element(frame: str, pose: Pose) -> str:
    """Return the text of the element."""
    parts = [f'frame={quoteattr(frame)}']
    for name, vector in (('xyz', pose.xyz), ('ypr', pose.ypr)):
        numbers = [number_text(value) for value in vector]
        if numbers != ['0', '0', '0']:
            parts.append(f'{name}="{" ".join(numbers)}"')
    return f'<tool {" ".join(parts)} />'


def expected_element(box: RegionOfInterest, global_frame: str) -> str:
    """Return the element as it is written."""
    parts = [] if box.frame == global_frame else [f'frame={quoteattr(box.frame)}']
    parts += [f'{name}="{" ".join(map(number_text, vector))}"'
              for name, vector in (('xyz', box.center), ('size', box.size))]
    return f'<expected {" ".join(parts)} />'


def with_elements(data: bytes, parent: StartTag, elements: Sequence[str]) -> bytes:
    """Return a document with empty elements inserted as the first ones of another element.

    An empty ``parent`` gets an end tag; all other bytes stay.

    Raises:
        ValueError: they cannot be inserted there; the text says why.
    """
    encoding = encoding_of(data)
    written = tag_text(data, parent)
    end = _TAG_END.match(written.text, written.end)
    if end is None:
        raise ValueError(f'the end of its start tag cannot be found; write {" ".join(elements)} '
                         'by hand')
    start, after = written.text[:written.end], written.text[end.end():]
    before = data[:parent.offset].decode(encoding)
    if end.group(1):
        indent = _INDENT.search(before)
        new = ''.join(_own_line(before, '', it) for it in elements)
        text = f'{start}>{new}{"" if indent is None else indent.group()}</{parent.tag}>{after}'
    else:
        rest = _REST_OF_LINE.match(after)
        place = 0 if rest is None else rest.end()
        new = ''.join(it if rest is None else _own_line(before, after[place:], it)
                      for it in elements)
        text = start + end.group() + after[:place] + new + after[place:]
    result = data[:parent.offset] + text.encode(encoding)
    _check_added(start_tags(data), start_tags(result), parent, elements)
    return result


def _own_line(before: str, after: str, element: str) -> str:
    """Return the element on a separate line, indented like the next one, or by the usual depth."""
    indent, child = _INDENT.search(before), _CHILD.match(after)
    if indent is None:
        return element
    line_end, own = indent.group(1), indent.group(2)
    if child is not None and len(child.group(1)) > len(own):
        return f'{line_end}{child.group(1)}{element}'
    outer = next((it for it in reversed(_LINE.findall(before)) if len(it) < len(own)), None)
    step = '  ' if outer is None or not own.startswith(outer) else own[len(outer):]
    return f'{line_end}{own}{step}{element}'


def _check_added(before: List[StartTag], after: List[StartTag], parent: StartTag,
                 elements: Sequence[str]) -> None:
    """Check that only the elements are new, whatever the layout of the file."""
    def contents(tags: List[StartTag]) -> List[Tuple[Any, ...]]:
        return [(tag.tag, tag.attributes, tag.parent) for tag in tags]

    begin = [tag.offset for tag in before].index(parent.offset) + 1
    end = begin + len(elements)
    wanted = [(tag.tag, tag.attributes, parent.attributes) for element in elements
              for tag in start_tags(element.encode())]
    if contents(after[begin:end]) != wanted \
            or contents(after[:begin] + after[end:]) != contents(before):
        raise ValueError('it cannot be changed without other changes; edit it by hand')


# Writes boxes and the poses of base frames and tools into the configuration file.

_WORD = re.compile(r'\S+')


class PoseEditError(ValueError):
    """Raised if a pose was not written; the text says where, why, and what to do."""


class SavedPose(NamedTuple):
    """A changed file and the backup beside it; ``digest`` is the digest of the new content."""

    file: str
    backup: str
    digest: str


class PoseEditor:
    """Edits the files of a configuration that has just been parsed.

    Only numbers change in a file, and <tool> and <expected> are added: comments, layout, quotes,
    encoding and line ends stay. A file that has been changed in the meantime is not touched.
    """

    def __init__(self, cell: Cell) -> None:
        """Initialize with a cell that has just been parsed.

        Raises:
            PoseEditError: a file can no longer be read.
        """
        self._cell = cell
        self._digests = {os.path.abspath(file): _digest(_read(file)) for file in cell.files}

    def save(self, device: str, pose: Pose) -> Optional[SavedPose]:
        """Write the pose of a device's base frame; return None if the file already has it.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        return self._save_element(device, 'base', self._base(device).location,
                                  lambda data, tag: with_pose(data, tag, pose))

    def save_region(self, device: str, region: RegionOfInterest) -> Optional[SavedPose]:
        """Write center and edge lengths of a depth sensor's box; return None if the file has them.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        found = self._cell.device(device)
        if found.roi is None:
            raise PoseEditError(f'{found.location}: the device "{device}" no longer has a <roi>')
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
        """Write the tool (its pose in a frame) of a robot without one in the file.

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
            changed = with_elements(data, tags[0], [tool_element(frame, pose)])
            return self._save(here.file, data, changed)
        except ValueError as error:
            raise PoseEditError(f'{here}: <device>: {error}') from error

    def save_expected(self, device: str, boxes: Sequence[RegionOfInterest]) -> Optional[SavedPose]:
        """Add boxes of expected objects to a depth sensor; return None without boxes.

        Raises:
            KeyError: there is no such device.
            PoseEditError: nothing is written.
        """
        found = self._cell.device(device)
        if found.objects is None:
            raise PoseEditError(f'{found.location}: the device "{device}" no longer has <objects>')
        if not boxes:
            return None
        elements = [expected_element(box, self._cell.frame) for box in boxes]
        return self._save_element(device, 'objects', found.objects.location,
                                  lambda data, tag: with_elements(data, tag, elements))

    def _save(self, file: str, before: bytes, after: bytes) -> SavedPose:
        saved = _replace(file, before, after)
        self._digests[os.path.abspath(saved.file)] = saved.digest
        return saved

    def revert(self, saved: SavedPose) -> None:
        """Restore a file to its state before the save, and remove the backup.

        Raises:
            PoseEditError: the file has been changed since, or the backup cannot be read.
        """
        if _digest(_read(saved.file)) != saved.digest:
            raise PoseEditError(f'{saved.file}: has been changed since it was saved; '
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
        """Return the start tag of an element that is not shared with another device."""
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
        """Return the devices that share the same <base>, <roi> or <objects>."""
        elements = [(it.name, getattr(it, name)) for it in self._cell.devices]
        return [device for device, element in elements
                if element is not None and element.location == location]


def with_pose(data: bytes, tag: StartTag, pose: Pose) -> bytes:
    """Return a document with a new pose in a ``<base>``; all other bytes stay the same.

    Numbers that are equal when rounded to DECIMALS are left as written; a missing attribute is
    added only if it is not zero.

    Raises:
        ValueError: the pose cannot be written; the text says why.
    """
    angles = 'rpy' if 'rpy' in tag.attributes else 'ypr'
    return with_vectors(data, tag, {'xyz': pose.xyz, angles: pose.ypr})


def with_vectors(data: bytes, tag: StartTag, vectors: Mapping[str, Vector3]) -> bytes:
    """Return a document with new numbers in attributes of an element, as `with_pose` does.

    Raises:
        ValueError: the numbers cannot be written; the text says why.
    """
    if not all(math.isfinite(number) for vector in vectors.values() for number in vector):
        raise ValueError('finite numbers are needed')
    written = tag_text(data, tag)
    edits = {name: _edited(tag, written, name, vector) for name, vector in vectors.items()}
    text = _with_values(written, edits)
    encoding = encoding_of(data)
    result = data[:tag.offset] + text.encode(encoding)
    _check_attributes(data, result, tag, edits)
    return result


def _edited(tag: StartTag, written: TagText, name: str, vector: Vector3) -> str:
    """Return the new text of an attribute; empty if it is missing and not needed."""
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


def _check_attributes(before: bytes, after: bytes, tag: StartTag, edits: Dict[str, str]) -> None:
    """Check that only the attributes have changed, whatever the layout of the file."""
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
    """Write a backup under the first free name."""
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
    """Replace a file atomically, keeping its permissions and any link to it."""
    try:
        with whole_file(path) as unfinished:
            Path(unfinished).write_bytes(data)
            os.chmod(unfinished, stat.S_IMODE(os.stat(path).st_mode))
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


_MAX_LENGTH = 200


class _Cut(NamedTuple):
    begin: int
    end: int
    text: bytes


def without(data: bytes, removals: Sequence[Removal]) -> bytes:
    """Return the bytes of a file without some of its elements and attributes.

    Raises:
        ValueError: the elements or attributes cannot be found in the bytes.
    """
    tags = {tag.offset: tag for tag in start_tags(data)}
    ends = _ends(data)
    cuts: List[_Cut] = []
    for removal in removals:
        tag = tags.get(removal.offset)
        if tag is None:
            raise ValueError('an element cannot be found in the file')
        cuts.append(_attribute(data, tag, removal.attribute) if removal.attribute
                    else _element(data, tag, ends[tag.offset]))
    for cut in sorted(cuts, reverse=True):
        data = data[:cut.begin] + cut.text + data[cut.end:]
    return data


def _ends(data: bytes) -> Dict[int, int]:
    """Return, by element start, where its end tag begins (or where an empty element ends)."""
    parser = expat.ParserCreate()
    begun: List[int] = []
    ends: Dict[int, int] = {}
    parser.StartElementHandler = lambda *_: begun.append(parser.CurrentByteIndex)
    parser.EndElementHandler = lambda _: ends.update({begun.pop(): parser.CurrentByteIndex})
    parser.Parse(data, True)
    return ends


def with_last(data: bytes, text: str) -> bytes:
    """Return a document with further elements at the end of its root, given as whole lines.

    Raises:
        ValueError: it is not well-formed, or the root has no end tag (``<visualizer />``).
    """
    root = start_tags(data)[0]
    end, encoding = _ends(data)[root.offset], encoding_of(data)
    if not data.startswith('</'.encode(encoding), end):
        raise ValueError('the root has no end tag before which anything could be written')
    return data[:end] + text.encode(encoding, 'xmlcharrefreplace') + data[end:]


def _parts(data: bytes, tag: StartTag) -> Tuple[str, str]:
    """Return the start tag up to its last attribute, and the text that follows."""
    if not data[tag.offset:].startswith(b'<'):
        raise ValueError('its encoding has other bytes than ASCII')
    text = tag_text(data, tag)
    return text.text[:text.end], text.text[text.end:]


def _element(data: bytes, tag: StartTag, end: int) -> _Cut:
    start, rest = _parts(data, tag)
    if not rest.lstrip().startswith('/>'):
        end = data.index(b'>', end) + 1
    shown = re.sub('-(?=-)|-$', '- ', ' '.join(start.split())[:_MAX_LENGTH])
    comment = f'<!-- left out, as it was in a recording: {shown}> -->'
    return _Cut(tag.offset, end, comment.encode(encoding_of(data), 'replace'))


def _attribute(data: bytes, tag: StartTag, name: str) -> _Cut:
    text = tag_text(data, tag)
    encoding = encoding_of(data)
    begin, end = text.values[name]
    before = re.sub(rf'\s+{re.escape(name)}\s*=\s*["\']\Z', '', text.text[:begin])
    start = tag.offset + len(before.encode(encoding))
    return _Cut(start, tag.offset + len(text.text[:end + 1].encode(encoding)), b'')
