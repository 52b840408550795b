"""Opens a bag with an hour of a robot cell: time and memory, and how they grow with the bag.

usage: python3 bench/open.py [--minutes 1,10,60] [--folder FOLDER]    (in the workspace)

The bags have 9 topics with 838 small messages a second (two robots at 125 Hz with tool frames and
forces, and sensors), in chunks of 768 KB as `rosbag record` writes them, and are kept in the folder
for the next run. Every figure is of a fresh process that has imported its reader: the time from
the path to the open bag (median of three, the file in the page cache) and the greatest memory of
the process. The last column is the time to the bytes of the first message at 90 %.
"""
from __future__ import annotations

import argparse
import heapq
import io
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import BinaryIO, Iterator, List, NamedTuple, Tuple

from process_visualizer.bags.bag_records import header_of, packed_record, packed_time
from process_visualizer.bags.bag_writer import BagWriter, ConnectionRecord, IndexEntry

_CHUNK_BYTES = 768 * 1024
_BEGIN_NS = 1_600_000_000_000_000_000

TOPICS = (('/ur_rt_upper/q_act', 125, 36), ('/ur_rt_upper/tcf', 125, 36),
          ('/ft_upper/ft', 94, 36), ('/ur_rt_lower/q_act', 125, 36), ('/ur_rt_lower/tcf', 125, 36),
          ('/ft_lower/ft', 94, 36), ('/edge_finder_upper', 50, 12), ('/edge_finder_lower', 50, 12),
          ('/feed_rate_est', 50, 12))

_READERS = {
    'process_visualizer': """
from process_visualizer.bags.recording import Recording
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
    """Time to open [s], greatest memory by then [MB], time to a message at 90 % [s]."""

    open_s: float
    memory_mb: float
    first_s: float


def main() -> None:
    options = _options()
    os.makedirs(options.folder, exist_ok=True)
    print(f'{"bag":>7} {"messages":>10} {"size MB":>8}  {"reader":<19}'
          f'{"open s":>8} {"memory MB":>10} {"first s":>8}')
    for minutes in options.minutes:
        path = Path(options.folder) / f'robots_{minutes:g}_min.bag'
        if not path.exists():
            _make(path, minutes)
        count = int(sum(rate for _, rate, _ in TOPICS) * minutes * 60)
        for reader in _READERS:
            figures = _measured(reader, path)
            print(f'{minutes:>3g} min {count:>10} {path.stat().st_size / 1e6:>8.1f}  {reader:<19}'
                  f'{figures.open_s:>8.3f} {figures.memory_mb:>10.0f} {figures.first_s:>8.3f}',
                  flush=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', default=[1.0, 10.0, 60.0],
                        type=lambda text: [float(part) for part in text.split(',')])
    parser.add_argument('--folder',
                        default=os.path.join(tempfile.gettempdir(), 'process_visualizer_bench'))
    return parser.parse_args()


def _measured(reader: str, path: Path) -> Figures:
    runs = []
    for _ in range(3):
        output = subprocess.run([sys.executable, '-c', _READERS[reader] + _MEASURE, str(path)],
                                check=True, stdout=subprocess.PIPE, text=True).stdout
        runs.append([float(part) for part in output.split()])
    return Figures(*(statistics.median(column) for column in zip(*runs)))


def _make(path: Path, minutes: float) -> None:
    """Write the bag under another name first, so that an interrupted run leaves none."""
    print(f'writing {path}', file=sys.stderr)
    unfinished = path.with_suffix('.unfinished')
    with open(unfinished, 'wb') as file:
        _write(file, int(minutes * 60e9))
    unfinished.rename(path)


def _write(file: BinaryIO, length_ns: int) -> None:
    writer = BagWriter(file)
    connections = [ConnectionRecord(number, name.encode(), _connection_header(name))
                   for number, (name, _, _) in enumerate(TOPICS)]
    chunk = io.BytesIO()
    entries: List[IndexEntry] = []
    for time_ns, number in heapq.merge(*(_times(number, length_ns)
                                         for number in range(len(TOPICS)))):
        entries.append(IndexEntry(number, time_ns, chunk.tell()))
        chunk.write(packed_record({b'op': b'\2', b'conn': number.to_bytes(4, 'little'),
                                   b'time': packed_time(time_ns)}, _message(TOPICS[number][2])))
        if chunk.tell() >= _CHUNK_BYTES:
            writer.write_chunk(chunk.getbuffer(), b'none', chunk.tell(), entries)
            chunk, entries = io.BytesIO(), []
    writer.write_chunk(chunk.getbuffer(), b'none', chunk.tell(), entries)
    writer.finish(connections)


def _times(number: int, length_ns: int) -> Iterator[Tuple[int, int]]:
    rate = TOPICS[number][1]
    return ((_BEGIN_NS + number * 100_000 + count * 1_000_000_000 // rate, number)
            for count in range(length_ns * rate // 1_000_000_000))


def _message(size: int) -> bytes:
    """A serialised std_msgs/String of so many bytes."""
    return (size - 4).to_bytes(4, 'little') + b'.' * (size - 4)


def _connection_header(topic: str) -> bytes:
    return header_of({b'topic': topic.encode(), b'type': b'std_msgs/String',
                      b'md5sum': b'992ce8a1687cec8c8bd883ec73ca41d1',
                      b'message_definition': b'string data\n', b'callerid': b'/driver'})


if __name__ == '__main__':
    main()
