# SPDX-License-Identifier: BSD-3-Clause
"""Gives the player random commands, and compares the scene with a scan of the recording.

usage: bench/run random_commands [--commands 2000] [--seed 1] [--seconds 10] [--folder FOLDER]

The test uses a bag of images of 2.5 MB at 30 Hz beside small topics (see scene_bag.py), the player,
a master and a subscriber of all topics. Commands: seek, scrub (seeks without a pause), play, pause,
stop, rate, direction, loop, and steps by messages, by those of a topic, and by time. Some are given
while another one is executed: right after it, or from another thread. After each of the others
(and, if it plays then, after a pause or steps), the last message on every topic must be the one
that a scan of the bag finds at the position in ~state, once nothing arrives any more. Ends with 1
if it is not, or if the player ends.
"""
from __future__ import annotations

import argparse
import random
import sys
import threading
import time
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Tuple

import numpy as np
import rospy
from bag_maker import DEFAULT_FOLDER, MadeBag
from players import OURS, playing, ros_master
from scene_bag import scene_bag
from scene_watch import SceneWatch
from std_srvs.srv import Trigger

from process_visualizer.srv import Seek, SetLoop, SetRate, Step

_QUIET_S = 0.12  # the player publishes the scene once more after 0.1 s
_LATE_S = 10.0  # for a scene that a slow subscriber has not taken yet
_MAX_S = 60.0  # a subscriber in Python may have 64 MB of images to take first
_RATES = (0.1, 0.5, 1.0, 2.0, 4.0)
_STEPS_S = (0.001, 0.01, 0.1, 1.0)
_PLAYED_S = 0.3  # the longest time to play before the next command
_AT_ONCE, _BESIDE = 0.25, 0.15  # shares of the commands

Command = Tuple[str, Callable[[], Any]]


class Result(NamedTuple):
    """Number of commands of each kind, and their results."""

    given: Dict[str, int]
    compared: int
    latencies_ms: List[float]  # from the answer to the scene
    wrong: List[str]


class Services:
    """The player's services; each call has its own connection, for any thread."""

    def __init__(self) -> None:
        """Wait for the player."""
        rospy.wait_for_service('/bag_player/step', _MAX_S)

    def call(self, name: str, service: Any = Trigger, *values: Any) -> None:
        """Call a service; it may refuse a command that is not possible.

        Raises:
            rospy.ServiceException: there is no answer.
        """
        rospy.ServiceProxy(f'/bag_player/{name}', service)(*values)


class RandomCommands:
    """Commands for a bag; the same seed gives the same commands."""

    def __init__(self, bag: MadeBag, seed: int) -> None:
        """Wait for the player's services."""
        self._bag, self._random, self._services = bag, random.Random(seed), Services()
        call = self._services.call
        self._kinds: List[Callable[[], Command]] = [
            lambda: ('play', lambda: call('play')), lambda: ('pause', lambda: call('pause')),
            lambda: ('stop', lambda: call('stop')), self._seek, self._scrub, self._rate,
            self._loop, self._step, self._topic_step, self._time_step]
        self._weights = [6, 2, 0.5, 4, 2, 4, 2, 3, 3, 4]

    def next(self) -> Command:
        """Return the name of a command and the function that gives it."""
        return self._random.choices(self._kinds, self._weights)[0]()

    def ending(self) -> List[Command]:
        """Return commands that end playback: a pause, or steps during playback."""
        if self._random.random() < 0.5:
            return [('pause', lambda: self._services.call('pause'))]
        return [self._time_step() for _ in range(self._random.randint(1, 4))]

    def share(self) -> float:
        """Return a number from 0 to 1."""
        return self._random.random()

    def _seek(self) -> Command:
        position_s = self._random.uniform(-0.5, self._bag.length_s + 0.5)
        return 'seek', lambda: self._services.call('seek', Seek, position_s)

    def _scrub(self) -> Command:
        begin_s = self._random.uniform(0.0, self._bag.length_s)
        positions_s = [begin_s + 0.05 * number for number in range(self._random.randint(3, 8))]
        return 'scrub', lambda: [self._services.call('seek', Seek, position_s)
                                 for position_s in positions_s]

    def _rate(self) -> Command:
        rate = self._random.choice(_RATES) * self._random.choice((1, 1, -1))
        return ('rate' if rate > 0 else 'backwards',
                lambda: self._services.call('set_rate', SetRate, rate))

    def _loop(self) -> Command:
        begin_s = self._random.uniform(0.0, self._bag.length_s - 1.0)
        loop = self._random.random() < 0.5
        return 'loop', lambda: self._services.call('set_loop', SetLoop, loop, begin_s,
                                                   begin_s + 0.7)

    def _step(self) -> Command:
        count = self._random.choice((-20, -2, -1, 1, 2, 20))
        return 'step', lambda: self._services.call('step', Step, count, '', 0.0)

    def _topic_step(self) -> Command:
        count, topic = self._random.choice((-3, -1, 1, 3)), self._random.choice(self._bag.topics)
        return 'step, topic', lambda: self._services.call('step', Step, count, topic.name, 0.0)

    def _time_step(self) -> Command:
        time_s = self._random.choice(_STEPS_S) * self._random.choice((1, 1, -1))
        return 'step, time', lambda: self._services.call('step', Step, 0, '', time_s)


