# SPDX-License-Identifier: BSD-3-Clause
"""Draft of a configuration: devices with the elements to be written to the file."""
from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field
from typing import (
    Collection,
    Dict,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    Optional,
    Sequence,
    Set,
    Tuple,
)
from xml.sax.saxutils import quoteattr

from process_visualizer.cell.elements import DEFAULT_FRAME
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.cell.outputs import outputs
from process_visualizer.cell.values import PATTERNS


@dataclass(frozen=True)
class DraftElement:
    """An element of a device; an element that is not ``active`` is written as a comment.

    ``comment`` is written before the element.
    """

    tag: str
    attributes: Dict[str, str]
    comment: str = ''
    active: bool = True
    children: Tuple['DraftElement', ...] = ()


@dataclass
class DraftDevice:
    """A device; ``type`` as in the configuration. ``comments`` are written before the device."""

    type: str
    name: str
    elements: List[DraftElement] = field(default_factory=list)
    comments: List[str] = field(default_factory=list)

    def add(self, tag: str, attributes: Dict[str, str], comment: str = '', active: bool = True,
            children: Tuple[DraftElement, ...] = ()) -> None:
        """Add an element at the end."""
        self.elements.append(DraftElement(tag, attributes, comment, active, children))

    def first(self, tag: str) -> Optional[DraftElement]:
        """Return the first active element with a tag, or None."""
        return next((it for it in self.elements if it.tag == tag and it.active), None)


@dataclass
class Draft:
    """A draft: devices, the global frame, and remarks for the user.

    ``process`` are the elements that define one run.
    """

    where: str
    frame: str = DEFAULT_FRAME
    process: List[DraftElement] = field(default_factory=list)
    devices: List[DraftDevice] = field(default_factory=list)
    remarks: List[str] = field(default_factory=list)


# A draft of a configuration as the text of its file.

_WIDTH = 96


def draft_text(draft: Draft) -> str:
    """Return the text of the file."""
    frame = '' if draft.frame == DEFAULT_FRAME else f' frame={quoteattr(draft.frame)}'
    head = [f'Made by "cell new" from {draft.where}. Remove what is not wanted, and check each '
            'comment.', *draft.remarks]
    lines = ['<?xml version="1.0" encoding="utf-8"?>', *comment_lines(head, ''),
             f'<visualizer{frame}>']
    for element in draft.process:
        lines += element_lines(element, '  ')
    for device in draft.devices:
        lines += _device(device)
    return '\n'.join([*lines, '</visualizer>', ''])


def _device(device: DraftDevice) -> Iterator[str]:
    yield from comment_lines(device.comments, '  ')
    opening = f'  <device type="{device.type}" name={quoteattr(device.name)}'
    if not device.elements:
        yield f'{opening} />'
        return
    yield f'{opening}>'
    for element in device.elements:
        yield from element_lines(element, '    ')
    yield '  </device>'


def element_lines(element: DraftElement, indent: str) -> Iterator[str]:
    """Yield the lines of an element, with its comment before it."""
    yield from comment_lines([element.comment] if element.comment else [], indent)
    if element.active:
        yield from _element(element, indent)
    else:
        yield from (f'{indent}<!-- {_safe(line)} -->' for line in _element(element, ''))


def _element(element: DraftElement, indent: str) -> Iterator[str]:
    words = ' '.join([element.tag, *(f'{name}={quoteattr(value)}'
                                     for name, value in element.attributes.items())])
    if not element.children:
        yield f'{indent}<{words} />'
        return
    yield f'{indent}<{words}>'
    for child in element.children:
        yield from _element(child, f'{indent}  ')
    yield f'{indent}</{element.tag}>'


def comment_lines(paragraphs: Sequence[str], indent: str) -> List[str]:
    """Return paragraphs as the lines of a comment; no lines without paragraphs."""
    lines = [line for paragraph in paragraphs
             for line in textwrap.wrap(_safe(paragraph), _WIDTH, break_long_words=False)]
    if len(lines) < 2:
        return [f'{indent}<!-- {line} -->' for line in lines]
    return [f'{indent}<!--', *(f'{indent}  {line}' for line in lines), f'{indent}-->']


def _safe(text: str) -> str:
    """Return the text as allowed in a comment: no double hyphens, no characters invalid in XML."""
    shown = ''.join(it if it.isprintable() and it not in '\ufffe\uffff' else '?' for it in text)
    return shown.replace('--', '-\u2010').rstrip('-')


# Names derived from others: devices named after namespaces, and words that names share.

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
    """Return a valid device name close to a text, such as the end of a namespace."""
    name = re.sub('[^A-Za-z0-9_]+', '_', text).strip('_')
    if not name:
        return default
    return name if name[0].isalpha() else f'{default}_{name}'


def free_name(wanted: str, taken: Collection[str], ending: str = '') -> str:
    """Return the wanted name, or a similar one if it is taken."""
    names = [wanted, *([f'{wanted}_{ending}'] if ending else [])]
    number = 2
    while names[0] in taken:
        names.pop(0)
        if not names:
            names.append(f'{wanted}_{number}')
            number += 1
    return names[0]


def words(name: str) -> FrozenSet[str]:
    """Return the distinctive words of a name, in lower case."""
    parts = re.split('[/_.-]+', re.sub('([a-z])([A-Z])', r'\1_\2', name))
    return frozenset(part.lower() for part in parts) - _NO_WORDS


_ENDINGS: Dict[str, str] = {'robot': 'robot', 'depth_sensor': 'sensor', 'other': 'device'}
_NOWHERE = Location('', 0)


class CellNames:
    """Assigns unique names."""

    def __init__(self, topics: Iterable[str], frames: Iterable[str]) -> None:
        """Initialize with all drivers' topics and descriptions, and the frames of all models."""
        self._topics = set(topics)
        self._frames: Set[str] = set(frames)
        self._devices: Set[str] = set()

    def device(self, kind: str, wanted: str) -> str:
        """Return a free device name close to the wanted one, whose outputs were not observed."""
        name = device_name(wanted, kind)
        taken = set(self._devices)
        while True:
            found = free_name(name, taken, _ENDINGS[kind])
            if not _outputs(found) & self._topics:
                self._devices.add(found)
                return found
            taken.add(found)

    def frame(self, wanted: str) -> str:
        """Return a free frame name, if possible the wanted one."""
        found = free_name(wanted, self._frames)
        self._frames.add(found)
        return found

    def is_free(self, frame: str) -> bool:
        """Return whether no device has this frame."""
        return frame not in self._frames


def _outputs(name: str) -> Set[str]:
    """Return the topics that the program may publish for a device of that name, of any type."""
    return {topic for kind in DeviceType for topic in outputs([Device(kind, name, _NOWHERE)])} \
        | {f'/{name}/marker_array', f'/{name}/robot_description'}
