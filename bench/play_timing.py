# SPDX-License-Identifier: BSD-3-Clause
"""Compares the timing of `rosbag play` and of bag_player with the sewing cell's bag.

usage: bench/run play_timing [--rounds 2] [--rates 1,0.25,4] [--folder FOLDER] [--no-rviz]
                             [--together] [--busy N]

20 s with two robots at 125 Hz, forces at 94 Hz, and images of a Kinect at 30 Hz (46 MB/s). The
players take turns (A B B A ...) with the same options, and a subscriber in C++ records when each
message arrives. The schedule error of a message is its arrival minus its due time: its time in
the bag divided by the rate, plus one offset for the whole run (see schedule_error.py). The table
has percentiles of the absolute errors over all rounds. On a virtual machine, a run in which the
host took time is repeated (see stolen_time.py); with ``--together`` the players do not take turns
but play at the same time, each with a master and a subscriber of its own, so that the host disturbs
both equally. With ``--busy`` other programs compute at the same time. The last part plays at 1x
while the whole cell runs in playback mode with RViz on the screen.
"""
from __future__ import annotations

import argparse
import contextlib
import os
import socket
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Dict, Iterator, List, Sequence

import numpy as np
import rospy
from arrival_recorder import ArrivalRecorder, build_recorder
from bag_maker import DEFAULT_FOLDER, MadeBag
from cell_bag import cell_bag
from message_index import indexes
from players import COMMANDS, OURS, PEER, playing, ros_master
from schedule_error import TopicArrivals, TopicError, pooled, schedule_errors
from stolen_time import undisturbed
from timing_table import print_table

from process_visualizer.launching.run import LaunchRun
from process_visualizer.nodes.view_picture import ViewWatcher

_LENGTH_S = 20.0
_DELAY_S = 4.0
"""Delay from advertising to the first message, so that every subscriber is connected by then."""
_VIEW_TIMEOUT_S = 90.0
_CELL = str(Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml')


def main() -> None:
    options = _options()
    build_recorder()
    bag = cell_bag(options.folder, _LENGTH_S)
    with ros_master(), _busy(options.busy):
        for rate in options.rates:
            _compare(bag, rate, options, f'{rate:g}x', aim=0.5 if rate == 1 else 1.0)
        if options.rviz:
            with _cell_with_rviz(bag):
                _compare(bag, 1.0, options, '1x, RViz draws the cell', aim=1.0)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rounds', type=int, default=2, help='runs of each player (%(default)s)')
    parser.add_argument('--rates', default=[1.0, 0.25, 4.0],
                        type=lambda text: [float(part) for part in text.split(',') if part])
    parser.add_argument('--folder', default=DEFAULT_FOLDER, help='for the bag (%(default)s)')
    parser.add_argument('--players', default=[PEER, OURS], choices=list(COMMANDS), nargs='+')
    parser.add_argument('--together', action='store_true', help='let all play at the same time')
    parser.add_argument('--busy', type=int, default=0, help='other programs that compute')
    parser.add_argument('--no-rviz', dest='rviz', action='store_false')
    return parser.parse_args()


def _compare(bag: MadeBag, rate: float, options: argparse.Namespace, title: str,
             aim: float) -> None:
    runs: Dict[str, List[List[TopicError]]] = {player: [] for player in options.players}
    for turn in range(options.rounds):
        players = options.players[::-1 if turn % 2 else 1]
        for group in [players] if options.together else [[player] for player in players]:
            errors, stolen = undisturbed(partial(_play_all, bag, group, rate))
            for player in group:
                runs[player].append(errors[player])
            print(f'{title}, {" and ".join(group)}: the host took {stolen:.2%} of the time',
                  flush=True)
    print_table(title, [topic.name for topic in bag.topics],
                {player: pooled(errors) for player, errors in runs.items()}, aim)


def _play_all(bag: MadeBag, players: Sequence[str], rate: float) -> Dict[str, List[TopicError]]:
    """Let several players play at the same time."""
    if len(players) == 1:
        return {players[0]: _play(bag, players[0], rate)}
    with ProcessPoolExecutor(len(players)) as processes:
        play = partial(_play_apart, str(bag.path.parent), rate=rate)
        return dict(zip(players, processes.map(play, players)))


def _play_apart(folder: str, player: str, rate: float) -> List[TopicError]:
    """Play the bag in a folder, with a master and a process of its own."""
    os.environ['ROS_MASTER_URI'] = f'http://127.0.0.1:{_free_port()}'
    os.environ['ROS_HOME'] = tempfile.mkdtemp(dir=os.environ['ROS_HOME'])
    with ros_master():
        return _play(cell_bag(folder, _LENGTH_S), player, rate)


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(('127.0.0.1', 0))
        return int(listener.getsockname()[1])


def _play(bag: MadeBag, player: str, rate: float) -> List[TopicError]:
    """Play the bag once, from a file in the page cache."""
    _read_all(bag)
    path = os.path.join(os.environ['ROS_HOME'], 'arrivals')
    options = ['-r', f'{rate:g}', '-d', f'{_DELAY_S:g}']
    with ArrivalRecorder([topic.name for topic in bag.topics], path) as recorder:
        with playing(player, bag.path, options) as process:
            if process.wait() != 0:
                raise RuntimeError(f'{player} ended with exit code {process.returncode}')
        arrivals = recorder.finish()
    small = [number for number, topic in enumerate(bag.topics) if 'Image' not in
             topic.message_class.__name__]
    return schedule_errors(_by_topic(bag, arrivals), small, rate)


def _read_all(bag: MadeBag) -> None:
    with open(bag.path, 'rb') as file:
        while file.read(1 << 24):
            pass


def _by_topic(bag: MadeBag, arrivals: np.ndarray) -> Sequence[TopicArrivals]:
    topics = []
    for number, topic in enumerate(bag.topics):
        its = arrivals[arrivals['topic'] == number]
        topics.append(TopicArrivals(indexes(topic.message_class._type, its['front']),
                                    its['time_ns'], bag.times_ns(number)))
    return topics


@contextlib.contextmanager
def _busy(count: int) -> Iterator[None]:
    """A number of programs that compute without a pause."""
    programs = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


@contextlib.contextmanager
def _cell_with_rviz(bag: MadeBag) -> Iterator[None]:
    """The cell in playback mode, once RViz has drawn everything in the bag."""
    folder = os.path.join(os.environ['ROS_HOME'], 'play_timing')
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', _CELL, '--mode',
                    'playback', '--output', folder], check=True, stdout=subprocess.DEVNULL)
    run = LaunchRun(f'{folder}/cell.launch', lambda report: None)
    try:
        rospy.init_node('play_timing', anonymous=True, disable_signals=True)
        watcher = ViewWatcher()
        with playing(PEER, bag.path, ['-l']):
            if not watcher.wait_until_ok(_VIEW_TIMEOUT_S):
                raise RuntimeError('RViz does not draw the cell:\n' + '\n'.join(watcher.problems()))
        yield
    finally:
        run.stop()


if __name__ == '__main__':
    main()
