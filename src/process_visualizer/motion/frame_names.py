# SPDX-License-Identifier: BSD-3-Clause
"""The frames of a robot: what a driver means by a name, and those that nobody names."""
from __future__ import annotations

from typing import Collection, List, Optional


def default_base_frame(robot: str) -> str:
    """Return the base frame of a robot that names none."""
    return f'{robot}/link0'


def default_tool_frame(robot: str) -> str:
    """Return the tool frame of a robot that has no model to choose it from."""
    return f'{robot}/tool'


def meant_frame(name: str, links: Collection[str], robot: str, prefix: str = '') -> str:
    """Return the link of the model that a driver means, or the name as it is.

    A driver knows neither the prefix that the configuration has put before the links, nor that
    the model has a namespace; and one with a tf prefix puts that before links that have none.

    Args:
        name: from a message; a leading slash does not count.
        links: of the robot's own model.
        robot: the device's name.
        prefix: of the links' names, such as ``left_``.
    """
    name = name.lstrip('/')
    own = {robot, prefix.strip('/_-')}
    words: List[str] = [name]
    namespace, _, rest = name.partition('/')
    if rest and namespace in own:
        words.append(rest)
    for word in words:
        for candidate in (word, prefix + word, f'{robot}/{word}'):
            if candidate in links:
                return candidate
    return name


def prefix_advice(name: str, links: Collection[str]) -> str:
    """Return what to change where a name is a link's but for a prefix of one of them; '' if not."""
    for link in sorted(links, key=len, reverse=True):
        longer, shorter = (name, link) if len(name) > len(link) else (link, name)
        prefix = _prefix(longer, shorter)
        if prefix and longer is name:
            return (f'the model calls {name} {link}: write prefix="{prefix}" in its <model>, and '
                    'the same before the frames in <base>, <tool>, <force>')
        if prefix:
            return (f'the model calls {name} {link}: write prefix="{prefix}" in its <model>, '
                    'instead of an <arg> that makes it, or let the driver send the frame so')
    return ''


def _prefix(longer: str, shorter: str) -> Optional[str]:
    """Return what one name has before another one, with the mark that ends it."""
    prefix = longer[:len(longer) - len(shorter)]
    return prefix if longer.endswith(shorter) and prefix[-1:] in tuple('_/-') else None
