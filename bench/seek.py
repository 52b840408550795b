# SPDX-License-Identifier: BSD-3-Clause
"""Measures the player's delays: of seeks while paused, pauses and changes of rate.

usage: bench/run seek [--seeks 200] [--commands 50] [--folder FOLDER]

A subscriber in C++ calls the services over connections that stay open and records the arrivals.

seek: from the request until every topic's last message at or before the position has arrived;
random positions, one every 0.35 s, in a bag with an hour of a robot cell (3 million small messages
on 9 topics) and in a minute with a Kinect (46 MB/s). Every message carries its index, so that
those of an earlier seek do not count.
pause: from the request to the last new message that arrives, playing the Kinect bag at 1x.
rate: from the request until the rate at which messages arrive changes, between 1x and 0.25x there
(see command_latency.py); also until ~state says so.
"""
from __future__ import annotations

import argparse
import os
import random
import time
from typing import Callable, Iterable, List, NamedTuple, Tuple

import numpy as np
from arrival_recorder import Answer, ArrivalRecorder, build_recorder
from bag_maker import BEGIN_NS, DEFAULT_FOLDER, MadeBag
from cell_bag import cell_bag
from command_latency import (
    Seen,
    pause_latency_ms,
    rate_latency_ms,
    scene_latency_ms,
    state_rate,
)
from message_index import indexes
from players import OURS, playing, ros_master
from robots_bag import robots_bag

_STATE = '/bag_player/state'
_PERIOD_S, _MAX_PERIOD_S = 0.3, 0.4
_SETTLED_NS = 100_000_000
"""After a change of rate; the line of the new rate is fitted to later arrivals."""
_RATES = (0.25, 1.0)
_CONNECT_TIMEOUT_S = 30.0
_ROBOTS_MINUTES, _CELL_S = 60.0, 60.0


class Session(NamedTuple):
    """A bag, the commands with their answers, and all arrivals; ~state has the last number."""

    bag: MadeBag
    answers: List[Answer]
    arrivals: np.ndarray

    def seen(self) -> Seen:
        """Return the arrivals of the bag's topics."""
        its = self.arrivals[self.arrivals['topic'] < len(self.bag.topics)]
        numbers = np.zeros(len(its), np.int64)
        for topic, made in enumerate(self.bag.topics):
            of_topic = its['topic'] == topic
            numbers[of_topic] = indexes(made.message_class._type, its['front'][of_topic])
        return Seen(its['time_ns'], its['topic'], numbers)

    def spans(self) -> Iterable[Tuple[Answer, int]]:
        """Return each answer with the time of the next request [ns]."""
        ends = [answer.request_ns for answer in self.answers[1:]] + [1 << 62]
        return zip(self.answers, ends)


def main() -> None:
    options = _options()
    build_recorder()
    random.seed(1)
    robots, cell = robots_bag(options.folder, _ROBOTS_MINUTES), cell_bag(options.folder, _CELL_S)
    print('| what | bag | p50, ms | p95, ms | max, ms | of | failed | aim: p95, ms |\n'
          '|---|---|---|---|---|---|---|---|')
    for name, bag, aim_ms in (('1 h', robots, 30), ('Kinect', cell, 100)):
        _print('seek', name, _seek(bag, options.seeks), aim_ms)
    answered, stopped = _pause(cell, options.commands)
    _print('pause: answer', 'Kinect', answered)
    _print('pause: last new message', 'Kinect', stopped, 20)
    answered, changed, stated = _change_rate(cell, options.commands)
    _print('rate: answer', 'Kinect', answered)
    _print('rate: messages', 'Kinect', changed, 20)
    _print('rate: ~state', 'Kinect', stated)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeks', type=int, default=200)
    parser.add_argument('--commands', type=int, default=50)
    parser.add_argument('--folder', default=DEFAULT_FOLDER, help='for the bags (%(default)s)')
    return parser.parse_args()


def _seek(bag: MadeBag, count: int) -> List[float]:
    positions = [round(random.uniform(0, bag.length_s), 6) for _ in range(count)]
    session = _session(bag, [f'seek {position}' for position in positions])
    seen = session.seen()
    latencies = []
    for position, (answer, end_ns) in zip(positions, session.spans()):
        at_ns = BEGIN_NS + round(position * 1e9)
        expected = [int(np.searchsorted(bag.times_ns(number), at_ns, 'right')) - 1
                    for number in range(len(bag.topics))]
        latencies.append(scene_latency_ms(seen.between(answer.request_ns, end_ns),
                                          answer.request_ns, expected))
    return latencies


