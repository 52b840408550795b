# SPDX-License-Identifier: BSD-3-Clause
"""Measures many robots: CPU per node, and delays from the driver to joint states, /tf and markers.

usage: bench/run robots [1 2 5 10 20] [--seconds 20]

Each robot has its joint and robot processors and its robot_state_publisher. Their drivers and the
stopwatch are one C++ program (bench/robots_driver.cpp), which has real-time priority if permitted,
as real drivers do not compete with the programs under test. Shares are of one core; the host's
share is of a virtual machine's time (see stolen_time.py).
"""
from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Any, Dict, List

from stolen_time import with_share_stolen

from process_visualizer.generate.processor_nodes import PUBLISH_FREQUENCY_HZ

_TICKS_PER_S = os.sysconf('SC_CLK_TCK')
_PREFIX = 'ur_rt_upper'
_WARM_UP_S = 5.0
_ROBOT = """  <group ns="{name}">
    <param name="robot_description" textfile="{urdf}" />
    <node pkg="robot_state_publisher" type="robot_state_publisher" name="robot_state_publisher">
      <param name="publish_frequency" value="{frequency}" />
    </node>
    <node pkg="process_visualizer" type="joint_proc" name="joint_proc">
      <param name="topic" value="q_act" />
    </node>
    <node pkg="process_visualizer" type="robot_proc" name="robot_proc">
      <rosparam>
        topics:
          joint_states: {{name: q_act}}
          tool_center_frame: {{name: tcf}}
          force_sensor: {{name: ft}}
        arrows:
          force: {{scale: 1.0, min: 0.001, max: 1.0e+6, threshold: 0.0}}
      </rosparam>
    </node>
  </group>
"""


def main() -> int:
    options = _options()
    folder = Path(os.environ['ROS_HOME'])
    model = _model()
    print('| robots | joint_proc, % each | robot_proc, % each | state publisher, % each '
          '| rosmaster, % | all, % '
          '| joint states p50 / p99, ms | /tf p50 / p99, ms | marker p50 / p99, ms | host, % |')
    print('|---|---|---|---|---|---|---|---|---|---|')
    for count in options.robots:
        result, stolen = with_share_stolen(partial(_run, count, options.seconds, model, folder))
        _print(count, result, stolen)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('robots', nargs='*', type=int, default=[1, 2, 5, 10, 20])
    parser.add_argument('--seconds', type=float, default=20.0)
    return parser.parse_args()


def _model() -> str:
    """Return the URDF of the sewing cell's upper robot."""
    package = subprocess.run(['rospack', 'find', 'sewing_cell'], stdout=subprocess.PIPE,
                             check=True, text=True).stdout.strip()
    return subprocess.run(['xacro', f'{package}/urdf/{_PREFIX}.urdf.xacro'],
                          stdout=subprocess.PIPE, check=True, text=True).stdout


def _launch_file(count: int, model: str, folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    robots = []
    for number in range(count):
        name = f'robot_{number}'
        urdf = folder / f'{name}.urdf'
        urdf.write_text(model.replace(_PREFIX, name))
        robots.append(_ROBOT.format(name=name, urdf=urdf, frequency=PUBLISH_FREQUENCY_HZ))
    path = folder / 'robots.launch'
    path.write_text(f'<launch>\n{"".join(robots)}</launch>\n')
    return path


def _run(count: int, seconds: float, model: str, folder: Path) -> Dict[str, Any]:
    """Run this many robots; return the driver's delays, and the processes' CPU shares by name."""
    launch = subprocess.Popen(['roslaunch', '--disable-title',
                               str(_launch_file(count, model, folder))],
                              stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        subprocess.run(['bash', '-c', 'until rosnode list >/dev/null 2>&1; do sleep 0.2; done'],
                       check=True, timeout=30)
        driver = subprocess.Popen(
            ['rosrun', 'process_visualizer', 'robots_driver', f'_robots:={count}',
             f'_seconds:={seconds}', f'_warm_up:={_WARM_UP_S}'],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert driver.stderr is not None
        while driver.stderr.readline().strip() not in ('measuring', ''):
            pass
        before = _cpu_times(launch.pid)
        begin_s = time.monotonic()
        output = driver.stdout.read() if driver.stdout else ''
        duration_s = time.monotonic() - begin_s
        shares = {pid: (name, (cpu_s - before[pid][1]) / duration_s * 100)
                  for pid, (name, cpu_s) in _cpu_times(launch.pid).items() if pid in before}
        driver.wait()
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(90)
    return {'cpu': _by_name(shares), **json.loads(output)}


def _cpu_times(launch_pid: int) -> Dict[int, Any]:
    """Return name and CPU time [s] of the children of roslaunch."""
    found = {}
    for path in Path('/proc').iterdir():
        if not path.name.isdigit():
            continue
        try:
            fields = (path / 'stat').read_text().rpartition(')')[2].split()
            words = (path / 'cmdline').read_text().split('\0')
        except OSError:
            continue
        if int(fields[1]) == launch_pid:
            program = words[1] if 'python' in words[0] else words[0]
            cpu_s = (int(fields[11]) + int(fields[12])) / _TICKS_PER_S
            found[int(path.name)] = (os.path.basename(program), cpu_s)
    return found


def _by_name(shares: Dict[int, Any]) -> Dict[str, List[float]]:
    rows: Dict[str, List[float]] = defaultdict(list)
    for name, share in shares.values():
        rows[name].append(share)
    return rows


def _print(count: int, result: Dict[str, Any], stolen: float) -> None:
    cpu = result['cpu']

    def mean(name: str) -> float:
        return sum(cpu[name]) / max(len(cpu[name]), 1)

    delays = ' | '.join(f'{result[kind]["median_ms"]:.2f} / {result[kind]["p99_ms"]:.2f}'
                        for kind in ('joint_states', 'transforms', 'markers'))
    print(f'| {count} | {mean("joint_proc"):.1f} | {mean("robot_proc"):.1f} | '
          f'{mean("robot_state_publisher"):.1f} | '
          f'{mean("rosmaster"):.0f} | {sum(map(sum, cpu.values())):.0f} | {delays} | '
          f'{stolen * 100:.2f} |', flush=True)


if __name__ == '__main__':
    sys.exit(main())
