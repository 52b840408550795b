# SPDX-License-Identifier: BSD-3-Clause
"""One or several bags as one recording."""
from __future__ import annotations

from types import TracebackType
from typing import Dict, Iterable, List, Optional, Sequence, Tuple, Type

import numpy as np

from process_visualizer.bags.bag_errors import Gap
from process_visualizer.bags.bag_file import BagFile
from process_visualizer.bags.bag_index import BagIndex, ChunkPlaces, Columns, connection_dtype
from process_visualizer.bags.chunk_store import ChunkStore
from process_visualizer.bags.index_reader import read_index
from process_visualizer.messages.connection import Connection
from process_visualizer.messages.installed_definitions import definition_problem


class Recording:
    """Bags (as of `rosbag record --split`) on one timeline: their index and their messages.

    ``index`` says what there is, ``message`` reads it; close it, or use it in a ``with``.
    """

    def __init__(self, paths: Sequence[str], cache_bytes: int = 64 << 20) -> None:
        """Open the files and read their indexes.

        ``begin_ns`` and ``end_ns`` are the bag times of the first and the last message.

        Raises:
            BagUnindexed: one of the files has to be reindexed first.
            BagError: one of the files is not a bag, or one that cannot be read.
            ValueError: no file is given.
        """
        if not paths:
            raise ValueError('a recording needs at least one bag')
        self._files: List[BagFile] = []
        try:
            for path in paths:
                self._files.append(BagFile(path))
            self.index = joined([read_index(file) for file in self._files])
        except BaseException:
            self.close()
            raise
        self.begin_ns, self.end_ns = self.index.begin_ns, self.index.end_ns
        self._cache_bytes = cache_bytes
        self._store = ChunkStore(self._files, self.index, cache_bytes)

    def choose(self, connections: Iterable[int]) -> None:
        """Leave out the messages of all other connections; begin and end stay as they are."""
        self.index = self.index.chosen(connections)
        self._store = ChunkStore(self._files, self.index, self._cache_bytes)

    def __enter__(self) -> Recording:
        """Return itself."""
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Close the files."""
        self.close()

    def close(self) -> None:
        """Close the files; messages cannot be read any more."""
        for file in self._files:
            file.close()

    @property
    def paths(self) -> Tuple[str, ...]:
        """The files in the order in which they were given."""
        return tuple(file.path for file in self._files)

    @property
    def files(self) -> Tuple[BagFile, ...]:
        """The open files, as the index counts them."""
        return tuple(self._files)

    @property
    def remarks(self) -> Tuple[str, ...]:
        """Notes for the reader: messages without a usable time, or without a definition."""
        used = [it for number, it in enumerate(self.index.connections)
                if len(self.index.positions(number))]
        lacking = dict.fromkeys(map(definition_problem, used))
        return (*map(str, self.index.strays), *filter(None, lacking))

    @property
    def size_bytes(self) -> int:
        """The size of all files."""
        return sum(file.size for file in self._files)

    @property
    def gaps(self) -> Tuple[Gap, ...]:
        """Return what could not be read so far: parts of the indexes, and chunks."""
        return self.index.gaps + self._store.gaps

    @property
    def cached_bytes(self) -> int:
        """Return how many bytes of decompressed chunks are kept in memory."""
        return self._store.cached_bytes

    def message(self, position: int) -> memoryview:
        """Return the serialised bytes of the message at a position of the index.

        Raises:
            BagDamaged: it cannot be read; `gap` says what is missing, others can still be read.
        """
        return self._store.message(position)

    @property
    def damage(self) -> Tuple[Gap, ...]:
        """Return what could not be read so far though the index lists it."""
        return self._store.gaps

    def note(self, position: int, reason: str) -> None:
        """Take note of a message that cannot be understood, as one of the ``gaps``."""
        self._store.note(position, reason)

    def check_chunks(self) -> None:
        """Look whether every chunk can be decompressed; ``gaps`` has those that cannot."""
        self._store.check()

    def is_readable(self, position: int) -> bool:
        """Return whether the chunk of a message has not failed so far."""
        return self._store.is_readable(position)


def joined(indexes: Sequence[BagIndex]) -> BagIndex:
    """Return the indexes of several files as one; equal connections of them become one."""
    if len(indexes) == 1:
        return indexes[0]
    numbers: Dict[Connection, int] = {}
    parts: List[Columns] = []
    chunk_count = 0
    for index in indexes:
        renumbered = [numbers.setdefault(it, len(numbers)) for it in index.connections]
        parts.append(Columns(index.time_ns, np.array(renumbered, np.int32)[index.connection],
                             index.chunk + np.int32(chunk_count), index.offset))
        chunk_count += len(index.chunks.position)
    columns = Columns(*map(np.concatenate, zip(*parts)))
    columns = columns._replace(connection=columns.connection.astype(connection_dtype(len(numbers))))
    return BagIndex(tuple(numbers), columns, _joined_places(indexes),
                    [gap for index in indexes for gap in index.gaps],
                    [it for index in indexes for it in index.strays])


def _joined_places(indexes: Sequence[BagIndex]) -> ChunkPlaces:
    files = [np.full(len(index.chunks.position), number, np.int32)
             for number, index in enumerate(indexes)]
    return ChunkPlaces(np.concatenate(files),
                       np.concatenate([index.chunks.position for index in indexes]))
