# SPDX-License-Identifier: BSD-3-Clause
"""Observations of a cell that runs or was recorded."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

from process_visualizer.motion.kinematics import Placement


class Source(NamedTuple):
    """One publisher's messages on a topic: type ``package/Type``, and some messages as bytes."""

    topic: str
    type: str
    definition: str
    publisher: str
    messages: Tuple[bytes, ...]


class SeenNumber(NamedTuple):
    """A number in the messages of a topic: the path of its field, and between what it was.

    ``is_counter`` says that it only ever rose from one message to the next.
    """

    path: str
    low: float
    high: float
    is_counter: bool = False
    is_whole: bool = False

    @property
    def changes(self) -> bool:
        """Return whether it was not always the same."""
        return self.low < self.high


@dataclass(frozen=True)
class SeenTopic:
    """A topic: ``frames`` are those of its headers, ``joints`` the names in joint states.

    ``length`` is that of the array ``data``, where it has one that is always as long.
    """

    name: str
    type: str
    publishers: Tuple[str, ...] = ()
    frames: Tuple[str, ...] = ()
    joints: Tuple[str, ...] = ()
    length: Optional[int] = None
    numbers: Tuple[SeenNumber, ...] = ()


class SeenTransform(NamedTuple):
    """A transform on tf: the child's place in its parent; names without a leading slash.

    It came on ``topic``; ``changes`` says that it was not always the same.
    """

    parent: str
    child: str
    placement: Placement
    topic: str = ''
    changes: bool = False


class SeenDescription(NamedTuple):
    """A robot description: the namespace of its parameter or topic, such as ``/arm``, its URDF."""

    namespace: str
    text: str


@dataclass(frozen=True)
class Seen:
    """All that was seen; ``where`` says in words what was looked at.

    ``is_moment`` says that it was but a moment, after which numbers may go anywhere.
    """

    where: str
    topics: Tuple[SeenTopic, ...] = ()
    transforms: Tuple[SeenTransform, ...] = ()
    descriptions: Tuple[SeenDescription, ...] = ()
    remarks: Tuple[str, ...] = ()
    is_moment: bool = False
