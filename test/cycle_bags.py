# SPDX-License-Identifier: BSD-3-Clause
"""Bags of a process that repeats itself, with the configuration in them."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Optional, Tuple

import rosbag
from genpy import Duration, Time
from std_msgs.msg import Float32, Float32MultiArray, String

from process_visualizer.bagio.recorder_topics import CONFIGURATION
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.cell.xml_parser import XmlParser

BEGIN_S, CYCLE_S, RATE_HZ = 1_600_000_000, 12.0, 50.0
CELL = '''<visualizer>
  <event name="starts" topic="feed" above="0.01" hysteresis="0.005"/>
  <event name="stops" topic="feed" below="0.005" hysteresis="0.005"/>
  {run}
  <device type="robot" name="{robot}">
    <base frame="base" xyz="1 0 0" rpy="1.5707963 0 0"/>
    <topic name="tcf" type="tool_center_frame"/><topic name="ft" type="force_sensor"/>
  </device>
  <device type="other" name="{machine}">
    <topic name="feed"/>
    <variable topic="feed" frame="world" unit="m/s" label="feed" tolerance="0.02"/>
  </device>
</visualizer>
'''
RUN = '<run begin="starts" end="stops" before="2" after="1"/>'


def write_bag(folder: Path, name: str = 'a.bag', cycles: int = 2, poor: Optional[int] = None,
              robot: str = 'arm', machine: str = 'machine', run: str = RUN,
              stored: bool = True, part_of_s: Tuple[float, float] = (0.0, math.inf)) -> str:
    """Write a bag of some cycles; in the poor one the force jumps 3 s after its beginning.

    The configuration is beside it, as cell.xml. ``part_of_s`` is the recorded part of the process.
    """
    config, path = folder / 'cell.xml', folder / name
    config.write_text(CELL.format(robot=robot, machine=machine, run=run), encoding='utf-8')
    with rosbag.Bag(str(path), 'w') as file:
        if stored:
            text = configuration_text(XmlParser().parse(str(config)))
            file.write(f'/{CONFIGURATION.strip("/")}', String(text),
                       Time(BEGIN_S) + Duration.from_sec(part_of_s[0]))
        for number in range(int(cycles * CYCLE_S * RATE_HZ)):
            if not part_of_s[0] <= number / RATE_HZ < part_of_s[1]:
                continue
            cycle, process_s = divmod(number / RATE_HZ, CYCLE_S)
            along = progress_m(process_s)
            force = 10.0 * along + (5.0 if cycle == poor and 3.0 < process_s < 9.0 else 0.0)
            stamp = Time(BEGIN_S, 0) + Duration.from_sec(number / RATE_HZ)
            file.write('/tcf', Float32MultiArray(data=[along, 0, 0, 0, 0, 0]), stamp)
            file.write('/ft', Float32MultiArray(data=[force, 0, 0, 0, 0, 0]), stamp)
            file.write('/feed', Float32(0.05 if 1.0 < process_s < 9.0 else 0.0), stamp)
    return str(path)


def progress_m(process_s: float) -> float:
    """Return the tool's position: it waits, moves there, waits, moves back, waits."""
    there, back = (min(max(it, 0.0), 1.0) for it in ((process_s - 1.0) / 4.0,
                                                     (process_s - 6.0) / 3.0))
    return 0.5 * (there * there * (3.0 - 2.0 * there) - back * back * (3.0 - 2.0 * back))
