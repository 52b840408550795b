# SPDX-License-Identifier: BSD-3-Clause
"""Two Kinects from the sewing cell's launch files: their own names, and the shared parts."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict

import pytest
from launch_loading import load_text, nodes, parameters
from roslaunch.config import ROSLaunchConfig

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.generator import generate
from process_visualizer.generate.plan import LAUNCH_FILE

Parse = Callable[[str], Cell]

FIRST = ('<device type="depth_sensor" name="kinect">'
         '<launch pkg="sewing_cell" type="openni_live.launch" /></device>')
SECOND = ('<device type="depth_sensor" name="other">'
          '<launch pkg="sewing_cell" type="openni_live.launch">'
          '<arg name="camera" value="camera_2" /><arg name="device" value="other" />'
          '<arg name="device_id" value="#2" />'
          '<arg name="data_skip" value="2" /><arg name="depth_registration" value="false" />{}'
          '</launch></device>')
SHARED = '<arg name="manager" value="/camera/camera_nodelet_manager" />'


def launched(parse: Parse, folder: Path, text: str) -> ROSLaunchConfig:
    """The cell's launch file as roslaunch loads it."""
    cell = parse(text)
    plan = generate(Choice(cell, Mode.REALTIME, cell.devices, RvizStart.NONE))
    left_out = [str(it) for it in plan.warnings if 'left out' in str(it)]
    assert left_out == []
    return load_text(plan.files[LAUNCH_FILE], folder)


def test_two_kinects_have_names_of_their_own(parse: Parse, tmp_path: Path) -> None:
    found = launched(parse, tmp_path, FIRST + SECOND.format(''))
    for camera in ('camera', 'camera_2'):
        names = {f'/{camera}/{name}' for name in (
            'driver', 'debayer', f'{camera}_nodelet_manager', 'points_xyzrgb_hw_registered')}
        assert names <= set(nodes(found))
        assert parameters(found, f'/{camera}/driver')['rgb_frame_id'] == \
            f'{camera}_rgb_optical_frame'
        frames = nodes(found)[f'/{camera}_rgb_frame']
        assert frames.args.endswith(f'{camera}_link {camera}_rgb_frame')
    assert parameters(found, '/kinect/kinect_roi')['manager'] == '/camera/camera_nodelet_manager'
    assert parameters(found, '/other/kinect_roi')['manager'] == '/camera_2/camera_2_nodelet_manager'


@pytest.mark.parametrize('camera, expected', [
    ('camera', {'device_id': '#1', 'data_skip': 0, 'depth_registration': True}),
    ('camera_2', {'device_id': '#2', 'data_skip': 2, 'depth_registration': False})])
def test_the_drivers_arguments(camera: str, expected: Dict[str, object], parse: Parse,
                               tmp_path: Path) -> None:
    found = launched(parse, tmp_path, FIRST + SECOND.format(''))
    assert expected.items() <= parameters(found, f'/{camera}/driver').items()


def test_two_kinects_in_one_manager(parse: Parse, tmp_path: Path) -> None:
    found = nodes(launched(parse, tmp_path, FIRST + SECOND.format(SHARED)))
    assert '/camera_2/camera_2_nodelet_manager' not in found
    for name in ('debayer', 'points_xyzrgb_hw_registered'):
        first, second = found[f'/camera/{name}'], found[f'/camera_2/{name}']
        assert first.args.split()[2:] == ['/camera/camera_nodelet_manager', '--no-bond']
        assert second.args.split()[2:] == ['/camera/camera_nodelet_manager']
        assert (first.respawn, second.respawn) == (False, True)


def test_the_same_kinect_twice_is_told(parse: Parse) -> None:
    cell = parse(FIRST + FIRST.replace('"kinect"', '"twin"'))
    plan = generate(Choice(cell, Mode.REALTIME, cell.devices, RvizStart.NONE))
    assert any('is already started by openni_live.launch of "kinect"' in str(it)
               for it in plan.warnings)
