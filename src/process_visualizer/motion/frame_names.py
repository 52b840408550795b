"""Which frame of a robot's model a driver means by a name."""
from __future__ import annotations

from typing import Collection, List


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
