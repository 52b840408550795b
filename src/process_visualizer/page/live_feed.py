# SPDX-License-Identifier: BSD-3-Clause
"""Messages for the viewers of a live page: each is encoded once, and none is sent when outdated.

The feed keeps the newest message of each kind. A viewer gets the new ones after it has acknowledged
the earlier ones; it never gets messages that have been replaced in the meantime. So nothing queues
up for a slow viewer, and no viewer slows down another.
"""
from __future__ import annotations

import hmac
from collections import deque
from enum import IntEnum
from struct import Struct
from typing import Deque, Dict, NamedTuple, Optional, Tuple, Union
from urllib.parse import urlsplit

from process_visualizer.remote.link_window import LinkWindow

Message = Union[str, bytes]
MEMORY_S = 300.0
"""Maximum time that a viewer can look back just after it has connected."""
MAX_RECENT = 1500
"""Maximum number of frames in an answer; of more frames, every second, third, ... is sent."""
_LENGTH = Struct('<I')


class Slot(IntEnum):
    """The kinds of messages; a layout comes before the frames that use it."""

    LAYOUT = 0
    STATE = 1
    FRAME = 2
    LANES = 3
    OBJECTS = 4
    CLOUD = 5


class _Kept(NamedTuple):
    time_s: float
    layout: int
    data: bytes


