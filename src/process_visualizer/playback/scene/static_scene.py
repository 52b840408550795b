# SPDX-License-Identifier: BSD-3-Clause
"""All static transforms of a topic at any time, as one message for later subscribers."""
from __future__ import annotations

import threading
from bisect import bisect_left
from typing import Dict, List, NamedTuple

import numpy as np

from process_visualizer.messages.message_layout import MessageDamaged
from process_visualizer.messages.static_transforms import joined, split
from process_visualizer.playback.scene.message_loader import LoadedMessage, MessageLoader


class _Versions(NamedTuple):
    """Versions of one frame: positions of messages (rising), and the bytes in them."""

    positions: List[int]
    transforms: List[bytes]


class StaticScene:
    """The static transforms after any number of messages; each message is read once.

    Who subscribes gets the last message of a latched topic only. So every message is published
    with all transforms that hold at its time, as messages of one source (that of ``connection``).
    May be used by several threads.
    """

    def __init__(self, loader: MessageLoader, positions: np.ndarray) -> None:
        """Take the loader and the positions (rising) of the topic's messages."""
        self._loader = loader
        self._positions = positions.tolist()
        self.connection = loader.connection(self._positions[0])
        self._lock = threading.Lock()
        self._read = 0  # how many of the messages
        self._frames: Dict[bytes, _Versions] = {}

    def messages(self, count: int) -> List[LoadedMessage]:
        """Return the message after ``count`` messages of the recording, if there is any."""
        known = bisect_left(self._positions, count)
        if not known:
            return []
        with self._lock:
            self._read_until(known)
            data = joined(self._transforms(count))
        last = self._positions[known - 1]
        return [self._loader.located(last, data)]

    def _transforms(self, count: int) -> List[bytes]:
        counts = ((bisect_left(it.positions, count), it.transforms) for it in self._frames.values())
        return [transforms[number - 1] for number, transforms in counts if number]

    def _read_until(self, known: int) -> None:
        while self._read < known:
            position = self._positions[self._read]
            message = self._loader.load(position)
            self._read += 1
            if message is not None:
                self._add(position, message)

    def _add(self, position: int, message: LoadedMessage) -> None:
        try:
            transforms = dict(split(bytes(message.data)))
        except MessageDamaged as error:
            self._loader.note_damaged(position, error)
            return
        for child, transform in transforms.items():
            versions = self._frames.setdefault(child, _Versions([], []))
            if versions.transforms[-1:] != [transform]:
                versions.positions.append(position)
                versions.transforms.append(transform)
