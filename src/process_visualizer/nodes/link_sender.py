"""The thread that sends what could not be sent at once."""
from __future__ import annotations

import queue
import selectors
import socket
import threading
from contextlib import suppress

from process_visualizer.nodes.subscriber_link import SubscriberLink


class LinkSender:
    """Sends the queues of all links, each as fast as its subscriber takes it."""

    def __init__(self) -> None:
        """Start the thread."""
        self._work: queue.SimpleQueue[SubscriberLink] = queue.SimpleQueue()
        self._bell, self._ring = socket.socketpair()
        self._bell.setblocking(False)
        self._ring.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._bell, selectors.EVENT_READ)
        self._closed = False
        self._idle = threading.Condition()
        self._busy_links = 0
        self._thread = threading.Thread(target=self._run, name='link sender', daemon=True)
        self._thread.start()

    def wake(self, link: SubscriberLink) -> None:
        """Take care of a link that has something to send."""
        with self._idle:
            self._busy_links += 1
        self._work.put(link)
        self._awake()

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until no link has anything to send; return False if it took too long."""
        with self._idle:
            return self._idle.wait_for(lambda: not self._busy_links, timeout_s)

    def close(self) -> None:
        """End the thread; what is queued is not sent."""
        self._closed = True
        self._awake()
        self._thread.join()
        self._selector.close()
        self._bell.close()
        self._ring.close()

    def _awake(self) -> None:
        with suppress(BlockingIOError):  # it rings already
            self._ring.send(b'.')

    def _run(self) -> None:
        while not self._closed:
            for key, _ in self._selector.select():
                if key.fileobj is self._bell:
                    self._take_work()
                elif key.data.flush():
                    self._selector.unregister(key.fileobj)
                    self._done()

    def _take_work(self) -> None:
        self._bell.recv(4096)
        while not self._work.empty():
            link = self._work.get()
            if link.flush():
                self._done()
            else:
                self._selector.register(link.socket, selectors.EVENT_WRITE, link)

    def _done(self) -> None:
        with self._idle:
            self._busy_links -= 1
            self._idle.notify_all()
