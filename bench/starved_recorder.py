# SPDX-License-Identifier: BSD-3-Clause
"""Gaps of a recorder that gets little processor time, compared with rosbag.

usage: bench/run starved_recorder [SECONDS]

Two cameras (30 images of 0.9 MB a second each) and four robots (125 Hz) are recorded, first by
bag_recorder, then by rosbag record. For 20 s the recorder gets 4 % of a processor, as beside many
other programs; root is needed for that. All joint states arrive in the end; the result is the
longest time between two recorded messages of each topic, as live subscribers of the recorder wait
for this time.
"""
from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, List

import numpy as np
import rospy
from rosbags.rosbag1 import Reader
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray

from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions
from process_visualizer.launching.ros_master import RosMaster

STARVED_S, SHARE, PERIOD_US = 20.0, 0.04, 100_000
IMAGES, JOINTS = [f'/image{it}' for it in range(2)], [f'/joints{it}' for it in range(4)]
IMAGE_HZ, IMAGE_BYTES, JOINTS_HZ = 30.0, 640 * 480 * 3, 125.0
SETTLE_S = 4.0


def publish() -> None:
    """Publish until ROS shuts the node down."""
    rospy.init_node('drivers')
    image = Image(height=480, width=640, encoding='rgb8', step=1920, data=bytes(IMAGE_BYTES))
    joints = Float32MultiArray(data=6 * [0.0])

    def send(topic: str, message: rospy.AnyMsg, rate_hz: float) -> None:
        publisher = rospy.Publisher(topic, type(message), queue_size=50, tcp_nodelay=True)
        next_s = time.monotonic()
        while not rospy.is_shutdown():
            publisher.publish(message)
            next_s += 1.0 / rate_hz
            time.sleep(max(next_s - time.monotonic(), 0.0))

    for topics, message, rate_hz in ((IMAGES, image, IMAGE_HZ), (JOINTS, joints, JOINTS_HZ)):
        for topic in topics:
            threading.Thread(target=send, args=(topic, message, rate_hz), daemon=True).start()
    rospy.spin()


@contextmanager
def starved(process_id: int) -> Iterator[None]:
    """Let a process compute for 4 ms in 100 ms, by a control group of the kernel; needs root."""
    is_old = Path('/sys/fs/cgroup/cpu').is_dir()  # version 1 of control groups
    group = Path('/sys/fs/cgroup', *['cpu'] * is_old, f'starved_recorder_{os.getpid()}')
    group.mkdir()
    if is_old:
        (group / 'cpu.cfs_period_us').write_text(str(PERIOD_US))
    quota = group / ('cpu.cfs_quota_us' if is_old else 'cpu.max')
    members = 'tasks' if is_old else 'cgroup.procs'

    def move_to(folder: Path) -> None:
        for it in os.listdir(f'/proc/{process_id}/task') if is_old else [str(process_id)]:
            (folder / members).write_text(it)

    try:
        quota.write_text(f'{SHARE * PERIOD_US:.0f}' + f' {PERIOD_US}' * (not is_old))
        move_to(group)
        yield
    finally:
        move_to(group.parent)
        group.rmdir()


def record_ours(folder: str, seconds: float) -> str:
    """Record with bag_recorder; return the path of the bag."""
    process = subprocess.Popen(['rosrun', 'process_visualizer', 'bag_recorder',
                                f'_folder:={folder}'], stdout=subprocess.DEVNULL)
    client = BagRecorder()
    client.wait_until_ready(20.0)
    path = client.start(RecordingOptions(topics=(*IMAGES, *JOINTS), folder=folder, name='ours'))
    time.sleep(SETTLE_S)
    with starved(_node_process('bag_recorder')):
        time.sleep(seconds)
    time.sleep(SETTLE_S)
    client.stop()
    client.close()
    os.kill(_node_process('bag_recorder'), signal.SIGINT)
    process.wait()
    return path


def record_peer(folder: str, seconds: float) -> str:
    """Record with rosbag; return the path of the bag."""
    path = os.path.join(folder, 'peer.bag')
    process = subprocess.Popen(['rosrun', 'rosbag', 'record', '-O', path, '-b', '0',
                                *IMAGES, *JOINTS], stdout=subprocess.DEVNULL)
    time.sleep(2.0 * SETTLE_S)
    with starved(_node_process('rosbag/record')):
        time.sleep(seconds)
    time.sleep(SETTLE_S)
    os.kill(_node_process('rosbag/record'), signal.SIGINT)
    process.wait()
    return path


def _node_process(name: str) -> int:
    found = subprocess.run(['pgrep', '-f', f'/{name}( |$)'], capture_output=True, text=True,
                           check=True).stdout.split()
    return next(int(it) for it in found if 'rosrun' not in Path(f'/proc/{it}/cmdline').read_text())


def gaps_s(path: str, topics: List[str]) -> List[float]:
    """Return the longest time between two messages of each topic [s]."""
    times = {it: [] for it in topics}  # type: ignore[var-annotated]
    with Reader(path) as reader:
        for connection, time_ns, _ in reader.messages():
            if connection.topic in times:
                times[connection.topic].append(time_ns)
    return [float(np.diff(np.sort(it)).max()) / 1e9 for it in times.values()]


def main() -> None:
    """Record with both, and print the gaps."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else STARVED_S
    master = RosMaster()
    master.ensure()
    rospy.init_node('starved_recorder')
    drivers = subprocess.Popen([sys.executable, __file__, 'publish'])
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name, record in (('bag_recorder', record_ours), ('rosbag record', record_peer)):
                path = record(folder, seconds)
                print(f'{name}: longest gap of joints '
                      f'{" ".join(f"{it:.2f}" for it in gaps_s(path, JOINTS))} s, of images '
                      f'{" ".join(f"{it:.2f}" for it in gaps_s(path, IMAGES))} s')
    finally:
        drivers.terminate()
        drivers.wait()
        master.stop()


if __name__ == '__main__':
    publish() if sys.argv[1:] == ['publish'] else main()
