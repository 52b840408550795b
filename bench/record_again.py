# SPDX-License-Identifier: BSD-3-Clause
"""Records, plays the recording, records that, and compares the messages of the two bags.

usage: bench/run record_again [--seconds 30] [--cameras 1]

Messages are compared byte by byte; "more" are those that the second bag has after them (a player
may show the last messages again when it ends). The spacing of a topic is the time from one message
to the next; the table gives its difference between the bags.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from typing import List

import numpy as np
import rospy
from recorders import OwnRecorder, load_program, topics_of_load
from roslib.packages import find_node

from process_visualizer.bagio.recording import Recording


def main() -> int:
    options = _options()
    program = load_program()
    port = os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1]
    master = subprocess.Popen(['roscore', '-p', port], stdout=subprocess.DEVNULL)
    os.makedirs(os.environ['ROS_HOME'], exist_ok=True)
    try:
        rospy.init_node('record_again', disable_signals=True)
        with tempfile.TemporaryDirectory(dir=os.environ['ROS_HOME']) as folder:
            topics = topics_of_load(options.cameras)
            first, second = f'{folder}/first.bag', f'{folder}/second.bag'
            _record(first, topics, [program, str(options.seconds), str(options.cameras)])
            player = str(find_node('process_visualizer', 'bag_player')[0])
            _record(second, topics, [player, first, '--wait-for-subscribers', '--quiet',
                                     '--stamps', 'recorded', '--topics', *topics])
            return _compare(first, second, topics)
    finally:
        master.terminate()
        master.wait()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=int, default=30)
    parser.add_argument('--cameras', type=int, default=1)
    return parser.parse_args()


def _record(path: str, topics: List[str], publisher: List[str]) -> None:
    """Record everything that a program publishes."""
    recorder = OwnRecorder(path, topics)
    recorder.start()
    subprocess.run(publisher, check=True, stdout=subprocess.DEVNULL, stdin=subprocess.DEVNULL)
    recorder.stop()


def _compare(first: str, second: str, topics: List[str]) -> int:
    """Print the differences; return 1 if the messages are not the same."""
    different = 0
    print(f'{"topic":40} {"messages":>8} {"same":>5} {"more":>5}   spacing differs by [ms]: '
          'median, p99, most')
    with Recording([first]) as before, Recording([second]) as after:
        for topic in topics:
            counts, same, spacing_ms = _compare_topic(before, after, topic)
            different += not same
            median, p99, most = np.percentile(spacing_ms, [50, 99, 100])
            print(f'{topic:40} {counts[0]:>8} {"yes" if same else "NO":>5} '
                  f'{counts[1] - counts[0]:>5}   '
                  f'{median:.2f} {p99:.2f} {most:.2f}')
    return int(different > 0)


def _compare_topic(before: Recording, after: Recording,
                   topic: str) -> 'tuple[tuple[int, int], bool, np.ndarray]':
    positions = [it.index.positions_of(it.index.connections_of(topic)) for it in (before, after)]
    counts = (len(positions[0]), len(positions[1]))
    same = counts[0] <= counts[1] and all(
        before.message(one) == after.message(other)
        for one, other in zip(positions[0].tolist(), positions[1].tolist()))
    shorter = min(counts)
    spacing = [np.diff(it.index.time_ns[rows[:shorter]])
               for it, rows in zip((before, after), positions)]
    return counts, same, np.abs(spacing[1] - spacing[0]) / 1e6


if __name__ == '__main__':
    sys.exit(main())
