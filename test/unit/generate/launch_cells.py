# SPDX-License-Identifier: BSD-3-Clause
"""Small cells, and their launch files as roslaunch loads them."""
from __future__ import annotations

import tempfile
from pathlib import Path

from launch_loading import load_text, nodes
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Node as LaunchedNode

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.launch_file import LaunchFileBuilder

HERE = Location('cell.xml', 1)


def device(elements: str, kind: str = 'other') -> str:
    """Return the text of a device."""
    return f'<device type="{kind}" name="d">{elements}</device>'


def one_node(config: ROSLaunchConfig, name: str = '/d/n') -> LaunchedNode:
    """Return a node by its absolute name."""
    return nodes(config)[name]


def launch_text(cell: Cell, mode: Mode = Mode.REALTIME, **options: object) -> str:
    """Return the launch file of all devices; ``options`` are those of a Choice
    or included files."""
    included = options.pop('included', {})
    choice = Choice(cell, mode, cell.devices, RvizStart.NONE, **options)  # type: ignore[arg-type]
    return LaunchFileBuilder(choice, {}, included).text()  # type: ignore[arg-type]


def loaded(cell: Cell, mode: Mode = Mode.REALTIME, **options: object) -> ROSLaunchConfig:
    """Return the launch file as roslaunch loads it."""
    with tempfile.TemporaryDirectory() as folder:
        return load_text(launch_text(cell, mode, **options), Path(folder))


def cell_of(*devices: Device) -> Cell:
    """Return a cell of devices."""
    return Cell('/folder/cell.xml', 'world', devices)
