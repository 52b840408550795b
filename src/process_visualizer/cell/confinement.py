# SPDX-License-Identifier: BSD-3-Clause
"""Confinement: removes everything from an untrusted configuration that could run or read something.

This module alone decides what is removed. It works on the elements before any value is resolved, so
that no later step ever sees the removed parts of a recorded configuration. Only names and types of
parameters are checked after their arguments are resolved.
"""
from __future__ import annotations

import re
from dataclasses import replace
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple

import yaml

from process_visualizer.cell.arguments import read_arguments
from process_visualizer.cell.element_reader import Element
from process_visualizer.cell.elements import PROPERTY_LIMITS
from process_visualizer.cell.errors import Location, Problem, ProblemList, shortened
from process_visualizer.cell.substitution import Arguments, substitute
from process_visualizer.cell.trust import Provenance, in_a_package, is_below
from process_visualizer.cell.values import plain_yaml

_RESOLVED = re.compile(r'\$\((?:arg\s+\w+|dirname)\)')
"""Substitutions that are resolved; any other could run code or reveal secrets of this computer."""
_FIND_PACKAGE = re.compile(r'\$\(find\s+[\w-]+\)')
_NODE_ATTRIBUTES = ('pkg', 'type', 'name', 'ns', 'output', 'ifstate', 'if', 'unless')
_LAUNCH_ATTRIBUTES = ('pkg', 'type', 'ifstate', 'if', 'unless')
_READS_OR_RUNS = ('command', 'textfile', 'binfile')
_NOT_PLAIN = re.compile(r'[!(&*]')
"""YAML syntax that is refused: tags and angles, which rosparam evaluates, and references, which
can multiply data."""
_NEVER = {'machine': 'nodes run on this computer only',
          'env': 'it changes how programs run',
          'remap': 'only what this program generates is started'}
_ADVICE = 'write it into a configuration of your own, and name that with --config'


class Removal(NamedTuple):
    """A part to remove from a file: the element that begins at a byte, or one of its attributes."""

    offset: int
    attribute: str = ''


class Confined(NamedTuple):
    """The remaining elements of a file, and the ignored parts: where, what, why, and what to do.

    ``removals`` locates the ignored parts in the bytes of the file.
    """

    root: Element
    ignored: Tuple[Problem, ...] = ()
    removals: Tuple[Removal, ...] = ()


def confined(root: Element, provenance: Provenance, given: Mapping[str, str]) -> Confined:
    """Return a file's elements without those that are not allowed for this provenance.

    ``given`` are the values given for the file's arguments.
    """
    if not provenance.is_data:
        return Confined(root)
    declared = [it for it in root.children if it.tag == 'arg' and not _unresolvable(it)]
    work = _Confinement(provenance, read_arguments(replace(root, children=declared), given,
                                            ProblemList()))
    return Confined(work.kept(root), tuple(work.ignored), tuple(work.removals))


def confined_arguments(given: Mapping[str, str], path: str, provenance: Provenance
                       ) -> Tuple[Dict[str, str], Tuple[Problem, ...]]:
    """Return the values given for arguments, without those that would be substituted again."""
    if not provenance.is_data:
        return dict(given), ()
    kept = {name: value for name, value in given.items() if '$' not in value}
    return kept, tuple(
        _problem(Location(path, 1), 'arg', f'the value of "{name}" is ignored in '
                 f'{_origin_words(provenance)}: it would be resolved once more')
        for name in given if name not in kept)


def refused_include(path: str, location: Location, provenance: Provenance) -> Optional[Problem]:
    """Return a problem if data includes a file that is neither its own nor in a package."""
    if not provenance.is_data or is_below(path, provenance.folder) or in_a_package(path):
        return None
    return _problem(location, 'include', f'"{shortened(path)}" is ignored in '
                    f'{_origin_words(provenance)}: it is neither one of its files nor one of an '
                    'installed package')


