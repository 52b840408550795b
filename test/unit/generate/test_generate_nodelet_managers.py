# SPDX-License-Identifier: BSD-3-Clause
"""The crop of a depth sensor runs in the sensor's nodelet manager, if that is known."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict

import pytest
from launch_loading import load_text

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.generator import generate
from process_visualizer.generate.plan import LAUNCH_FILE

Parse = Callable[[str], Cell]
Crop = Callable[..., str]

SENSOR = ('<device type="depth_sensor" name="kinect"><topic name="c" type="pointcloud"/>'
          '<roi size="1 1 1"/>{}</device>')
INCLUDE = '<launch pkg="my_cell" type="d.launch"/>'
MANAGER = '<node pkg="nodelet" type="nodelet" name="{}" args="manager"/>'
ALONE = 'standalone process_visualizer/RoiFilter'


@pytest.fixture
def crop(parse: Parse, package: Path, tmp_path: Path) -> Crop:
    """The arguments of the crop node, for elements of the sensor and of its launch file."""
    def arguments(elements: str, included: str = '', mode: Mode = Mode.REALTIME) -> str:
        (package / 'launch' / 'd.launch').write_text(f'<launch>{included}</launch>')
        cell = parse(SENSOR.format(elements))
        plan = generate(Choice(cell, mode, cell.devices, RvizStart.NONE))
        nodes = {node.namespace + node.name: node
                 for node in load_text(plan.files[LAUNCH_FILE], tmp_path).nodes}
        return str(nodes['/kinect/roi_filter'].args)
    return arguments


LOADED: Dict[str, 'tuple[str, str, str]'] = {
    'in a launch file': (INCLUDE, f'<group ns="camera">{MANAGER.format("m")}</group>', '/camera/m'),
    'beside other nodelets': (
        INCLUDE, MANAGER.format('m')
        + '<node pkg="nodelet" type="nodelet" name="n" args="load depth_image_proc/register m"/>',
        '/m'),
    'own node': (MANAGER.format('m'), '', '/kinect/m'),
}


@pytest.mark.parametrize('elements, included, manager', LOADED.values(), ids=LOADED)
def test_manager_that_is_known(elements: str, included: str, manager: str, crop: Crop) -> None:
    assert crop(elements, included) == (
        f'load process_visualizer/RoiFilter {manager} --no-bond')


UNKNOWN: Dict[str, 'tuple[str, str]'] = {
    'none': (INCLUDE, '<node pkg="rosout" type="rosout" name="n"/>'),
    'no launch file': ('', ''),
    'two': (INCLUDE, MANAGER.format('a') + MANAGER.format('b')),
    'one of each': (MANAGER.format('a') + INCLUDE, MANAGER.format('b')),
    'on another computer': (
        INCLUDE, '<machine name="far" address="far" env-loader="/e"/>'
        '<node pkg="nodelet" type="nodelet" name="m" args="manager" machine="far"/>'),
    'without a lasting name': (INCLUDE, MANAGER.format('$(anon m)')),
    'in the other mode': (
        '<launch ifstate="playback" pkg="my_cell" type="d.launch"/>', MANAGER.format('m')),
    'another program of that name': (
        INCLUDE, '<node pkg="rosout" type="rosout" name="m" args="manager"/>'),
}


@pytest.mark.parametrize('elements, included', UNKNOWN.values(), ids=UNKNOWN)
def test_manager_that_is_not_known(elements: str, included: str, crop: Crop) -> None:
    assert crop(elements, included) == ALONE


def test_the_manager_of_the_mode(crop: Crop) -> None:
    elements = '<launch ifstate="playback" pkg="my_cell" type="d.launch"/>'
    assert crop(elements, MANAGER.format('m'), mode=Mode.PLAYBACK).split()[2] == '/m'


LOAD = ('<node pkg="nodelet" type="nodelet" name="{}" '
        'args="load depth_image_proc/register {} --no-bond"/>')


def joined(parse: Parse, tmp_path: Path, first: str, second: str) -> 'Dict[str, str]':
    """The arguments of the nodelets of two sensors, and of the fusion of their clouds."""
    device = ('<device type="depth_sensor" name="{0}"><topic name="{0}_c" type="pointcloud"/>'
              '<roi size="1 1 1"/>{1}</device>')
    cell = parse(device.format('left', first) + device.format('right', second)
                 + '<device type="depth_sensor" name="both"><fusion sensors="left right"/>'
                 '</device>')
    plan = generate(Choice(cell, Mode.REALTIME, cell.devices, RvizStart.NONE))
    return {node.namespace + node.name: ' '.join([node.args, 'respawn'] if node.respawn
                                                 else [node.args])
            for node in load_text(plan.files[LAUNCH_FILE], tmp_path).nodes
            if node.package == 'nodelet'}


def test_fusion_in_the_manager_of_all_sensors(parse: Parse, tmp_path: Path) -> None:
    """Another device's manager may end without this device: bonds, and respawning."""
    found = joined(parse, tmp_path, MANAGER.format('m'), LOAD.format('n', '/left/m'))
    assert found['/left/roi_filter'] == 'load process_visualizer/RoiFilter /left/m --no-bond'
    assert found['/right/roi_filter'] == 'load process_visualizer/RoiFilter /left/m respawn'
    assert found['/both/fusion'] == 'load process_visualizer/CloudFusion /left/m respawn'


def test_fusion_of_managers_of_their_own(parse: Parse, tmp_path: Path) -> None:
    found = joined(parse, tmp_path, MANAGER.format('m'), MANAGER.format('m'))
    assert found['/right/roi_filter'] == 'load process_visualizer/RoiFilter /right/m --no-bond'
    assert found['/both/fusion'] == 'standalone process_visualizer/CloudFusion'


def test_manager_that_nobody_starts(parse: Parse, tmp_path: Path) -> None:
    found = joined(parse, tmp_path, LOAD.format('n', '/m'), LOAD.format('n', '/m'))
    assert found['/left/roi_filter'] == 'standalone process_visualizer/RoiFilter'
    assert found['/both/fusion'] == 'standalone process_visualizer/CloudFusion'
