# SPDX-License-Identifier: BSD-3-Clause
"""Measures growth of memory, threads and open files of every process while a cell runs.

usage: bench/run soak [--minutes 120]

Half of the time a robot with its simulated driver runs, with RViz, and its recorder records (one
bag after the other, with marks); the other half the first of these bags is played with random
commands. Every process of the cell is sampled once a second: the median of the last quarter is
compared with that of the second one (the first is the start). It ends with 1 if a process has more
than 8 MB, 2 threads or 5 files more, or if one has ended.
"""
from __future__ import annotations

import argparse
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Sequence

import rospy
from cell_run import process_sample
from faults import CONFIG, process_of

from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions
from process_visualizer.clients.player_client import PlayerClient, PlayerError
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.launching.run import LaunchRun
from process_visualizer.launching.run_record import names_of, processes_of_run

PERIOD_S, BAG_S, START_S = 1.0, 60.0, 120.0
SETTLE_S = 20.0
"""Time for RViz to create its scene, and for rospy to start its threads."""
MAX_MORE = {'MB': 8.0, 'threads': 2.0, 'files': 5.0}


class Sample(NamedTuple):
    """Resources of a process at a moment."""

    MB: float
    threads: float
    files: float


def sample(pid: int) -> Sample:
    """Sample a process; raise OSError if it has ended."""
    found = process_sample(pid)
    if found is None:
        raise ProcessLookupError(pid)
    return Sample(found.memory_mb, len(list(Path(f'/proc/{pid}/task').iterdir())),
                  len(list(Path(f'/proc/{pid}/fd').iterdir())))


class Watch:
    """The processes of a run, and this one, over time."""

    def __init__(self, run_id: str) -> None:
        self._names = {pid: f'{names_of([pid])[0]} {pid}' for pid in processes_of_run(run_id)}
        self.samples: Dict[str, List[Sample]] = defaultdict(list)
        self.ended: List[str] = []

    def look(self) -> None:
        """Take a sample of each process."""
        for pid, name in tuple(self._names.items()):
            try:
                self.samples[name].append(sample(pid))
            except OSError:
                self.ended.append(f'{name} has ended')
                del self._names[pid]

    def finds(self) -> List[str]:
        """Print the resources of each process, and return those that have grown."""
        found = list(self.ended)
        print('| process | MB | threads | files |\n|---|---|---|---|')
        for name, samples in sorted(self.samples.items()):
            quarter = max(len(samples) // 4, 1)
            cells = []
            for what in Sample._fields:
                early, late = (statistics.median(getattr(it, what) for it in part) for part in (
                    samples[quarter:2 * quarter] or samples, samples[-quarter:]))
                cells.append(f'{early:.1f} -> {late:.1f}')
                if late - early > MAX_MORE[what]:
                    found.append(f'{name}: {what} {early:.1f} -> {late:.1f}')
            print(f'| {name} | {" | ".join(cells)} |')
        return found


def watched(launch_file: str, nodes: Sequence[str], seconds: float,
            begin: Callable[[], Callable[[float], None]]) -> List[str]:
    """Run a cell and sample it; ``begin`` returns a function to be called each second."""
    run = LaunchRun(launch_file, lambda report: None)
    try:
        end_s = time.monotonic() + START_S
        while any(process_of(node) is None for node in nodes):
            if time.monotonic() > end_s:
                raise TimeoutError(f'{nodes} are not up')
            time.sleep(0.5)
        act = begin()
        time.sleep(SETTLE_S)
        watch, begin_s = Watch(run.run_id), time.monotonic()
        while time.monotonic() - begin_s < seconds:
            act(time.monotonic() - begin_s)
            watch.look()
            time.sleep(PERIOD_S)
        return watch.finds()
    finally:
        run.stop()


def recording(folder: str) -> Callable[[float], None]:
    """Return a function that records one bag after the other, and marks moments."""
    recorder = BagRecorder()
    recorder.wait_until_ready(START_S)
    recorder.start(RecordingOptions(folder=folder, name='bag0'))
    count = [0]

    def act(now_s: float) -> None:
        recorder.mark(f'at {now_s:.0f}')
        if now_s > BAG_S * (count[0] + 1):
            recorder.stop()
            count[0] += 1
            recorder.start(RecordingOptions(folder=folder, name=f'bag{count[0]}'))

    return act


def playing() -> Callable[[float], None]:
    """Return a function that gives the player random commands."""
    player, chance = PlayerClient(), random.Random(1)
    player.wait_until_ready(START_S)

    def act(_now_s: float) -> None:
        acts: List[Callable[[], object]] = [
            player.play, player.pause, player.toggle_paused,
            lambda: player.seek(chance.uniform(0.0, 15.0)),
            lambda: player.set_rate(chance.choice((-2.0, -1.0, 0.1, 1.0, 4.0))),
            lambda: player.step(chance.choice((-5, -1, 1, 20))),
            lambda: player.set_loop(chance.random() < 0.5, 1.0, 4.0)]
        for _ in range(5):
            with suppress(PlayerError):  # refused: a step while it plays
                chance.choice(acts)()

    return act


def main() -> int:
    """Run both halves; return 1 if something grew."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=float, default=120.0)
    seconds = 30.0 * parser.parse_args().minutes
    os.makedirs(os.environ['ROS_HOME'], exist_ok=True)
    folder = tempfile.mkdtemp(dir=os.environ['ROS_HOME'])
    config = Path(folder, 'cell.xml')
    config.write_text(CONFIG)
    master = RosMaster()
    master.ensure()
    finds: List[str] = []
    try:
        rospy.init_node('soak', disable_signals=True)
        for name, options, nodes, begin in (
                ('recording', [], ('/bag_recorder', '/rviz'), lambda: recording(folder)),
                ('playback', ['--mode', 'playback', '--bag', f'{folder}/bag0.bag'],
                 ('/bag_player', '/rviz'), playing)):
            subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(config),
                            *options, '--output', f'{folder}/{name}'], check=True,
                           stdout=subprocess.DEVNULL)
            print(f'\n{name}, {seconds / 60.0:.1f} min\n')
            finds += watched(f'{folder}/{name}/cell.launch', nodes, seconds, begin)
    finally:
        master.stop()
    print('\n'.join(['', *finds]) if finds else '\nnothing grew')
    return 1 if finds else 0


if __name__ == '__main__':
    sys.exit(main())
