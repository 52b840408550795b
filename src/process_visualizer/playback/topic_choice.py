# SPDX-License-Identifier: BSD-3-Clause
"""The choice of the topics to play from a recording, and their published names."""
from __future__ import annotations

import fnmatch
import re
from types import MappingProxyType
from typing import Iterable, List, Mapping, Optional, Pattern, Sequence

from process_visualizer.cell.errors import nearest, quoted, shortened

_LEGAL = re.compile(r'[/A-Za-z][A-Za-z0-9_/]*\Z')
_WILDCARDS = '*?['
_MAX_LIST = 200
_NO_REMAP: Mapping[str, str] = MappingProxyType({})


class TopicChoice:
    """Topics to play, as names or shell-style patterns such as /camera/* (* matches slashes too).

    Names without a leading slash are taken as global. As in `rosbag play`, an empty ``include``
    means all topics, and the prefix is put before the (remapped) name of every topic.
    """

    def __init__(self, include: Sequence[str] = (), exclude: Sequence[str] = (), prefix: str = '',
                 remap: Mapping[str, str] = _NO_REMAP) -> None:
        """Choose the topics that match ``include`` and not ``exclude``.

        Raises:
            ValueError: a name violates ROS's rules, or a pattern is invalid.
        """
        self._include = {text: _compiled(text) for text in include}
        self._exclude = {text: _compiled(text) for text in exclude}
        self._prefix = checked_prefix(prefix)
        self._remap = {resolved_name(source): resolved_name(target)
                       for source, target in remap.items()}

    def published_name(self, topic: str) -> Optional[str]:
        """Return the global name under which a topic is published; None if it is not chosen.

        Raises:
            ValueError: the topic is chosen, but cannot be published under its name.
        """
        name = _canonical(topic)
        if self._include and not _fits(name, self._include.values()):
            return None
        if _fits(name, self._exclude.values()):
            return None
        try:
            return self._prefix + (self._remap.get(name) or resolved_name(topic))
        except ValueError as error:
            raise ValueError(f'the recording has a topic that cannot be published: {error}; '
                             'exclude it') from None

    def named(self) -> List[str]:
        """Return the published names of the topics that are included by name."""
        names = [self.published_name(text) for text in self._include
                 if not any(sign in text for sign in _WILDCARDS)]
        return [name for name in names if name is not None]

    def unmatched(self, topics: Iterable[str]) -> List[str]:
        """Return the names and patterns, as given, that match none of the topics."""
        names = [_canonical(topic) for topic in topics]
        return [text for text, pattern in {**self._include, **self._exclude}.items()
                if not any(map(pattern.match, names))]

    def unmatched_messages(self, topics: Sequence[str]) -> List[str]:
        """Return a message with advice for each name or pattern that matches no topic."""
        return [f'no topic of the recording fits {quoted(text)}; {_advice(text, topics)}'
                for text in self.unmatched(topics)]


def resolved_name(name: str, namespace: str = '/') -> str:
    """Return the global name of a topic as ROS resolves it within a namespace.

    Raises:
        ValueError: the name violates ROS's rules, or is private.
    """
    if not _LEGAL.match(name) or not name.strip('/'):
        raise ValueError(f'{quoted(name)} is not a valid topic name; use letters, digits, "_" '
                         'and "/" and begin with a letter or "/"')
    return _canonical(name if name.startswith('/') else f'{namespace}/{name}')


def checked_prefix(prefix: str) -> str:
    """Return a prefix for global names: /prefix, or ''.

    Raises:
        ValueError: the prefix violates ROS's rules for names.
    """
    return resolved_name(prefix) if prefix.strip('/') else ''


def _canonical(name: str) -> str:
    return '/' + '/'.join(part for part in name.split('/') if part)


def _compiled(text: str) -> Pattern[str]:
    """Return the regular expression of a pattern; a slash comes first unless a wildcard does."""
    pattern = _canonical(text)
    try:
        return re.compile(fnmatch.translate(pattern[1:] if text[:1] in _WILDCARDS else pattern))
    except re.error:
        raise ValueError(f'{quoted(text)} is not a pattern of topics; write one such as '
                         '/camera/*') from None


def _fits(name: str, patterns: Iterable[Pattern[str]]) -> bool:
    return any(pattern.match(name) for pattern in patterns)


def _advice(text: str, topics: Sequence[str]) -> str:
    name = nearest(_canonical(text), topics)
    if name is not None:
        return f'did you mean "{name}"?'
    return 'expected one of: ' + shortened(', '.join(sorted(topics)) or 'none', _MAX_LIST)
