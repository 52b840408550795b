# SPDX-License-Identifier: BSD-3-Clause
"""Compares published with recorded messages, for bag_recorder and for `rosbag record`.

usage: bench/run record_loss [--seconds 60] [--cameras 1 2 3] [--no-rviz]

The load is the simulated cell's: two robots and 46 MB/s of images for each camera, published by
record_load.cpp. CPU shares are of one core.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, NamedTuple, Type, Union

import rospy
from recorders import (
    Cost,
    OwnRecorder,
    RosbagRecord,
    cost,
    load_program,
    message_counts,
    topics_of_load,
)

Recorder = Union[Type[OwnRecorder], Type[RosbagRecord]]
_THESIS = """thesis, table 6.2, Kinect at 30 Hz: tool frame published 123.5 Hz, recorded 102.8 Hz
(16.8 % lost); force published 93.8 Hz, recorded 77.2 Hz (17.7 % lost)"""


class Result(NamedTuple):
    """One run: counts by topic, and the cost of the recorder."""

    published: Dict[str, int]
    recorded: Dict[str, int]
    cost: Cost

    @property
    def lost(self) -> int:
        """Return the number of messages that were published and not recorded."""
        return sum(count - self.recorded.get(topic, 0) for topic, count in self.published.items())


def main() -> int:
    options = _options()
    load_program()
    port = os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1]
    others = [subprocess.Popen(['roscore', '-p', str(port)], stdout=subprocess.DEVNULL)]
    try:
        rospy.init_node('record_loss', disable_signals=True)
        if not options.no_rviz:
            others.append(_rviz())
        return max([_compare(cameras, options.seconds) for cameras in options.cameras])
    finally:
        for process in reversed(others):
            process.terminate()
            process.wait()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=int, default=60)
    parser.add_argument('--cameras', type=int, nargs='+', default=[1, 2, 3])
    parser.add_argument('--no-rviz', action='store_true')
    return parser.parse_args()


def _rviz() -> 'subprocess.Popen[bytes]':
    """Run RViz with the displays of the simulated cell."""
    folder = os.path.join(os.environ['ROS_HOME'], 'record_loss')
    config = Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml'
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(config), '--output',
                    folder], check=True, stdout=subprocess.DEVNULL)
    return subprocess.Popen(['rosrun', 'process_visualizer', 'rviz', '-d', f'{folder}/cell.rviz'],
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _compare(cameras: int, seconds: int) -> int:
    """Run both recorders with the same load; return 1 if our own lost a message."""
    recorders: List[Recorder] = [OwnRecorder, RosbagRecord]
    results = [_run(recorder, cameras, seconds) for recorder in recorders]
    own, other = results
    print(f'\n{cameras} camera(s), {seconds} s')
    print(f'{"topic":40} {"published":>9} {"bag_recorder":>12} | '
          f'{"published":>9} {"rosbag record":>13}')
    for topic, count in own.published.items():
        print(f'{topic:40} {count:>9} {own.recorded.get(topic, 0):>12} | '
              f'{other.published[topic]:>9} {other.recorded.get(topic, 0):>13}')
    for recorder, result in zip(recorders, results):
        print(f'{recorder.name}: {result.lost} lost, CPU '
              f'{100 * result.cost.cpu_s / seconds:.0f} %, memory {result.cost.memory_mb:.0f} MB')
    print(_THESIS, flush=True)
    return int(own.lost > 0)


def _run(recorder_class: Recorder, cameras: int, seconds: int) -> Result:
    """Record in a new folder on the disk, not in memory."""
    with tempfile.TemporaryDirectory(dir=os.environ['ROS_HOME']) as folder:
        path = os.path.join(folder, 'load.bag')
        recorder = recorder_class(path, topics_of_load(cameras))
        load = subprocess.Popen([load_program(), str(seconds), str(cameras)],
                                stdout=subprocess.PIPE, text=True)
        recorder.start()
        text = load.communicate()[0]
        spent = cost(recorder.process)
        recorder.stop()
        rows = [line.split() for line in text.splitlines()]
        return Result({topic: int(count) for topic, count in rows}, message_counts(path), spent)


if __name__ == '__main__':
    os.makedirs(os.environ['ROS_HOME'], exist_ok=True)
    sys.exit(main())
