"""Sends messages to one subscriber without ever waiting for it."""
from __future__ import annotations

import socket
import struct
import threading
from collections import deque
from typing import Any, Callable, Deque, List, Optional

from process_visualizer.bags.message_layout import Data

DIRECT_BYTES = 4 << 20  # what is larger is left to the sender thread
_LENGTH = struct.Struct('<I')
_FLAGS = socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL


class Packet:
    """A message with its length before it, as TCPROS wants it, and what of it is still to go."""

    def __init__(self, pieces: List[Data]) -> None:
        """Take the pieces of a message."""
        views = [memoryview(piece).cast('B') for piece in pieces]
        self.size = sum(map(len, views))
        self.views = [memoryview(_LENGTH.pack(self.size)), *views]

    def copy(self) -> Packet:
        """Return the packet for another subscriber."""
        packet = Packet.__new__(Packet)
        packet.size, packet.views = self.size, list(self.views)
        return packet

    def write(self, peer: socket.socket) -> bool:
        """Write what can be written at once; return whether all has gone.

        Raises:
            OSError: the subscriber has gone away.
        """
        while self.views:
            try:
                written = peer.sendmsg(self.views, [], _FLAGS)
            except (BlockingIOError, InterruptedError):
                return False
            self._written(written)
        return True

    def _written(self, count: int) -> None:
        while self.views and count >= len(self.views[0]):
            count -= len(self.views.pop(0))
        if count:
            self.views[0] = self.views[0][count:]


class SubscriberLink:
    """The connection to a subscriber: sent at once if possible, else queued within bounds.

    When the subscriber is so slow that the queue is full, its oldest message is dropped, and
    counted. Small messages are written in the caller's thread; a large one takes long to copy
    and is left to the sender's thread, as is all that comes before it has gone.
    """

    def __init__(self, connection: Any, queue_size: int, queue_bytes: int,
                 wake: Callable[[SubscriberLink], None]) -> None:
        """Take rospy's connection, the bounds, and what tells the sender that there is work."""
        self.connection = connection
        self.socket: socket.socket = connection.socket
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.dropped = 0
        self._queue_size = queue_size
        self._queue_bytes = queue_bytes
        self._wake = wake
        self._lock = threading.Lock()
        self._queue: Deque[Packet] = deque()
        self._queued_bytes = 0
        self._begun: Optional[Packet] = None  # only the sender's thread goes on with it
        self._busy = False  # the sender's thread has work here
        self._closed = False

    def send(self, packet: Packet) -> None:
        """Send a packet, now or as soon as what came before has gone."""
        with self._lock:
            if self._closed or (not self._busy and self._sent_directly(packet)):
                return
            self._append(packet)
            wake, self._busy = not self._busy, True
        if wake:
            self._wake(self)

    def flush(self) -> bool:
        """Go on sending, in the sender's thread; return whether there is nothing left."""
        try:
            while self._take():
                assert self._begun is not None
                if not self._begun.write(self.socket):
                    return False
                self._begun = None
        except OSError:
            self.close()
        return True

    def close(self) -> None:
        """Give the connection up, as the subscriber has gone away."""
        with self._lock:
            self._closed = True
            self._queue.clear()
        self.connection.close()

    def _sent_directly(self, packet: Packet) -> bool:
        if packet.size > DIRECT_BYTES:
            return False
        try:
            if packet.write(self.socket):
                return True
        except OSError:
            self._closed = True  # the sender's thread closes it: rospy takes locks for that
            self._wake(self)
            return True
        self._begun = packet
        return False

    def _append(self, packet: Packet) -> None:
        if packet is self._begun:
            return
        self._queue.append(packet)
        self._queued_bytes += packet.size
        while len(self._queue) > self._queue_size or (self._queued_bytes > self._queue_bytes
                                                      and len(self._queue) > 1):
            self._queued_bytes -= self._queue.popleft().size
            self.dropped += 1

    def _take(self) -> bool:
        """Begin with the next packet if none is begun; return whether there is one."""
        with self._lock:
            if self._closed:
                raise ConnectionError('the subscriber has gone away')
            if self._begun is None and self._queue:
                self._begun = self._queue.popleft()
                self._queued_bytes -= self._begun.size
            self._busy = self._begun is not None
            return self._busy
