# SPDX-License-Identifier: BSD-3-Clause
"""Reads the curves of the timeline: duration, and how long it keeps other threads waiting.

usage: python3 bench/curves.py [--folder FOLDER]    (in the workspace)

The bags are 20 s of the whole cell with its Kinect (46 MB/s) and an hour of its robots and sensors
(838 messages a second); they are kept in the folder for the next run. Each is read in a thread,
as the launcher does it, while the main thread wakes up every millisecond: its delay is the time
for which a window would have been blocked. The file is in the page cache.
"""
from __future__ import annotations

import argparse
import resource
import sys
import threading
import time
from pathlib import Path
from typing import Callable, List, Tuple

import numpy as np
from bag_maker import DEFAULT_FOLDER, BagTopic, MadeBag, made_bag
from cell_bag import cell_bag
from message_index import array_message, edge_message, feed_rate_message
from std_msgs.msg import Float32, Float32MultiArray, UInt16

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

_CONFIGURATION = Path(__file__).resolve().parents[1] / 'devices.xml'
_TICK_S = 0.001
_RUNS = 3


def robots_bag(folder: str, minutes: float) -> MadeBag:
    """The cell without its Kinect; all minutes are the same except for the indices."""
    cycle = SewingCycle()
    topics: List[BagTopic] = []
    for arm in ARMS:
        topics += [_array_topic(f'/ur_rt_{arm.name}/q_act', 125, cycle.joints, arm),
                   _array_topic(f'/ur_rt_{arm.name}/tcf', 125, cycle.tool_frame, arm),
                   _array_topic(f'/ft_{arm.name}/ft', 94, cycle.wrench, arm)]
    topics += [BagTopic(f'/edge_finder_{arm.name}', 50, UInt16,
                        lambda index, _time_ns: edge_message(index % 65536)) for arm in ARMS]
    topics.append(BagTopic('/feed_rate_est', 50, Float32,
                           lambda index, _time_ns: feed_rate_message(index % 1000)))
    return made_bag(Path(folder) / f'robots_{minutes:g}_min_moving.bag', topics, minutes * 60)


def _array_topic(name: str, rate_hz: int,
                 rows_at: Callable[[Arm, np.ndarray], np.ndarray], arm: Arm) -> BagTopic:
    rows: List[List[float]] = []

    def content(index: int, _time_ns: int) -> bytes:
        if not rows:  # only if the bag is written
            rows.extend(rows_at(arm, np.arange(60.0 * rate_hz) / rate_hz).tolist())
        return array_message(index, rows[index % len(rows)])

    return BagTopic(name, rate_hz, Float32MultiArray, content)


def measured(path: str) -> Tuple[float, float, int]:
    """Return time [s] to read the curves, the main thread's longest delay [s], and their number."""
    devices = XmlParser().parse(str(_CONFIGURATION)).devices
    found: List[int] = []
    thread = threading.Thread(target=lambda: found.append(len(read_curves([path], devices))))
    begin_s = time.perf_counter()
    thread.start()
    latest_s = 0.0
    while thread.is_alive():
        due_s = time.perf_counter() + _TICK_S
        time.sleep(_TICK_S)
        latest_s = max(latest_s, time.perf_counter() - due_s)
    return time.perf_counter() - begin_s, latest_s, found[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--folder', default=DEFAULT_FOLDER)
    options = parser.parse_args()
    print(f'{"bag":<32}{"size MB":>9}{"curves":>8}{"s":>8}{"longest wait ms":>17}')
    for bag in (cell_bag(options.folder, 20.0), robots_bag(options.folder, 60.0)):
        for _ in range(_RUNS):
            read_s, late_s, count = measured(str(bag.path))
            print(f'{bag.path.name:<32}{bag.path.stat().st_size / 1e6:>9.0f}{count:>8}'
                  f'{read_s:>8.2f}{late_s * 1e3:>17.1f}', flush=True)
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f'greatest memory {memory_mb:.0f} MB', file=sys.stderr)


if __name__ == '__main__':
    main()
