# SPDX-License-Identifier: BSD-3-Clause
"""Delay of the view on another computer, on links of several kinds, and after a cut.

The simulated cell and ``cell view --no-rviz`` run in two network namespaces (needs root).

    scripts/build python3 bench/remote_view.py
"""
from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY / 'test'))

from two_networks import CELL, TwoNetworks, problem  # noqa: E402

LINKS = (('1 Gbit/s', 125e6, 0.0002), ('10 Mbit/s, 50 ms', 1.25e6, 0.025),
         ('4 Mbit/s, 100 ms', 0.5e6, 0.05))
START_S, MEASURED_S, SETTLING_S, CUTS_S = 40.0, 20.0, 8.0, (10.0, 30.0)
TOPICS = {'joints': '/ur_rt_upper/joint_states', 'tf': '/tf', 'cloud': '/kinect/points'}


def main() -> int:
    """Print the figures."""
    if sys.argv[1:2] == ['subscribe']:
        subscribe()
        return 0
    reason = problem()
    if reason:
        print(f'not measured: {reason}')
        return 0
    networks = TwoNetworks()
    folder = tempfile.mkdtemp()
    environment = {**os.environ, 'ROS_HOME': folder, 'ROS_MASTER_URI': 'http://localhost:11311'}
    cell = subprocess.Popen(networks.command(
        networks.cell, 'rosrun', 'process_visualizer', 'cell', 'run', '--no-rviz', '--remote',
        str(REPOSITORY / 'sewing_cell/devices/simulated.xml')), env=environment,
        stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT)
    viewer = None
    try:
        time.sleep(START_S)
        viewer = subprocess.Popen(networks.command(
            networks.viewer, 'rosrun', 'process_visualizer', 'cell', 'view', '--no-rviz',
            '--master', CELL), env=environment, stdout=subprocess.PIPE, text=True)
        assert viewer.stdout is not None
        uri = next(filter(None, (re.search(r'http://\S+', it) for it in viewer.stdout)), None)
        assert uri is not None, 'the viewer does not say its master'
        said = threading.Thread(target=lambda: [print('  viewer:', it.strip(), flush=True)
                                                for it in viewer.stdout], daemon=True)
        said.start()
        measure(networks, {**environment, 'ROS_MASTER_URI': uri[0], 'ROS_HOSTNAME': 'localhost'})
    finally:
        for process in (viewer, cell):
            if process is not None:
                process.terminate()
                process.wait()
        networks.close()
    return 0


def measure(networks: TwoNetworks, environment: Dict[str, str]) -> None:
    """Let a node at the viewer listen while the link changes."""
    listener = subprocess.Popen(
        networks.command(networks.viewer, sys.executable, __file__, 'subscribe'),
        env=environment, stdin=subprocess.PIPE, text=True)
    assert listener.stdin is not None

    def tell(text: str) -> None:
        assert listener.stdin is not None
        listener.stdin.write(f'{text}\n')
        listener.stdin.flush()

    for name, bytes_s, delay_s in LINKS:
        networks.bytes_s, networks.delay_s = bytes_s, delay_s
        time.sleep(SETTLING_S)
        tell('begin')
        time.sleep(MEASURED_S)
        tell(f'ages {name}')
    networks.bytes_s, networks.delay_s = LINKS[1][1:]
    for cut_s in CUTS_S:
        time.sleep(3.0)
        networks.is_cut = True
        time.sleep(cut_s)
        tell('begin')
        networks.is_cut = False
        time.sleep(6.0)
        tell(f'first after a cut of {cut_s:g} s')
    listener.stdin.close()
    listener.wait()


def subscribe() -> None:
    """Run the node that listens; its input says when to begin, and when to print."""
    import rospy
    from sensor_msgs.msg import JointState, PointCloud2
    from tf2_msgs.msg import TFMessage
    kinds = {'joints': JointState, 'tf': TFMessage, 'cloud': PointCloud2}
    ages: Dict[str, List[Tuple[float, float]]] = defaultdict(list)
    rospy.init_node('listener', anonymous=True, disable_signals=True)

    def take(message: Any, name: str) -> None:
        now_s = time.time()
        first = message.transforms[0] if name == 'tf' else message
        ages[name].append((time.monotonic(), now_s - first.header.stamp.to_sec()))

    for name, topic in TOPICS.items():
        rospy.Subscriber(topic, kinds[name], take, name, buff_size=1 << 24)
    begin_s = 0.0
    for line in sys.stdin:
        if line.startswith('begin'):
            begin_s = time.monotonic()
            continue
        print(line.strip(), flush=True)
        for name in TOPICS:
            present = [(when, age) for when, age in list(ages[name]) if when >= begin_s]
            if not present:
                print(f'  {name}: nothing', flush=True)
            elif line.startswith('first'):
                fresh = [when for when, age in present if age < 2.0]
                print(f'  {name}: {min(fresh) - begin_s:.2f} s' if fresh else
                      f'  {name}: only old ones', flush=True)
            else:
                values = [age for _, age in present]
                print(f'  {name}: {len(values) / MEASURED_S:.1f} Hz, age p50 '
                      f'{np.percentile(values, 50):.3f} s, p95 {np.percentile(values, 95):.3f} s',
                      flush=True)


if __name__ == '__main__':
    sys.exit(main())
