# SPDX-License-Identifier: BSD-3-Clause
"""Sending of messages to subscribers on time, in a thread that Python cannot delay."""
from __future__ import annotations

import ctypes
import threading
import weakref
from typing import Callable, Dict, List

from process_visualizer.bagio.message_layout import Data

LIBRARY = 'libprocess_visualizer_sender.so'


class TimedSender:
    """The C++ class TimedSender; see include/process_visualizer/sender/timed_sender.hpp."""

    def __init__(self) -> None:
        """Load the library and start the thread.

        Raises:
            OSError: the library is missing, or the system has no more descriptors.
        """
        self._quick = _library(ctypes.PyDLL)  # keeps Python's lock: the calls are short
        self._waiting = _library(ctypes.CDLL)
        self._sender = self._quick.timed_sender_new()
        if not self._sender:
            raise OSError('the sender of messages cannot be started')
        end = weakref.finalize(self, self._waiting.timed_sender_delete, self._sender)
        end.atexit = False  # functions called while Python exits may still use it
        self._closing = threading.RLock()  # a signal may interrupt one call and make another
        self._on_broken: Dict[int, Callable[[], None]] = {}
        self._thread = threading.Thread(target=self._watch, name='broken links', daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """The number of messages that slow subscribers did not receive."""
        return int(self._quick.timed_sender_dropped(self._sender))

    def sent(self, topic: int) -> int:
        """Return how many messages of a topic have been sent, with or without subscribers."""
        return int(self._quick.timed_sender_sent(self._sender, topic))

    def add_topic(self, latch: bool, queue_size: int, queue_bytes: int) -> int:
        """Add a topic, with the queue size of each of its subscribers; return its number."""
        return int(self._quick.timed_sender_add_topic(self._sender, latch, queue_size, queue_bytes))

    def add_link(self, topic: int, socket: int, on_broken: Callable[[], None]) -> int:
        """Add a subscriber by its socket; return its number, -1 if the socket is closed already.

        ``on_broken`` is called by a separate thread when the subscriber has gone.
        """
        link = int(self._quick.timed_sender_add_link(self._sender, topic, socket))
        if link >= 0:
            self._on_broken[link] = on_broken
        return link

    def remove_link(self, link: int) -> None:
        """Remove a subscriber."""
        self._on_broken.pop(link, None)
        self._quick.timed_sender_remove_link(self._sender, link)

    def send(self, topic: int, source: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of one of a topic's sources at a monotonic time [ns].

        Messages are sent in the order given. The last message of each source is latched; new
        subscribers get the latched messages in the order in which they were sent.
        """
        data = pieces[0] if len(pieces) == 1 and isinstance(pieces[0], bytes) else b''.join(pieces)
        self._quick.timed_sender_send(self._sender, topic, source, due_ns, data, len(data))

    def withdraw(self, topic: int, source: int, due_ns: int) -> None:
        """Stop latching messages of a topic's source, from a monotonic time [ns] on."""
        self._quick.timed_sender_withdraw(self._sender, topic, source, due_ns)

    def revoke(self, after_ns: int) -> int:
        """Withdraw unsent messages due after a monotonic time [ns]; return how many."""
        return int(self._quick.timed_sender_revoke(self._sender, after_ns))

    def wait_until_sent(self, timeout_s: float) -> bool:
        """Wait until everything has been sent; return False if it took too long."""
        return bool(self._waiting.timed_sender_wait_until_sent(self._sender, timeout_s))

    def close(self) -> None:
        """End the threads; queued and later messages are not sent."""
        with self._closing:
            self._waiting.timed_sender_close(self._sender)
        self._thread.join()

    def _watch(self) -> None:
        while True:
            link = self._waiting.timed_sender_wait_for_broken(self._sender)
            if link < 0:
                return
            on_broken = self._on_broken.pop(link, None)
            if on_broken is not None:
                on_broken()


def take_long_slices() -> None:
    """Let other threads run at once when they wake up, above all the sender and subscribers.

    This applies to the calling thread and the threads that it starts; see time_slice.hpp.

    Raises:
        OSError: the library is missing.
    """
    _library(ctypes.PyDLL).timed_sender_take_long_slices()


def _library(load: Callable[[str], ctypes.CDLL]) -> ctypes.CDLL:
    try:
        return _declared(load(LIBRARY))
    except (OSError, AttributeError) as error:  # it is missing, or of another version
        raise OSError(f'{error}: build the workspace and source its setup.bash') from error


def _declared(library: ctypes.CDLL) -> ctypes.CDLL:
    sender, number, size = ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t
    for name, result, arguments in (
            ('take_long_slices', None, []),
            ('new', sender, []),
            ('delete', None, [sender]),
            ('add_topic', number, [sender, number, size, size]),
            ('add_link', number, [sender, number, number]),
            ('remove_link', None, [sender, number]),
            ('send', None, [sender, number, number, ctypes.c_int64, ctypes.c_char_p, size]),
            ('withdraw', None, [sender, number, number, ctypes.c_int64]),
            ('revoke', size, [sender, ctypes.c_int64]),
            ('sent', size, [sender, number]),
            ('dropped', size, [sender]),
            ('wait_until_sent', number, [sender, ctypes.c_double]),
            ('wait_for_broken', number, [sender]),
            ('close', None, [sender])):
        function = getattr(library, f'timed_sender_{name}')
        function.restype, function.argtypes = result, arguments
    return library
