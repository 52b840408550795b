# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures: cells from text, launch files from cells, and a package with files."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Callable

import pytest
from launch_loading import load_text
from roslaunch.config import ROSLaunchConfig

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.launch_file import LaunchFileBuilder


@pytest.fixture
def parse(tmp_path: Path) -> Callable[[str], Cell]:
    """Parses the content of a <visualizer>."""
    def parse_text(text: str) -> Cell:
        path = tmp_path / 'cell.xml'
        path.write_text(f'<visualizer>{text}</visualizer>', encoding='utf-8')
        return XmlParser().parse(str(path))
    return parse_text


@pytest.fixture
def build(parse: Callable[[str], Cell], tmp_path: Path) -> Callable[..., ROSLaunchConfig]:
    """Builds the launch file of a configuration without models and loads it with roslaunch."""
    def build_text(text: str, mode: Mode = Mode.REALTIME, rviz: RvizStart = RvizStart.NONE,
                   bag: 'str | None' = None, further_bags: 'tuple[str, ...]' = (),
                   is_replay: bool = False, bag_folder: str = '') -> ROSLaunchConfig:
        cell = parse(text)
        builder = LaunchFileBuilder(
            Choice(cell, mode, cell.devices, rviz, bag, further_bags=further_bags,
                   is_replay=is_replay, bag_folder=bag_folder), {}, {})
        return load_text(builder.text(), tmp_path)
    return build_text


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package "my_cell", found next to all others."""
    folder = tmp_path / 'packages' / 'my_cell'
    for name in ('launch', 'urdf'):
        (folder / name).mkdir(parents=True)
    (folder / 'package.xml').write_text('<package><name>my_cell</name></package>')
    monkeypatch.setenv('ROS_PACKAGE_PATH', os.pathsep.join(
        [str(folder.parent), os.environ.get('ROS_PACKAGE_PATH', '')]))
    return folder
