"""The RViz file: its default part, the groups of the devices, and the camera."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import BaseFrame, Cell, Device, DeviceType, Pose
from process_visualizer.generate.camera import camera_pose
from process_visualizer.generate.rviz_config import RVizConfig

DEFAULT = Path(__file__).resolve().parents[3] / 'rviz_config' / 'default.rviz'
HERE = Location('cell.xml', 1)
Parse = Callable[[str], Cell]


def content(config: RVizConfig) -> Dict[str, Any]:
    loaded = yaml.safe_load(config.text())
    assert isinstance(loaded, dict)
    return loaded


def manager(cell: Cell) -> Dict[str, Any]:
    config = RVizConfig(str(DEFAULT), cell.frame)
    config.add_devices(cell.devices)
    result = content(config)['Visualization Manager']
    assert isinstance(result, dict)
    return result


def device(name: str, x: float, kind: DeviceType = DeviceType.ROBOT) -> Device:
    return Device(kind, name, HERE, base=BaseFrame(name, Pose((x, 0.0, 0.0)), HERE))


def test_default_part_is_kept() -> None:
    result = content(RVizConfig(str(DEFAULT), 'map'))
    default = yaml.safe_load(DEFAULT.read_text(encoding='utf-8'))
    assert result['Visualization Manager']['Global Options'].pop('Fixed Frame') == 'map'
    for shown in (result, default):
        shown['Visualization Manager'].pop('Displays')
    default['Visualization Manager']['Global Options'].pop('Fixed Frame')
    assert result == default


def test_no_dialog_on_exit() -> None:
    assert content(RVizConfig(str(DEFAULT), 'map'))['Preferences'] == {'PromptSaveOnExit': False}


def test_groups_of_devices(parse: Parse) -> None:
    cell = parse('<device type="robot" name="r"/><device type="other" name="empty"/>'
                 '<device type="other" name="o"><rviz type="TF"/></device>')
    displays = manager(cell)['Displays']
    assert [(display['Class'], display['Name']) for display in displays] == [
        ('rviz/Grid', 'Grid'), ('rviz/Group', 'r (robot)'), ('rviz/Group', 'o (other)'),
        ('rviz/MarkerArray', 'What is not live'), ('rviz/InteractiveMarkers', 'Calibration'),
        ('process_visualizer/DisplayStatus', 'Status report')]
    assert all(display['Enabled'] is True for display in displays)
    assert [display['Class'] for display in displays[2]['Displays']] == ['rviz/TF']


def test_own_grid_replaces_the_default_one(parse: Parse) -> None:
    displays = manager(parse('<device type="other" name="o"><rviz type="Grid" name="Floor"/>'
                             '</device>'))['Displays']
    assert [display['Class'] for display in displays] == [
        'rviz/Group', 'rviz/MarkerArray', 'rviz/InteractiveMarkers',
        'process_visualizer/DisplayStatus']
    assert displays[0]['Displays'][0]['Name'] == 'Floor'


def test_text_can_be_asked_for_twice() -> None:
    config = RVizConfig(str(DEFAULT), 'map')
    assert config.text() == config.text()


def test_file_has_no_aliases(parse: Parse) -> None:
    config = RVizConfig(str(DEFAULT), 'world')
    config.add_devices(parse('<device type="robot" name="a"/><device type="robot" name="b"/>')
                       .devices)
    assert '&id' not in config.text()


def test_camera_changes_only_what_is_said() -> None:
    config = RVizConfig(str(DEFAULT), 'map')
    before = content(config)['Visualization Manager']['Views']['Current']
    config.look_from({'Distance': 9})
    assert content(config)['Visualization Manager']['Views']['Current'] == {**before, 'Distance': 9}


@pytest.mark.parametrize('text', [
    '', 'just text', '[1, 2]', 'Panels: []', 'Visualization Manager:', 'a: [', 'a: b: c'])
def test_unusable_default_part(text: str, tmp_path: Path) -> None:
    path = tmp_path / 'broken.rviz'
    path.write_text(text)
    with pytest.raises(ValueError, match='broken.rviz: not '):
        RVizConfig(str(path), 'map')


def test_default_part_of_bytes(tmp_path: Path) -> None:
    path = tmp_path / 'broken.rviz'
    path.write_bytes(b'\xff\xfe')
    with pytest.raises(ValueError, match='broken.rviz: not YAML'):
        RVizConfig(str(path), 'map')


def test_missing_default_part(tmp_path: Path) -> None:
    with pytest.raises(OSError, match='none.rviz'):
        RVizConfig(str(tmp_path / 'none.rviz'), 'map')


def test_camera_without_frames_stays() -> None:
    assert camera_pose([]) == {}
    assert camera_pose([Device(DeviceType.ROBOT, 'r', HERE)]) == {}
    assert camera_pose([device('kinect', 1.0, DeviceType.DEPTH_SENSOR)]) == {}


def test_camera_looks_at_the_middle() -> None:
    pose = camera_pose([device('a', 1.0), device('b', 3.0),
                        device('kinect', 50.0, DeviceType.DEPTH_SENSOR)])
    assert pose['Focal Point'] == {'X': 2.0, 'Y': 0.0, 'Z': 0.0}


@given(st.lists(st.floats(-100, 100), min_size=1, max_size=5))
def test_camera_stands_outside_of_the_cell(positions: 'list[float]') -> None:
    pose = camera_pose([device('d', x) for x in positions])
    farthest = max(abs(x - pose['Focal Point']['X']) for x in positions)
    assert pose['Distance'] > 2 * farthest + 1
