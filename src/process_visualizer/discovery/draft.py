# SPDX-License-Identifier: BSD-3-Clause
"""A configuration that is being made: devices with the elements that will stand in the file."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Optional, Tuple

from process_visualizer.cell.elements import DEFAULT_FRAME


@dataclass(frozen=True)
class DraftElement:
    """An element of a device; one that is not ``active`` is written as a comment.

    ``comment`` stands before it.
    """

    tag: str
    attributes: Dict[str, str]
    comment: str = ''
    active: bool = True
    children: Tuple['DraftElement', ...] = ()


@dataclass
class DraftDevice:
    """A device; ``type`` as in the configuration. ``comments`` stand before it."""

    type: str
    name: str
    elements: List[DraftElement] = field(default_factory=list)
    comments: List[str] = field(default_factory=list)

    def add(self, tag: str, attributes: Dict[str, str], comment: str = '', active: bool = True,
            children: Tuple[DraftElement, ...] = ()) -> None:
        """Add an element at the end."""
        self.elements.append(DraftElement(tag, attributes, comment, active, children))

    def first(self, tag: str) -> Optional[DraftElement]:
        """The first active element of that tag."""
        return next((it for it in self.elements if it.tag == tag and it.active), None)

    @property
    def topics(self) -> List[str]:
        """The names of all topics that it has, from the root."""
        found = []
        for it in self.elements:
            if it.active and it.tag == 'topic':
                found.append(f'{it.attributes.get("ns", "")}/{it.attributes["name"]}')
            elif it.active and it.tag == 'variable':
                found.append(it.attributes['topic'])
        return found


@dataclass
class Draft:
    """All devices, the global frame, and what the user should know."""

    where: str
    frame: str = DEFAULT_FRAME
    devices: List[DraftDevice] = field(default_factory=list)
    remarks: List[str] = field(default_factory=list)
