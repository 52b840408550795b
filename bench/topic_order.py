# SPDX-License-Identifier: BSD-3-Clause
"""Plays messages of mixed sizes, and checks that each topic keeps the order of the recording.

usage: bench/run topic_order [--messages 100000] [--rates=1,-1,16,-16] [--folder FOLDER]

Three topics with messages of 12 B to 900 kB (one of 20 is larger than 1 kB), 2,000 a second in
all, are played from end to end. A subscriber in C++ records the arrivals. A message is out of order
if one that is later in the direction of play has come before it. Ends with 1 if one is out of order
or lost.
"""
from __future__ import annotations

import argparse
import os
import random
import sys
import time
from functools import partial
from pathlib import Path
from typing import List, NamedTuple

import numpy as np
from arrival_recorder import ArrivalRecorder, build_recorder
from bag_maker import DEFAULT_FOLDER, BagTopic, MadeBag, made_bag, message_count
from message_index import indexes, text_message
from players import OURS, playing, ros_master
from std_msgs.msg import String

_TOPICS = ('/one', '/two', '/three')
_TOPIC_HZ = 667
_SMALLEST, _SMALL, _LARGEST = 12, 1_000, 900_000  # bytes
_LARGE_SHARE = 0.05
_DELAY_S = 3.0  # so that the subscriber is connected
_QUEUE = 100_000


class Order(NamedTuple):
    """The arrivals of all topics in one run."""

    rate: float
    messages: int  # of the bag
    disordered: int
    lost: int
    duration_s: float


def mixed_bag(folder: str, messages: int) -> MadeBag:
    """Return the bag of about this many messages from the folder; write it if it does not exist."""
    length_s = messages / (_TOPIC_HZ * len(_TOPICS))
    topics = [BagTopic(name, _TOPIC_HZ, String, partial(_content, name)) for name in _TOPICS]
    return made_bag(Path(folder) / f'mixed_{messages}.bag', topics, length_s)


def _content(topic: str, index: int, _time_ns: int) -> bytes:
    chance = random.Random(f'{topic} {index}')
    if chance.random() < _LARGE_SHARE:
        return text_message(index, int(_SMALL * (_LARGEST / _SMALL) ** chance.random()))
    return text_message(index, chance.randint(_SMALLEST, _SMALL))


def played(bag: MadeBag, rate: float, folder: str) -> Order:
    """Play a bag from end to end, and return the arrivals; needs a master."""
    names = [topic.name for topic in bag.topics]
    with ArrivalRecorder(names, os.path.join(folder, 'arrivals')) as recorder:
        begin_s = time.monotonic()
        options = [f'--rate={rate:g}', '-d', f'{_DELAY_S:g}', '--queue', str(_QUEUE)]
        with playing(OURS, bag.path, options) as player:
            if player.wait() != 0:
                raise RuntimeError(f'the player has ended with {player.returncode}')
        duration_s = time.monotonic() - begin_s - _DELAY_S
        arrivals = recorder.finish()
    return _order(bag, rate, arrivals, duration_s)


def _order(bag: MadeBag, rate: float, arrivals: np.ndarray, duration_s: float) -> Order:
    disordered = lost = messages = 0
    for number, topic in enumerate(bag.topics):
        came = indexes('std_msgs/String', arrivals['front'][arrivals['topic'] == number])
        came = came if rate > 0 else -came
        count = message_count(topic, bag.length_s)
        disordered += int(np.sum(came < np.maximum.accumulate(came)))
        lost += count - len(np.unique(came))
        messages += count
    return Order(rate, messages, disordered, lost, duration_s)


def main() -> None:
    options = _options()
    build_recorder()
    bag = mixed_bag(options.folder, options.messages)
    orders: List[Order] = []
    print('| rate | messages | out of order | lost | to play, s |\n|---|---|---|---|---|')
    with ros_master():
        for rate in options.rates:
            orders.append(played(bag, rate, options.folder))
            print(f'| {rate:g}x | {orders[-1].messages} | {orders[-1].disordered} '
                  f'| {orders[-1].lost} | {orders[-1].duration_s:.0f} |', flush=True)
    sys.exit(1 if any(order.disordered or order.lost for order in orders) else 0)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--messages', type=int, default=100_000, help='of the bag (%(default)s)')
    parser.add_argument('--rates', default=[1.0, -1.0, 16.0, -16.0],
                        type=lambda text: [float(part) for part in text.split(',') if part])
    parser.add_argument('--folder', default=DEFAULT_FOLDER, help='for the bag (%(default)s)')
    return parser.parse_args()


if __name__ == '__main__':
    main()
