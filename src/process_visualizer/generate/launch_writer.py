# SPDX-License-Identifier: BSD-3-Clause
"""Writes readable roslaunch XML: attributes in the given order, YAML in blocks."""
from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field
from typing import Any, Iterable, List, Mapping, Tuple, Union
from xml.sax.saxutils import escape, quoteattr

import yaml

_INDENT = '  '
_WIDTH = 100


class _Dumper(yaml.SafeDumper):
    """Quotes texts such as ``deg(90)``, which rosparam would read as an angle."""

    def text(self, text: str) -> yaml.ScalarNode:
        """Return a text as a node, in quotes that do not fold Unicode's line separators."""
        style = '"' if re.search('[\x85\u2028\u2029]', text) else None
        return self.represent_scalar('tag:yaml.org,2002:str', text, style)


_resolvers: Any = _Dumper  # PyYAML does not declare their types
_resolvers.add_implicit_resolver('!angle', re.compile(r'(deg|rad)\('), list('dr'))
_Dumper.add_representer(str, _Dumper.text)


@dataclass
class LaunchTag:
    """An element with ``text``, or with ``children``: elements, and comments as text, in order."""

    name: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    text: str = ''
    children: List[Union['LaunchTag', str]] = field(default_factory=list)

    def add(self, name: str, attributes: Mapping[str, str], text: str = '') -> 'LaunchTag':
        """Add an element below this one, and return it."""
        tag = LaunchTag(name, attributes, textwrap.dedent(text).strip())
        self.children.append(tag)
        return tag

    def comment(self, text: str) -> None:
        """Add a comment; consecutive hyphens, which XML forbids there, are separated."""
        self.children.append(re.sub('-(?=-)', '- ', text))

    def include(self, path: str, arguments: Iterable[Tuple[str, str]]) -> None:
        """Add an ``<include>`` of a launch file with names and values of its arguments."""
        element = self.add('include', {'file': path})
        for name, value in arguments:
            element.add('arg', {'name': name, 'value': value})

    def parameters(self, values: Mapping[str, Any]) -> None:
        """Add the values as one ``<rosparam>``."""
        if values:
            self.add('rosparam', {}, _yaml(values))


def write_document(root: LaunchTag) -> str:
    """Return the XML text of an element and all elements below it."""
    return '<?xml version="1.0"?>\n' + '\n'.join(_lines(root, 0)) + '\n'


def _yaml(values: Mapping[str, Any]) -> str:
    """Return YAML with one block per name; short lists and mappings stay on one line."""
    return ''.join(
        yaml.dump({name: value}, Dumper=_Dumper, sort_keys=False, width=_WIDTH, allow_unicode=True,
                  default_flow_style=None if isinstance(value, (list, dict)) else False)
        for name, value in values.items())


def _lines(tag: LaunchTag, depth: int) -> List[str]:
    indent = _INDENT * depth
    opening = indent + '<' + ' '.join([tag.name, *(
        f'{name}={quoteattr(value)}' for name, value in tag.attributes.items())])
    if tag.text:
        inner = [indent + _INDENT + line for line in escape(tag.text).split('\n')]
        return [opening + '>', *inner, f'{indent}</{tag.name}>']
    if not tag.children:
        return [opening + '/>']
    lines = [opening + '>']
    for child in tag.children:
        lines += (
            _lines(child, depth + 1) if isinstance(child, LaunchTag) else _comment(child, depth + 1)
        )
    return [*lines, f'{indent}</{tag.name}>']


def _comment(text: str, depth: int) -> List[str]:
    return ['', f'{_INDENT * depth}<!-- {text} -->']
