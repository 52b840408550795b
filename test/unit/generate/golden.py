# SPDX-License-Identifier: BSD-3-Clause
"""The golden files: their list, how they are made, and which parts are compared."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple
from xml.etree import ElementTree

import rospkg
import yaml

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate
from process_visualizer.generate.plan import LAUNCH_FILE, RVIZ_FILE, Plan

REPOSITORY = Path(__file__).resolve().parents[3]
FOLDER = REPOSITORY / 'test' / 'data' / 'golden'
BAG = '/data/seam 1.bag'

CASES: Dict[str, Tuple[str, Mode]] = {
    'devices_realtime': ('devices.xml', Mode.REALTIME),
    'devices_playback': ('devices.xml', Mode.PLAYBACK),
    'simulated_realtime': ('sewing_cell/devices/simulated.xml', Mode.REALTIME),
}
"""Configuration and mode of each pair of golden files."""

Tree = Tuple[str, Dict[str, str], Any, List[Any]]


def make_plan(case: str, make: Callable[[Choice], Plan] = generate) -> Plan:
    """The plan for a case, as it is generated now."""
    file, mode = CASES[case]
    cell = XmlParser().parse(str(REPOSITORY / file))
    bag = BAG if mode is Mode.PLAYBACK else None
    return make(Choice(cell, mode, cell.devices, bag=bag))


def golden_texts(plan: Plan) -> Dict[str, str]:
    """The texts of launch file and RViz file by their endings, without paths of this machine."""
    return {'.launch': without_paths(plan.files[LAUNCH_FILE]),
            '.rviz': without_paths(plan.files[RVIZ_FILE])}


def without_paths(text: str) -> str:
    """The text with the name of the package in place of its folder."""
    packages = rospkg.RosPack()
    for package in ('sewing_cell', 'process_visualizer'):
        text = text.replace(packages.get_path(package), f'/{package}')
    return text.replace(str(REPOSITORY), '/process_visualizer')


def tree(text: str) -> Tree:
    """A launch file as nested data, without comments; the text of <rosparam> as YAML."""
    return _tree(ElementTree.fromstring(text))


def _tree(element: ElementTree.Element) -> Tree:
    content = element.text or ''
    value = yaml.safe_load(content) if element.tag == 'rosparam' else content.strip()
    return element.tag, dict(element.attrib), value, [_tree(child) for child in element]