class LiveFeed:
    """The newest messages, and the frames of the last minutes."""

    def __init__(self, memory_s: float = MEMORY_S) -> None:
        """Begin without messages."""
        self._memory_s = memory_s
        self._newest: Dict[Slot, Tuple[int, Message]] = {}
        self._kept: Deque[_Kept] = deque()
        self._layout = 0

    def put(self, slot: Slot, message: Message) -> None:
        """Replace the newest message of a kind; an equal one is not sent again."""
        number, before = self._newest.get(slot, (0, b''))
        if message != before:
            self._newest[slot] = number + 1, message

    def put_frame(self, time_s: float, layout: int, data: bytes) -> None:
        """Replace the newest frame, and keep it; ``time_s`` must increase."""
        self.put(Slot.FRAME, data)
        self._layout = layout
        self._kept.append(_Kept(time_s, layout, data))
        while self._kept[0].time_s < time_s - self._memory_s:
            self._kept.popleft()

    def newest(self, slot: Slot) -> Tuple[int, Message]:
        """Return the number of the newest message of a kind (0: none) and the message."""
        return self._newest.get(slot, (0, b''))

    def recent(self, after_s: float, before_s: float) -> bytes:
        """Return the kept frames between two times, each preceded by its length (32 bits).

        Frames with a layout other than the current one are left out.
        """
        found = [it.data for it in self._kept
                 if after_s < it.time_s < before_s and it.layout == self._layout]
        step = max(-(-len(found) // MAX_RECENT), 1)
        return b''.join(_LENGTH.pack(len(it)) + it for it in found[::step])


_MIN_BYTES, _BEGIN_BYTES = 1500, 4000
"""Bytes in flight to a viewer: two messages on any link, and more while the link is unknown."""
_QUEUED_S, _MAX_QUEUED_S = 0.2, 0.5
_CLOUD_SHARE = 0.25
"""Maximum share of the time with a cloud in flight, so that frames do not wait for clouds."""
_GONE_S = 20.0
"""Time without an answer after which a viewer is considered gone."""
_GIVES_WAY_S = 5.0
"""The same if another viewer waits: perhaps the same one, after a lost connection."""


class ViewerPace:
    """Decides what a viewer is sent next; times [s] are those of a clock that does not jump.

    On a link slower than the feed, every buffer on the way would fill up and cause a delay of
    seconds. So no more bytes are in flight than the link can carry (`LinkWindow`).
    """

    def __init__(self, feed: LiveFeed, now_s: float, has_clouds: bool = False) -> None:
        """Begin with nothing sent; ``has_clouds``: the viewer also wants clouds."""
        self._feed = feed
        self.has_clouds = has_clouds
        self._had: Dict[Slot, int] = {}
        self._others = deque((Slot.STATE, Slot.FRAME, Slot.LANES, Slot.OBJECTS))  # in turn
        if has_clouds:
            self._others.append(Slot.CLOUD)
        self._cloud: Optional[Tuple[int, float]] = None  # in flight: count, time of sending
        self._cloud_from_s = now_s
        self._window = LinkWindow(_MIN_BYTES, _BEGIN_BYTES, _QUEUED_S, _MAX_QUEUED_S)
        self._sent: Deque[Tuple[int, int]] = deque()  # messages and bytes up to each of them
        self._bytes = 0
        self._count = self._answered = 0
        self._answered_s = now_s

    def next(self, now_s: float) -> Optional[Message]:
        """Return the message to send now, which then counts as sent; None if there is none."""
        if not self._window.may_send_large(now_s):
            return None
        for slot in (Slot.LAYOUT, *self._others):
            number, message = self._feed.newest(slot)
            is_early = slot is Slot.CLOUD and (self._cloud is not None
                                               or now_s < self._cloud_from_s)
            if number != self._had.get(slot, 0) and not is_early:
                self._note(slot, number, len(message), now_s)
                return message
        return None

    def _note(self, slot: Slot, number: int, size: int, now_s: float) -> None:
        self._had[slot] = number
        self._count += 1
        self._bytes += size
        if not self._sent:
            self._answered_s = now_s
        self._sent.append((self._count, self._bytes))
        self._window.sent(size, now_s)
        if slot is Slot.CLOUD:
            self._cloud = self._count, now_s
        if slot in self._others:
            self._others.remove(slot)
            self._others.append(slot)

    def answered(self, count: int, now_s: float) -> bool:
        """Note the number of messages received by the viewer; return whether it is valid and new.

        Thus a viewer cannot acknowledge more than was sent to it.
        """
        if not self._answered < count <= self._count:
            return False
        self._answered = count
        self._answered_s, total = now_s, 0
        while self._sent and self._sent[0][0] <= count:
            _, total = self._sent.popleft()
        self._window.acknowledged(total, now_s)
        if self._cloud is not None and self._cloud[0] <= count:
            took_s = now_s - self._cloud[1]
            self._cloud, self._cloud_from_s = None, now_s + took_s * (1.0 / _CLOUD_SHARE - 1.0)
        return True

    def is_gone(self, now_s: float, is_awaited: bool = False) -> bool:
        """Return whether the viewer has stopped answering; sooner if another one waits."""
        longest_s = _GIVES_WAY_S if is_awaited else _GONE_S
        return bool(self._sent) and now_s - self._answered_s > longest_s


class Refusal(NamedTuple):
    """Reason for refusing a request: the HTTP status, and a text for the user."""

    status: int
    text: str


_LOCAL = ('localhost', '127.0.0.1', '::1')


class Admission:
    """Decides who may see the page.

    The token is the first part of the path. Without a token, only this computer's own names are
    accepted as host, so that no other site can direct a browser here under its own name.
    """

    def __init__(self, token: str) -> None:
        """Initialize with the token; '': only this computer can connect, without a token."""
        self._token = token

    def path(self) -> str:
        """Return the path of the page."""
        return f'/{self._token}/' if self._token else '/'

    def asked(self, path: str) -> Optional[str]:
        """Return the part of a path after the token; None if the token is wrong or missing."""
        if not self._token:
            return path[1:]
        token, separator, rest = path[1:].partition('/')
        is_right = hmac.compare_digest(token.encode('utf-8', 'surrogatepass'),
                                       self._token.encode())
        return rest if is_right and separator else None

    def refusal(self, path: str, host: str, origin: Optional[str],
                is_socket: bool) -> Optional[Refusal]:
        """Return the reason for refusing a request; None if it is allowed.

        Args:
            path: path of the request, with the token.
            host: its header Host.
            origin: its header Origin; None without one.
            is_socket: whether it requests the WebSocket that shows the cell.
        """
        if not self._token and _name(host) not in _LOCAL:
            return Refusal(403, 'This page is for this computer only; open it as localhost.')
        if self.asked(path) is None:
            return Refusal(403, 'This address is not right: it has to end with the token that '
                                '"cell serve" has printed.')
        if (is_socket or origin is not None) and not _is_same(origin, host):
            return Refusal(403, 'Another page requested this one; open it directly.')
        return None


def _name(host: str) -> str:
    try:
        return urlsplit(f'//{host}').hostname or ''
    except ValueError:
        return ''


def _is_same(origin: Optional[str], host: str) -> bool:
    if origin is None:
        return False
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ('http', 'https') and parts.netloc.lower() == host.lower()

