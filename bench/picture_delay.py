# SPDX-License-Identifier: BSD-3-Clause
"""Delay from a camera image to RViz's picture.

usage: bench/run picture_delay [--flips 200] [--rate-hz 30]

A camera above a table (this program) publishes registered images of 640x480 over sockets; a cell of
one depth sensor with a `<roi>` makes the cropped cloud of them, and RViz draws it, in software. The
color of the table changes every few images. The delay is from the moment before the images of the
new color are published until a pixel in the middle of the screen has it.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import threading
import time
from pathlib import Path
from typing import List, Optional, Tuple

import numpy as np
import rospy
from PyQt5.QtWidgets import QApplication
from sensor_msgs.msg import CameraInfo, Image

from process_visualizer.launching.run import LaunchRun
from process_visualizer.nodes.view_picture import wait_for_master

WIDTH, HEIGHT, FOCAL_PX, DISTANCE_MM = 640, 480, 525.0, 2000
COLORS = ((255, 40, 40), (40, 255, 40))
FRAME = 'eye'
LOOK_S, TIMEOUT_S = 0.001, 120.0
CONFIG = """<visualizer>
  <device type="depth_sensor" name="eye">
    <base frame="eye" xyz="0 0 2" ypr="0 0 3.14159265" />
    <topic ns="eye" name="depth" type="depth_image" />
    <topic ns="eye" name="color" type="color_image" />
    <topic ns="eye" name="camera_info" type="camera_info" />
    <roi size="1.2 1.2 0.1" />
  </device>
</visualizer>
"""


class Camera:
    """Publishes images in a thread; the color changes at random times."""

    def __init__(self, rate_hz: float) -> None:
        """Needs an initialized node."""
        self._publishers = [rospy.Publisher(f'/eye/{name}', kind, queue_size=1, tcp_nodelay=True)
                            for name, kind in (('depth', Image), ('color', Image),
                                               ('camera_info', CameraInfo))]
        depth = np.full((HEIGHT, WIDTH), DISTANCE_MM, np.uint16)
        self._depth = Image(height=HEIGHT, width=WIDTH, encoding='16UC1', step=2 * WIDTH,
                            data=depth.tobytes())
        self._colors = [Image(height=HEIGHT, width=WIDTH, encoding='rgb8', step=3 * WIDTH,
                              data=bytes(color) * (WIDTH * HEIGHT)) for color in COLORS]
        matrix = [FOCAL_PX, 0.0, 319.5, 0.0, FOCAL_PX, 239.5, 0.0, 0.0, 1.0]
        self._info = CameraInfo(height=HEIGHT, width=WIDTH, K=matrix, P=_projection(matrix))
        self._period_s = 1.0 / rate_hz
        self._wanted, self._shown = 0, 0
        self._flipped_s: Optional[float] = None
        self._changed = threading.Condition()
        threading.Thread(target=self._run, daemon=True).start()

    def flip(self) -> Tuple[int, float]:
        """Change the color with the next images; return it and their time of publication [s]."""
        with self._changed:
            self._wanted, self._flipped_s = 1 - self._wanted, None
            self._changed.wait_for(lambda: self._flipped_s is not None, TIMEOUT_S)
            assert self._flipped_s is not None
            return self._wanted, self._flipped_s

    def _run(self) -> None:
        rate = rospy.Rate(1.0 / self._period_s)
        while not rospy.is_shutdown():
            self._publish()
            rate.sleep()

    def _publish(self) -> None:
        with self._changed:
            if self._shown != self._wanted:
                self._shown, self._flipped_s = self._wanted, time.monotonic()
                self._changed.notify_all()
            color = self._colors[self._shown]
        stamp = rospy.Time.now()
        for publisher, message in zip(self._publishers, (self._depth, color, self._info)):
            message.header.stamp, message.header.frame_id = stamp, FRAME
            publisher.publish(message)


def _projection(matrix: List[float]) -> List[float]:
    return [*matrix[0:3], 0.0, *matrix[3:6], 0.0, *matrix[6:9], 0.0]


class Eye:
    """Reads the color in the middle of the screen."""

    def __init__(self) -> None:
        """Connect to the screen."""
        self._app = QApplication([])
        screen = self._app.primaryScreen()
        assert screen is not None
        self._screen, size = screen, screen.size()
        self._place = size.width() // 2, size.height() // 2

    def wait_for(self, number: int, timeout_s: float) -> float:
        """Wait until the middle has a color; return the time when it was first seen [s]."""
        end_s = time.monotonic() + timeout_s
        while self._color() != number:
            if time.monotonic() > end_s:
                raise TimeoutError(f'RViz does not show {COLORS[number]} in the middle')
            time.sleep(LOOK_S)
        return time.monotonic()

    def _color(self) -> Optional[int]:
        pixel = self._screen.grabWindow(0, *self._place, 1, 1).toImage().pixelColor(0, 0)
        red, green = pixel.red(), pixel.green()
        return None if abs(red - green) < 100 else int(green > red)


def generated(folder: Path) -> str:
    """Write a cell of one sensor; return the path of its launch file."""
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / 'eye.xml'
    config.write_text(CONFIG, encoding='utf-8')
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(config), '--output',
                    str(folder / 'eye')], check=True, stdout=subprocess.DEVNULL)
    return str(folder / 'eye' / 'cell.launch')


def measure(camera: Camera, eye: Eye, flips: int) -> List[float]:
    """Return the delay of each change [s]."""
    random = np.random.default_rng(1)
    eye.wait_for(0, TIMEOUT_S)
    taken = []
    for _ in range(flips):
        time.sleep(random.uniform(0.15, 0.35))
        number, begin_s = camera.flip()
        taken.append(eye.wait_for(number, 10.0) - begin_s)
    return taken


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--flips', type=int, default=200)
    parser.add_argument('--rate-hz', type=float, default=30.0)
    options = parser.parse_args()
    run = LaunchRun(generated(Path(os.environ['ROS_HOME'])), lambda report: None)
    try:
        wait_for_master(30)
        rospy.init_node('picture_delay', disable_signals=True)
        taken = 1000.0 * np.array(measure(Camera(options.rate_hz), Eye(), options.flips))
    finally:
        run.stop()
    median, p95, p99, most = np.quantile(taken, (0.5, 0.95, 0.99, 1.0))
    print(f'{len(taken)} changes: median {median:.0f}, p95 {p95:.0f}, p99 {p99:.0f}, '
          f'longest {most:.0f} ms')


if __name__ == '__main__':
    main()
