# SPDX-License-Identifier: BSD-3-Clause
"""The recorder's services as methods, for the launcher and the command line."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Sequence, Tuple

import genpy
import numpy as np

from process_visualizer.bagio.message_definition import Connection, with_definition
from process_visualizer.clients.service_connection import NodeClient, ServiceConnection
from process_visualizer.curves.live_curves import RecentPart
from process_visualizer.msg import RecorderState
from process_visualizer.ros_names import BAG_RECORDER
from process_visualizer.srv import (
    MarkAt,
    ReadRecent,
    StartRecording,
    StartRecordingRequest,
    StopRecording,
)


class RecorderError(Exception):
    """The recorder refused a command or failed; the text has the reason and the remedy."""


class RecorderUnreachable(RecorderError):
    """The recorder cannot be reached."""


@dataclass(frozen=True)
class RecordingOptions:
    """Options of a recording; by default the recorder's parameters apply.

    The bag is named ``NAME.bag``; without a name ``PREFIX_DATE.bag`` or ``DATE.bag`` (local date
    and time). Topics that match one of the ``patterns`` (regular expressions for whole names) and
    none of ``excluded`` are recorded as soon as they are published. With ``recent_s`` the bag
    begins with the last seconds in the recorder's memory.
    """

    topics: Tuple[str, ...] = ()
    folder: str = ''
    prefix: str = ''
    name: str = ''
    compression: str = 'none'
    split_bytes: int = 0
    split_duration_s: float = 0.0
    configuration: str = ''
    recent_s: float = 0.0
    patterns: Tuple[str, ...] = ()
    excluded: Tuple[str, ...] = ()


_NODE = f'/{BAG_RECORDER}'
_ANSWER_TIMEOUT_S = 60.0
"""Time limit for an answer: writing the memory to a slow disk takes a while."""
_SERVICES = {'start': StartRecording, 'save_recent': StartRecording,
             'copy_recent': StartRecording, 'watch': StartRecording, 'stop': StopRecording,
             'mark_at': MarkAt}


def request_of(options: RecordingOptions) -> StartRecordingRequest:
    """Return the options as the service's request."""
    return StartRecordingRequest(
        topics=list(options.topics), patterns=list(options.patterns),
        excluded=list(options.excluded), folder=options.folder, prefix=options.prefix,
        name=options.name, compression=options.compression, split_bytes=options.split_bytes,
        split_duration=options.split_duration_s, configuration=options.configuration,
        recent=options.recent_s)


class BagRecorder(NodeClient[RecorderState]):
    """Commands the node ``bag_recorder`` and follows its state."""

    REFUSED, UNREACHABLE = RecorderError, RecorderUnreachable

    def __init__(self, on_state: Optional[Callable[[RecorderState], None]] = None,
                 node: str = _NODE, follow_now: bool = True) -> None:
        """See NodeClient."""
        super().__init__(node, RecorderState, _SERVICES, _ANSWER_TIMEOUT_S, on_state, follow_now)

    def wait_until_ready(self, timeout_s: float) -> None:
        """Wait until the recorder runs.

        Raises:
            RecorderError: it is not running after the timeout.
        """
        self._wait_for_service('start', timeout_s, 'bag_recorder')

    def start(self, options: RecordingOptions) -> str:
        """Start a recording; return its path once every topic with a publisher is connected.

        Raises:
            RecorderError: no recording has started.
        """
        return str(self._answer('start', request_of(options)).path)

    def save_recent(self, options: RecordingOptions) -> str:
        """Write the messages in memory (or of the last ``recent_s``) to a bag; return its path.

        Raises:
            RecorderError: the bag cannot be written.
        """
        return str(self._answer('save_recent', request_of(options)).path)

    def copy_recent(self, folder: str, name: str = '', recent_s: float = 0.0) -> str:
        """Copy the messages in memory (or of the last ``recent_s``) to a bag; return its path.

        A recording continues, and the copied messages can still be saved.

        Raises:
            RecorderError: the memory is empty, or the bag cannot be written.
        """
        options = RecordingOptions(folder=folder, name=name, recent_s=recent_s)
        return str(self._answer('copy_recent', request_of(options)).path)

    def watch(self, topics: Sequence[str]) -> None:
        """Keep the last seconds of exactly these topics in memory from now on.

        The contents of the memory stay.

        Raises:
            RecorderError: a recording is in progress, or the recorder does not answer.
        """
        self._answer('watch', request_of(RecordingOptions(topics=tuple(topics))))

    def stop(self) -> List[str]:
        """Stop recording; return the paths of the bags once everything is written.

        This works without the master, because a restarted one does not know the recorder.

        Raises:
            RecorderError: there was no recording, or something could not be written.
        """
        return list(self._answer('stop').files)

    def mark(self, label: str, stamp_s: float = 0.0) -> None:
        """Write a labeled mark to the recording or to the memory.

        ``stamp_s`` is the time of the mark on the recorder's clock; 0: its arrival there. The same
        mark may be sent again if it is unknown whether the recorder has accepted it.

        Raises:
            RecorderError: there is neither a recording nor a memory for the mark.
        """
        self._answer('mark_at', label, genpy.Time.from_sec(stamp_s))


_TEXTS = 5  # number of strings that describe a connection
_MAX_BYTES = 1 << 16  # far more than a message with a few numbers


class RecorderMemory:
    """Reads each message in the recorder's memory once, without a node of its own. Calls block."""

    def __init__(self, node: str = f'/{BAG_RECORDER}', timeout_s: float = 3.0,
                 largest_bytes: int = _MAX_BYTES) -> None:
        """Messages larger than ``largest_bytes``, such as images, are left out; 0: no limit."""
        self._largest = largest_bytes
        self._service = ServiceConnection(f'{node}/read_recent', ReadRecent, timeout_s)
        self._next = 0
        self._connections: Tuple[Connection, ...] = ()

    def read(self, topics: Sequence[str]) -> Tuple[RecentPart, bool]:
        """Return unread messages of the topics, and whether there are more.

        Raises:
            ServiceUnreachable: the recorder does not answer.
        """
        answer = self._service.call(list(topics), self._next, self._largest,
                                    len(self._connections))
        known = () if answer.anew else self._connections
        self._connections = known + _connections(answer.connections)
        self._next = answer.next
        return _part(answer, self._connections), bool(answer.more)

    def restart(self) -> None:
        """Read from the beginning of the memory again."""
        self._next, self._connections = 0, ()

    def close(self) -> None:
        """Close the connection; the next call opens another one."""
        self._service.close()


def _connections(texts: Sequence[str]) -> Tuple[Connection, ...]:
    columns = [texts[first::_TEXTS] for first in range(_TEXTS)]
    return tuple(with_definition(Connection(topic, kind, md5sum, definition, False, node))
                 for topic, kind, md5sum, definition, node in zip(*columns))


def _part(answer: Any, connections: Tuple[Connection, ...]) -> RecentPart:
    end = np.cumsum(np.array(answer.sizes, np.int64))
    begin = np.concatenate((np.zeros(min(len(end), 1), np.int64), end[:-1]))
    return RecentPart(bool(answer.anew), connections, int(answer.now),
                      np.array(answer.numbers, np.int64), np.array(answer.times, np.int64),
                      begin, end, np.frombuffer(answer.records, np.uint8))