class _Confinement:
    """Walks over the elements of one file and collects the ignored parts."""

    def __init__(self, provenance: Provenance, arguments: Arguments) -> None:
        self.ignored: List[Problem] = []
        self.removals: List[Removal] = []
        self._provenance = provenance
        self._arguments = arguments

    def kept(self, element: Element) -> Element:
        """Return the element without the attributes and children that are ignored."""
        attributes = dict(element.attributes)
        for name in self._extra_attributes(element):
            del attributes[name]
            self._ignore(element, f'"{name}" is ignored: only its package is trusted, not what '
                                  f'{_origin_words(self._provenance)} lets it do', name)
        if element.tag == 'device' and attributes.pop('machine', None) is not None:
            self._ignore(element, f'"machine" is ignored: {_NEVER["machine"]}', 'machine')
        children = []
        for child in element.children:
            reason = self._refusal(child, element)
            if reason:
                self._ignore(child, reason)
            else:
                children.append(self.kept(child))
        return replace(element, attributes=attributes, children=children)

    def _extra_attributes(self, element: Element) -> List[str]:
        allowed = {'node': _NODE_ATTRIBUTES, 'launch': _LAUNCH_ATTRIBUTES}.get(element.tag)
        return [] if allowed is None else [it for it in element.attributes if it not in allowed]

    def _refusal(self, element: Element, parent: Element) -> str:
        """Return why an element is ignored; empty if it is not."""
        of = _origin_words(self._provenance)
        if (parent.tag, element.tag) == ('launch', 'arg'):
            return f'is ignored in {of}: launch files run what they are given, such as a prefix'
        if element.tag in _NEVER:
            return f'is ignored in {of}: {_NEVER[element.tag]}'
        if element.tag in ('node', 'launch'):
            package = element.attributes.get('pkg', '')
            if package not in self._provenance.packages:
                return (f'is ignored in {of}: its package {shortened(package)} is not trusted; '
                        f'"rosrun process_visualizer cell trust {shortened(package)}" trusts it')
        reason = _unresolvable(element)
        if not reason and element.tag in ('param', 'rosparam'):
            reason = self._parameter_refusal(element)
        if not reason and element.tag == 'property':
            reason = self._property_refusal(element)
        return reason and f'is ignored in {of}: {reason}'

    def _parameter_refusal(self, element: Element) -> str:
        try:
            attributes = {name: substitute(text, self._arguments, element.location.file)
                          for name, text in element.attributes.items()}
        except ValueError:
            return 'its arguments have no usable values'
        return _parameter_refusal(element.tag, attributes, element.text)

    def _property_refusal(self, element: Element) -> str:
        name, value = (self._resolved(element, it) for it in ('name', 'value'))
        most = PROPERTY_LIMITS.get(name)
        if most is None or not value:
            return ''
        try:
            is_small = abs(float(value)) <= most
        except ValueError:
            is_small = False
        return '' if is_small else f'"{name}" may be at most {most}'

    def _resolved(self, element: Element, name: str) -> str:
        """Return the value of an attribute; '' if it cannot be known, which the parser reports."""
        try:
            return substitute(element.attributes.get(name, ''), self._arguments,
                              element.location.file)
        except ValueError:
            return ''

    def _ignore(self, element: Element, message: str, attribute: str = '') -> None:
        self.removals.append(Removal(element.offset, attribute))
        self.ignored.append(_problem(element.location, element.tag, message))


def _unresolvable(element: Element) -> str:
    for name, value in element.attributes.items():
        text = _RESOLVED.sub('', value)
        if (element.tag, name) == ('include', 'file'):
            text = _FIND_PACKAGE.sub('', text)  # a package's file is read as data, too
        if '$' in text:
            return f'"{name}" has {shortened(text[text.index("$"):])}, which is resolved only in ' \
                   'files of your own'
    return ''


def _parameter_refusal(tag: str, attributes: Mapping[str, str], text: str) -> str:
    for name in _READS_OR_RUNS:
        if name in attributes and (tag, attributes[name]) != ('rosparam', 'load'):
            return f'"{name}" would run a program or read a file'
    if 'file' in attributes:
        return '"file" would read or write a file'
    if attributes.get('type') == 'yaml' or (tag == 'rosparam' and (
            'subst_value' in attributes or _NOT_PLAIN.search(text))):
        return 'its YAML is more than plain values, which rosparam may evaluate'
    names = [attributes.get(name, '') for name in ('name', 'param', 'ns')]
    texts = [attributes.get('value', '')]
    if tag == 'rosparam':
        try:
            content = plain_yaml(text)
            names += _keys(content)
            texts += _texts(content)
        except (yaml.YAMLError, ValueError, RecursionError):
            return 'its YAML cannot be read'
    if any('<' in it for it in texts):
        return 'a robot description in it could name any file and any computer'
    # "~" is the namespace of the node for a <param>, but that of roslaunch itself for a <rosparam>
    if any(name.startswith(('/', '~') if tag == 'rosparam' else '/') for name in names):
        return 'it is outside of the namespace of its device'
    return ''


def _keys(value: object) -> Iterator[str]:
    """Yield the keys that rosparam joins to parameter names; one with a "/" leaves the group."""
    values = [value]
    while values:
        mapping = values.pop()
        if isinstance(mapping, dict):
            yield from map(str, mapping)
            values.extend(mapping.values())


def _texts(value: object) -> Iterator[str]:
    """Yield the texts among the values."""
    values = [value]
    while values:
        it = values.pop()
        if isinstance(it, str):
            yield it
        elif isinstance(it, (dict, list, tuple, set)):
            values.extend(it.values() if isinstance(it, dict) else it)


def _problem(location: Location, tag: str, message: str) -> Problem:
    advice = '' if 'cell trust' in message else f'; {_ADVICE}'
    return Problem(location, shortened(tag), message + advice)


def _origin_words(provenance: Provenance) -> str:
    return provenance.origin.value
