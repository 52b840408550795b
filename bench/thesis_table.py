# SPDX-License-Identifier: BSD-3-Clause
"""Table 6.2 of the thesis and its figures 6.14, 6.16 and 6.17, measured with this system.

usage: bench/run thesis_table [--seconds 30] [--rates 30 10 0] [--plots FOLDER] [--rviz]

For each number of images a second the simulated cell runs as `cell run` starts it, with all devices
(at 0 without the Kinect), and is recorded for the given time by its own recorder. Then the cell
runs in playback mode with the same devices, and its player plays the recording once. A subscriber
in C++ with all recorded topics records the arrival of each message, live and played. A rate is the
number of messages minus one, divided by the time from the first to the last. The share of time
taken by a virtual machine's host is printed for each run.

The plots are thesis_6_14.png, thesis_6_16.png and thesis_6_17.png. Without --rviz the cell has no
RViz, whose software renderer would take the processors from the simulator.
"""
from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from typing import Dict, List, Optional

import rospy
from arrival_recorder import build_recorder
from players import ros_master
from stolen_time import with_share_stolen
from thesis_plots import write_plots
from thesis_run import ThesisRun, rate_hz, thesis_run
from thesis_values import FORCE, TABLE_6_2, TOOL_FRAME, Rates

_QUANTITIES = {'tcf': TOOL_FRAME, 'ft': FORCE}


def main() -> int:
    options = _options()
    build_recorder()
    folder = Path(os.environ['ROS_HOME'])
    folder.mkdir(parents=True, exist_ok=True)
    runs: Dict[int, ThesisRun] = {}
    with ros_master():
        rospy.init_node('thesis_table', disable_signals=True)
        for image_hz in options.rates:
            measure = partial(thesis_run, image_hz, options.seconds, options.rviz, folder)
            runs[image_hz], stolen = with_share_stolen(measure)
            _print_run(runs[image_hz], stolen)
    if options.plots:
        write_plots(options.plots, runs)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, default=30.0, help='of each recording')
    parser.add_argument('--rates', nargs='+', type=int, default=[30, 10, 0], choices=[30, 10, 0],
                        help='images a second')
    parser.add_argument('--plots', help='a folder for the plots, which need all three rates')
    parser.add_argument('--rviz', action='store_true', help='the cell with RViz')
    options = parser.parse_args()
    if options.plots and set(options.rates) != {30, 10, 0}:
        parser.error('the plots need the rates 30, 10 and 0')
    return options


def _print_run(run: ThesisRun, stolen: float) -> None:
    print(f'\n{run.image_hz} images a second; the host took {stolen:.2%} of the time; '
          f'the player dropped {run.dropped} messages for slow subscribers\n\n'
          '| topic | published, Hz | recorded, Hz | played, Hz | messages: published, recorded, '
          'played | thesis: published, recorded, played, Hz |\n' + '|---' * 6 + '|')
    for topic, recorded in run.recorded.items():
        published, played = run.published[topic], run.played[topic]
        rates = Rates(published.rate_hz, rate_hz(recorded), played.rate_hz)
        counts = [len(published.time_s), len(recorded), len(played.time_s)]
        print(f'| {topic} | {_text(rates)} | {", ".join(map(str, counts))} | '
              f'{_thesis_text(run.image_hz, topic)} |', flush=True)


def _text(rates: Rates) -> str:
    return ' | '.join(f'{rate:.1f}' for rate in rates)


def _thesis_text(image_hz: int, topic: str) -> str:
    quantity: Optional[str] = _QUANTITIES.get(topic.rsplit('/', 1)[-1])
    values: List[str] = [] if quantity is None else [
        f'{rate:g}' for rate in TABLE_6_2[image_hz][quantity]]
    return ', '.join(values)


if __name__ == '__main__':
    sys.exit(main())
