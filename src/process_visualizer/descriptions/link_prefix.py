# SPDX-License-Identifier: BSD-3-Clause
"""Renames the links of a URDF, so that two robots of one model can be in one tf tree."""
from __future__ import annotations

from xml.etree import ElementTree

_LINKS = (('link', 'name'), ('joint/parent', 'link'), ('joint/child', 'link'),
          ('gazebo', 'reference'), ('sensor/parent', 'link'))
"""The elements below the root of a URDF that name links, and their attributes."""


def rename_links(robot: ElementTree.Element, prefix: str) -> None:
    """Put a prefix before the names of all links of a <robot>.

    Joints keep their names: those belong to the device's own topics, in which the driver uses
    them, whereas links are frames, whose names the whole cell shares.
    """
    links = {link.get('name') for link in robot.findall('link')}
    for path, attribute in _LINKS:
        for element in robot.findall(path):
            name = element.get(attribute)
            if name in links:
                element.set(attribute, f'{prefix}{name}')