def _pause(bag: MadeBag, count: int) -> Tuple[List[float], List[float]]:
    """Return the latencies of the answers and of the last messages [ms]."""
    session = _session(bag, ['play', 'pause'] * count)
    seen = session.seen().first_arrivals()
    pauses = list(session.spans())[1::2]
    return _answer_latencies(answer for answer, _ in pauses), [
        pause_latency_ms(seen.between(answer.request_ns, end_ns), answer.request_ns)
        for answer, end_ns in pauses]


def _change_rate(bag: MadeBag, count: int) -> Tuple[List[float], List[float], List[float]]:
    """Return the latencies of the answers, of the messages' rate and of ~state's [ms]."""
    rates = [_RATES[number % 2] for number in range(count)]
    session = _session(bag, ['play', *(f'rate {rate}' for rate in rates)])
    seen = session.seen()
    times_ns = [bag.times_ns(number) for number in range(len(bag.topics))]
    states = session.arrivals[session.arrivals['topic'] == len(bag.topics)]
    changed, stated = [], []
    for before, (answer, end_ns), old, new in zip(session.answers, list(session.spans())[1:],
                                                  [1.0, *rates], rates):
        request_ns = answer.request_ns
        end_ns = min(end_ns, request_ns + round(_PERIOD_S * 1e9))
        changed.append(rate_latency_ms(
            seen.between(before.request_ns + _SETTLED_NS, request_ns),
            seen.between(request_ns + _SETTLED_NS, end_ns), times_ns, old, new, request_ns))
        stated.append(_state_latency_ms(states, new, request_ns, end_ns))
    return _answer_latencies(session.answers[1:]), changed, stated


def _state_latency_ms(states: np.ndarray, rate: float, begin_ns: int, end_ns: int) -> float:
    for state in states[(states['time_ns'] >= begin_ns) & (states['time_ns'] < end_ns)]:
        if state_rate(state['front']) == rate:
            return float(state['time_ns'] - begin_ns) / 1e6
    return float('nan')


def _answer_latencies(answers: Iterable[Answer]) -> List[float]:
    return [(answer.answer_ns - answer.request_ns) / 1e6 for answer in answers]


def _session(bag: MadeBag, commands: List[str]) -> Session:
    """Start the player, paused, and give it the commands, one after another."""
    path = os.path.join(os.environ['ROS_HOME'], 'arrivals')
    topics = [topic.name for topic in bag.topics] + [_STATE]
    # A separate master: it remembers the types of topics, and the other bags have different ones.
    with ros_master(), ArrivalRecorder(topics, path) as recorder:
        with playing(OURS, bag.path, ['--pause', '-k']):
            _wait_until(lambda: recorder.connected() == len(topics), _CONNECT_TIMEOUT_S)
            answers = [_at_random_time(recorder, command) for command in commands]
            time.sleep(_PERIOD_S)
        return Session(bag, answers, recorder.finish())


def _at_random_time(recorder: ArrivalRecorder, command: str) -> Answer:
    """Wait until the last command takes effect; the delay is random relative to the images."""
    time.sleep(random.uniform(_PERIOD_S, _MAX_PERIOD_S))
    answer = recorder.call(command)
    if not answer.success:
        raise RuntimeError(f'bag_player refuses "{command}": {answer.message}')
    return answer


def _wait_until(holds: Callable[[], bool], timeout_s: float) -> None:
    """Check ten times a second, as a subscriber is not notified of its connections."""
    deadline = time.monotonic() + timeout_s
    while not holds():
        if time.monotonic() > deadline:
            raise RuntimeError('bag_player does not publish the topics of its bag')
        time.sleep(0.1)


def _print(what: str, bag: str, latencies_ms: List[float], aim_ms: float = float('inf')) -> None:
    """Print a row; failures count as infinitely late."""
    values = np.array(latencies_ms)
    failed = int(np.isnan(values).sum())
    ordered = np.sort(np.where(np.isnan(values), np.inf, values))
    p50, p95 = (ordered[min(len(ordered) - 1, int(part * len(ordered)))] for part in (0.5, 0.95))
    aim = f'{aim_ms:g}{"" if p95 <= aim_ms else " (!)"}' if np.isfinite(aim_ms) else ''
    print(f'| {what} | {bag} | {p50:.1f} | {p95:.1f} | {ordered[-1]:.1f} | {len(values)} | '
          f'{failed} | {aim} |', flush=True)


if __name__ == '__main__':
    main()
