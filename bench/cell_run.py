# SPDX-License-Identifier: BSD-3-Clause
"""Measures a running cell: time to the first complete picture, and each node's share of the CPU.

usage: python3 bench/cell_run.py [CONFIG] [--seconds 30]    (in the environment of the workspace)

The cell runs on a virtual screen. "Drawn" is the moment when RViz reports every display as OK; the
shares are of one core, from the kernel's accounting of each process over the given time.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticArray

from process_visualizer.launching.part_report import NodeReport, NodeState
from process_visualizer.launching.run import LaunchRun
from process_visualizer.launching.run_record import processes_of_run
from process_visualizer.nodes.view_picture import ViewWatcher, wait_for_master

_TICKS_PER_S = os.sysconf('SC_CLK_TCK')


class Sample(NamedTuple):
    """CPU time [s] and resident memory [MB] of a process."""

    cpu_s: float
    memory_mb: float


def main() -> int:
    options = _options()
    begin = time.monotonic()
    folder = _generate(options.config)
    generated = time.monotonic()
    times: Dict[str, float] = {}

    def note(report: NodeReport) -> None:
        if report.state is NodeState.RUNNING:
            times[report.name] = time.monotonic() - begin

    run = LaunchRun(f'{folder}/cell.launch', note)
    try:
        wait_for_master(30)
        rospy.init_node('cell_run_benchmark', anonymous=True, disable_signals=True)
        watcher = ViewWatcher()
        if not watcher.wait_until_ok(90):
            print('\n'.join(watcher.problems()), file=sys.stderr)
            return 1
        drawn = time.monotonic() - begin
        rows = _measure(run.run_id, options.seconds)
        rate = _frame_rate()
    finally:
        run.stop()
    _print(generated - begin, max(times.values()), drawn, rate, rows)
    return 0


def _options() -> argparse.Namespace:
    default = Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml'
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('config', nargs='?', default=str(default))
    parser.add_argument('--seconds', type=float, default=30.0)
    return parser.parse_args()


def _generate(config: str) -> str:
    folder = os.path.join(os.environ['ROS_HOME'], 'cell_run')
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', config, '--output', folder],
                   check=True, stdout=subprocess.DEVNULL)
    return folder


def _measure(run_id: str, seconds: float) -> Dict[str, Sample]:
    """Return the CPU share [% of a core] and the memory of each process of the run by name."""
    before = {pid: process_sample(pid) for pid in processes_of_run(run_id)}
    time.sleep(seconds)
    rows: Dict[str, Sample] = {}
    for pid, first in before.items():
        last = process_sample(pid)
        if first is not None and last is not None:
            share = (last.cpu_s - first.cpu_s) / seconds * 100
            rows[_name(pid)] = Sample(share, last.memory_mb)
    return rows


def process_sample(pid: int) -> Optional[Sample]:
    try:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    except OSError:
        return None
    pages = int(fields[21])
    return Sample((int(fields[11]) + int(fields[12])) / _TICKS_PER_S,
                  pages * os.sysconf('SC_PAGE_SIZE') / 1e6)


def _name(pid: int) -> str:
    """Return the node's name from the arguments of the process, or its program."""
    words: List[str] = Path(f'/proc/{pid}/cmdline').read_text().split('\0')
    program = os.path.basename(words[1] if 'python' in words[0] and len(words) > 1 else words[0])
    names = [word[len('__name:='):] for word in words if word.startswith('__name:=')]
    folders = [word.split('/')[-1] for word in words if word.startswith('__log:=')]
    prefix = folders[0].rsplit('-', 1)[0] if folders else ''
    return prefix or (names[0] if names else program)


def _frame_rate() -> float:
    report = rospy.wait_for_message('/rviz/display_status', DiagnosticArray, 10)
    values = {item.key: item.value for item in report.status[0].values}
    return float(values['fps'])


def _print(generated: float, running: float, drawn: float, rate: float,
           rows: Dict[str, Sample]) -> None:
    print(f'| generated | {generated:.1f} s |\n| all nodes run | {running:.1f} s |\n'
          f'| everything drawn | {drawn:.1f} s |\n| RViz | {rate:.0f} frames/s |\n')
    print('| node | CPU, % of a core | memory, MB |\n|---|---|---|')
    for name, sample in sorted(rows.items(), key=lambda row: -row[1].cpu_s):
        print(f'| {name} | {sample.cpu_s:.1f} | {sample.memory_mb:.0f} |')
    print(f'| all | {sum(sample.cpu_s for sample in rows.values()):.0f} | '
          f'{sum(sample.memory_mb for sample in rows.values()):.0f} |')


if __name__ == '__main__':
    sys.exit(main())
