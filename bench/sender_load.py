"""How much of a core the sender's thread takes, by the messages a second that it sends.

usage: scripts/build python3 bench/sender_load.py [--rates 10000,30000,100000] [--seconds 5]

Messages of 100 B, in turn on ten topics with a subscriber each, are given to the sender a tenth of
a second before they are due, as the player does.
"""
from __future__ import annotations

import argparse
import socket
import subprocess
import time
from pathlib import Path
from typing import List, NamedTuple

from process_visualizer.nodes.timed_sender import TimedSender

_TOPICS = 10
_MESSAGE = bytes(100)
_QUEUE, _QUEUE_BYTES = 1_000_000, 1 << 30
_LEAD_NS = 100_000_000
_BREAK_S = 0.002
_END_S = 10.0


class Load(NamedTuple):
    """What one run has come to."""

    sent: int
    late_s: float  # the last message
    cpu_share: float  # of the sender's thread, of one core


def main() -> None:
    options = _options()
    print('| messages/s | sent | the last one late by, ms | CPU, % of a core |\n|---|---|---|---|')
    for rate in options.rates:
        load = _load(rate, options.seconds)
        print(f'| {rate} | {load.sent} | {load.late_s * 1e3:.1f} | {load.cpu_share:.0%} |',
              flush=True)


def _load(rate: int, length_s: float) -> Load:
    sender = TimedSender()
    readers = [_Reader(sender) for _ in range(_TOPICS)]
    try:
        begin_ns = time.monotonic_ns() + _LEAD_NS
        before_ns = _cpu_ns()
        for number in range(int(rate * length_s)):
            due_ns = begin_ns + number * 1_000_000_000 // rate
            while due_ns - time.monotonic_ns() > _LEAD_NS:
                time.sleep(_BREAK_S)  # the load's own pace
            sender.send(readers[number % _TOPICS].topic, 0, [_MESSAGE], due_ns)
        sender.wait_until_sent(_END_S)
        late_s = (time.monotonic_ns() - due_ns) * 1e-9
        cpu_ns = _cpu_ns() - before_ns
        return Load(sum(sender.sent(reader.topic) for reader in readers), late_s,
                    cpu_ns * 1e-9 / (length_s + late_s))
    finally:
        sender.close()
        for reader in readers:
            reader.close()


class _Reader:
    """A subscriber of a topic of its own, in another process."""

    def __init__(self, sender: TimedSender) -> None:
        self._socket, other = socket.socketpair()
        with other:
            self._process = subprocess.Popen(['cat'], stdin=other, stdout=subprocess.DEVNULL)
        self.topic = sender.add_topic(False, _QUEUE, _QUEUE_BYTES)
        sender.add_link(self.topic, self._socket.fileno(), lambda: None)

    def close(self) -> None:
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._process.wait()


def _cpu_ns() -> int:
    """What the sender's thread has computed so far."""
    tasks = [task for task in Path('/proc/self/task').iterdir()
             if (task / 'comm').read_text().strip() == 'timed sender']
    return sum(int((task / 'schedstat').read_text().split()[0]) for task in tasks)


def _options() -> argparse.Namespace:
    def numbers(text: str) -> List[int]:
        return [int(part) for part in text.split(',')]

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rates', type=numbers, default=[10_000, 30_000, 100_000])
    parser.add_argument('--seconds', type=float, default=5.0, help='of each (%(default)s)')
    return parser.parse_args()


if __name__ == '__main__':
    main()
