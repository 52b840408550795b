# SPDX-License-Identifier: BSD-3-Clause
"""A link with a rate, a delay and a long buffer, from an outbox to a viewer; in simulated time."""
from __future__ import annotations

import heapq
from typing import Dict, List, Tuple

from process_visualizer.remote.link_window import LinkWindow
from process_visualizer.remote.outbox import Outbox
from process_visualizer.remote.packets import GREETING, Kind, Message, MessageParts, PacketReader


class SimulatedLink:
    """Bytes leave one after another at a rate and arrive after a delay [s]; so do answers."""

    def __init__(self, bytes_s: float, delay_s: float) -> None:
        self.outbox, self.window = Outbox(), LinkWindow()
        self.now_s = 0.0
        self.ages: Dict[int, List[float]] = {}
        self.sizes: Dict[int, List[int]] = {}
        self._bytes_s, self._delay_s = bytes_s, delay_s
        self._free_s = 0.0
        self._events: List[Tuple[float, int, str, bytes]] = []
        self._number = self._received = 0
        self._reader, self._parts = PacketReader(), MessageParts()
        self._reader.take(GREETING)

    def change(self, bytes_s: float, delay_s: float) -> None:
        """Change rate and delay for everything sent from now on."""
        self._bytes_s, self._delay_s = bytes_s, delay_s

    def put(self, channel: int, size: int, is_kept: bool = False) -> None:
        """Give a message to the outbox, stamped now."""
        if is_kept:
            self.outbox.put_kept(channel, round(self.now_s * 1e9), bytes(size))
        else:
            self.outbox.put(channel, round(self.now_s * 1e9), bytes(size), self.now_s)
        self._send()

    def run_until(self, end_s: float) -> None:
        """Let time pass."""
        while self._events and self._events[0][0] <= end_s:
            self.now_s, _, what, data = heapq.heappop(self._events)
            if what == 'data':
                self._arrive(data)
            else:
                self.window.acknowledged(int.from_bytes(data, 'little'), self.now_s)
            self._send()
        self.now_s = end_s

    def _send(self) -> None:
        while self.window.may_send():
            data = self.outbox.next_packets(self.now_s, self._thinned,
                                           self.window.may_send_large(self.now_s))
            if data is None:
                return
            self.window.sent(len(data), self.now_s)
            self._free_s = max(self._free_s, self.now_s) + len(data) / self._bytes_s
            self._add(self._free_s + self._delay_s, 'data', data)

    def _thinned(self, _channel: int, data: bytes) -> bytes:
        return data[:int(self.window.large_bytes(self.outbox.transfers))]

    def _arrive(self, data: bytes) -> None:
        self._received += len(data)
        self._add(self.now_s + self._delay_s, 'answer', self._received.to_bytes(8, 'little'))
        for packet in self._reader.take(data):
            done = self._parts.begin(packet) if packet.kind == Kind.BEGIN else \
                self._parts.part(packet) if packet.kind == Kind.PART else []
            for message in done:
                self._note(message)

    def _note(self, message: Message) -> None:
        self.ages.setdefault(message.channel, []).append(self.now_s - message.arrived_ns / 1e9)
        self.sizes.setdefault(message.channel, []).append(len(message.data))

    def _add(self, time_s: float, what: str, data: bytes) -> None:
        self._number += 1
        heapq.heappush(self._events, (time_s, self._number, what, data))
