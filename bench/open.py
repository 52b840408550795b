# SPDX-License-Identifier: BSD-3-Clause
"""Opens a bag with an hour of a robot cell: time and memory, and how they grow with the bag.

usage: python3 bench/open.py [--minutes 1,10,60] [--readers rosbags,…] [--runs 3] [--folder FOLDER]
(in the workspace)

The bags have 9 topics with 838 small messages a second (two robots at 125 Hz with tool frames and
forces, and sensors), in chunks of 768 KB as `rosbag record` writes them, and are kept in the folder
for the next run. Each figure is from a fresh process that has imported its reader: the time from
the path to the open bag (median of the runs, the file in the page cache) and the greatest memory of
the process. The last column is the time to the bytes of the first message at 90 %.
"""
from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from bag_maker import DEFAULT_FOLDER, message_count
from robots_bag import robots_bag

_READERS = {
    'process_visualizer': """
from process_visualizer.bagio.recording import Recording
def open_bag(path): return Recording([path])
def first_at(bag, part):
    index = bag.index
    time_ns = int(index.begin_ns + part * (index.end_ns - index.begin_ns))
    return bag.message(index.count_before(time_ns))
""",
    'rosbags': """
from pathlib import Path
from rosbags.rosbag1 import Reader
def open_bag(path):
    bag = Reader(Path(path))
    bag.open()
    return bag
def first_at(bag, part):
    return next(bag.messages(start=int(bag.start_time + part * (bag.end_time - bag.start_time))))
""",
    'rosbag.Bag': """
import rosbag, genpy
def open_bag(path): return rosbag.Bag(path)
def first_at(bag, part):
    begin, end = bag.get_start_time(), bag.get_end_time()
    start = genpy.Time.from_sec(begin + part * (end - begin))
    return next(bag.read_messages(raw=True, start_time=start))
"""}

_MEASURE = """
import resource, sys, time
begin = time.perf_counter()
bag = open_bag(sys.argv[1])
opened = time.perf_counter()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
first_at(bag, 0.9)
print(opened - begin, memory / 1024, time.perf_counter() - opened)
"""


class Figures(NamedTuple):
    """Return time to open [s], greatest memory by then [MB], time to a message at 90 % [s]."""

    open_s: float
    memory_mb: float
    first_s: float


def main() -> None:
    options = _options()
    print(f'{"bag":>7} {"messages":>10} {"size MB":>8}  {"reader":<19}'
          f'{"open s":>8} {"memory MB":>10} {"first s":>8}')
    for minutes in options.minutes:
        bag = robots_bag(options.folder, minutes)
        path = bag.path
        count = sum(message_count(topic, bag.length_s) for topic in bag.topics)
        for reader in options.readers:
            figures = _measured(reader, path, options.runs)
            print(f'{minutes:>3g} min {count:>10} {path.stat().st_size / 1e6:>8.1f}  {reader:<19}'
                  f'{figures.open_s:>8.3f} {figures.memory_mb:>10.0f} {figures.first_s:>8.3f}',
                  flush=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', default=[1.0, 10.0, 60.0],
                        type=lambda text: [float(part) for part in text.split(',')])
    parser.add_argument('--readers', default=list(_READERS), type=lambda text: text.split(','))
    parser.add_argument('--runs', default=3, type=int)
    parser.add_argument('--folder', default=DEFAULT_FOLDER)
    return parser.parse_args()


def _measured(reader: str, path: Path, count: int) -> Figures:
    runs = []
    for _ in range(count):
        output = subprocess.run([sys.executable, '-c', _READERS[reader] + _MEASURE, str(path)],
                                check=True, stdout=subprocess.PIPE, text=True).stdout
        runs.append([float(part) for part in output.split()])
    return Figures(*(statistics.median(column) for column in zip(*runs)))


if __name__ == '__main__':
    main()