class Session:
    """A player that gets random commands."""

    def __init__(self, bag: MadeBag, seed: int) -> None:
        """Follow the running player."""
        self._watch = SceneWatch(bag)
        self._commands = RandomCommands(bag, seed)
        self._services = Services()
        self._result = Result(Counter(), 0, [], [])
        self._beside: List['Future[None]'] = []
        self._counting = threading.Lock()

    def run(self, count: int) -> Result:
        """Give a number of commands.

        Raises:
            RuntimeError, rospy.ServiceException: the player does not answer any more.
        """
        with ThreadPoolExecutor(2) as others:
            while sum(self._result.given.values()) < count:
                self._one(others)
            self._settle()
        return self._result

    def _one(self, others: ThreadPoolExecutor) -> None:
        name, give = self._commands.next()
        way = self._commands.share()
        if way < _BESIDE:
            self._beside.append(others.submit(self._give, name, give))
            return
        self._give(name, give)
        if way >= _BESIDE + _AT_ONCE:
            self._settle()

    def _give(self, name: str, give: Callable[[], Any]) -> None:
        with self._counting:
            self._result.given[name] = self._result.given.get(name, 0) + 1
        give()

    def _settle(self) -> None:
        """Pause, and compare."""
        for call in self._beside:
            call.result()
        self._beside.clear()
        if not self._watch.state_since(rospy.Time.now(), _MAX_S).paused:
            time.sleep(self._commands.share() * _PLAYED_S)  # nothing to wait for: it plays
            for name, give in self._commands.ending():
                self._give(name, give)
        self._compare(time.monotonic())

    def _compare(self, answered_s: float) -> None:
        position_s = self._watch.state_since(rospy.Time.now(), _MAX_S).position
        since_s = self._watch.scene_since(position_s, _MAX_S)
        if since_s is not None:
            self._result.latencies_ms.append(max(since_s - answered_s, 0.0) * 1e3)
        wrong = self._watch.differences(position_s, _QUIET_S, _LATE_S)
        self._result = self._result._replace(compared=self._result.compared + 1)
        if wrong:
            given = sum(self._result.given.values())
            self._result.wrong.append(f'after {given} commands, at {position_s:.6f} s: '
                                      f'{"; ".join(wrong)}')


@contextmanager
def commanded(bag: MadeBag, seed: int) -> Iterator[Session]:
    """A player of a bag, paused at its beginning, and a session; a master and a node exist."""
    with playing(OURS, bag.path, ['--pause', '-k']) as player:
        yield Session(bag, seed)
        if player.poll() is not None:
            raise RuntimeError(f'the player has ended with {player.returncode}')


def main() -> None:
    options = _options()
    bag = scene_bag(options.folder, options.seconds)
    with ros_master():
        rospy.init_node('random_commands', anonymous=True, disable_signals=True)
        begin_s = time.monotonic()
        with commanded(bag, options.seed) as session:
            result = session.run(options.commands)
        _print(result, time.monotonic() - begin_s)
    sys.exit(1 if result.wrong else 0)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--commands', type=int, default=2000, help='how many (%(default)s)')
    parser.add_argument('--seed', type=int, default=1, help='which ones (%(default)s)')
    parser.add_argument('--seconds', type=float, default=10.0, help='of the bag (%(default)s)')
    parser.add_argument('--folder', default=DEFAULT_FOLDER, help='for the bag (%(default)s)')
    return parser.parse_args()


def _print(result: Result, duration_s: float) -> None:
    print('\n| command | given |\n|---|---|')
    for name, count in sorted(result.given.items()):
        print(f'| {name} | {count} |')
    print(f'| all, in {duration_s:.0f} s | {sum(result.given.values())} |')
    p50, p95, most = np.percentile(result.latencies_ms, [50, 95, 100])
    print('\n| scenes compared | wrong | from the answer to the scene: p50, p95, max, ms |\n'
          f'|---|---|---|\n| {result.compared} | {len(result.wrong)} '
          f'| {p50:.0f}, {p95:.0f}, {most:.0f} |')
    for line in result.wrong:
        print(line)


if __name__ == '__main__':
    main()
