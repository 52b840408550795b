# SPDX-License-Identifier: BSD-3-Clause
"""Two network namespaces with a link between them, whose rate, delay and loss can be set.

Needs root and /dev/net/tun. Traffic is between the two only: neither has another interface.
"""
from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import select
import struct
import subprocess
import threading
import time
from typing import List, Tuple

CELL, VIEWER = '10.77.30.1', '10.77.30.2'
_CLONE_NEWNET, _TUNSETIFF = 0x40000000, 0x400454ca
_TUN_WITHOUT_HEADER = 0x1001
_PACKET_BYTES, _BUFFER_BYTES = 1 << 16, 512 << 10


def problem() -> str:
    """Return why namespaces cannot be made here; empty if they can."""
    if os.geteuid() != 0:
        return 'network namespaces need root'
    if not os.access('/dev/net/tun', os.W_OK):
        return 'there is no /dev/net/tun'
    name = f'pv{os.getpid()}x'
    made = subprocess.run(['ip', 'netns', 'add', name], stderr=subprocess.PIPE, text=True,
                          check=False)
    if made.returncode:
        return f'ip netns is not allowed: {made.stderr.strip()}'
    subprocess.run(['ip', 'netns', 'delete', name], check=True)
    return ''


class TwoNetworks:
    """``cell`` and ``viewer`` are the names of the namespaces; both directions are alike."""

    def __init__(self) -> None:
        """Create the link: fast, without delay, and up."""
        self.bytes_s, self.delay_s, self.is_cut = float('inf'), 0.0, False
        self.cell, self.viewer = f'pv{os.getpid()}c', f'pv{os.getpid()}v'
        ends = [_tunnel(self.cell, CELL), _tunnel(self.viewer, VIEWER)]
        self._end, self._closing = os.pipe()
        self._threads = [threading.Thread(target=self._carry, args=pair, daemon=True)
                         for pair in (ends, ends[::-1])]
        self._ends = ends
        for thread in self._threads:
            thread.start()

    def command(self, namespace: str, *words: str) -> List[str]:
        """Return a command that runs another one in a namespace."""
        return ['ip', 'netns', 'exec', namespace, *words]

    def close(self) -> None:
        """Remove everything."""
        os.write(self._closing, b'.')
        for thread in self._threads:
            thread.join()
        for descriptor in (*self._ends, self._end, self._closing):
            os.close(descriptor)
        for name in (self.cell, self.viewer):
            subprocess.run(['ip', 'netns', 'delete', name], check=True)

    def _carry(self, source: int, target: int) -> None:
        """Packets wait for those before them, and for the delay; a full buffer drops them."""
        free_s, number = 0.0, 0
        waiting: List[Tuple[float, int, bytes]] = []
        while True:
            now_s = time.monotonic()
            while waiting and waiting[0][0] <= now_s:
                packet = heapq.heappop(waiting)[2]
                if not self.is_cut:
                    os.write(target, packet)
            rest_s = waiting[0][0] - now_s if waiting else None
            ready, _, _ = select.select([source, self._end], [], [], rest_s)
            if self._end in ready:
                return
            if source in ready:
                packet = os.read(source, _PACKET_BYTES)
                now_s = time.monotonic()
                if self.is_cut or (free_s - now_s) * self.bytes_s > _BUFFER_BYTES:
                    continue
                free_s = max(free_s, now_s) + len(packet) / self.bytes_s
                number += 1
                heapq.heappush(waiting, (free_s + self.delay_s, number, packet))


def _tunnel(namespace: str, address: str) -> int:
    """Create a namespace with one interface; return the descriptor of its other end."""
    for words in (['netns', 'add', namespace],
                  ['-n', namespace, 'tuntap', 'add', 'dev', 'tun0', 'mode', 'tun'],
                  ['-n', namespace, 'address', 'add', f'{address}/24', 'dev', 'tun0'],
                  ['-n', namespace, 'link', 'set', 'dev', 'tun0', 'up'],
                  ['-n', namespace, 'link', 'set', 'dev', 'lo', 'up']):
        subprocess.run(['ip', *words], check=True)
    opened: List[int] = []

    def open_there() -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        with open(f'/run/netns/{namespace}', 'rb') as there:
            if libc.setns(there.fileno(), _CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), 'setns')
        descriptor = os.open('/dev/net/tun', os.O_RDWR)
        fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack('16sH', b'tun0', _TUN_WITHOUT_HEADER))
        opened.append(descriptor)

    thread = threading.Thread(target=open_there)  # only this thread is in the namespace
    thread.start()
    thread.join()
    return opened[0]
