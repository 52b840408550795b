# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of the simulated sewing cell with their configuration: some good ones, a poor one."""
from __future__ import annotations

import sys
from pathlib import Path

import rosbag
from genpy import Time
from std_msgs.msg import String

from process_visualizer.bagio.recorder_topics import CONFIGURATION
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.cell.xml_parser import XmlParser
from sewing_cell.cycle import SewingCycle
from sewing_cell.faults import Fault, FaultyCycle

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY / 'bench'))

from sewing_bag import BEGIN_S, write_sewing_bag  # noqa: E402

CELL = REPOSITORY / 'sewing_cell/devices/simulated.xml'
FAULT = Fault('friction', 7.0, 12.0, 'upper')
SECONDS = 19.5


def write_sewing_run(folder: Path, name: str, seed: int = 1, is_poor: bool = False) -> str:
    """Write a bag of one seam; return its path."""
    cycle = FaultyCycle(FAULT, 'good', seed) if is_poor else SewingCycle('good', seed)
    path = str(folder / name)
    write_sewing_bag(path, cycle, SECONDS)
    text = configuration_text(XmlParser().parse(str(CELL)))
    with rosbag.Bag(path, 'a') as bag:
        bag.write(f'/{CONFIGURATION.strip("/")}', String(text), Time.from_sec(BEGIN_S))
    return path
