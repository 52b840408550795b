# SPDX-License-Identifier: BSD-3-Clause
"""The RViz file: its default part, the groups of the devices, and the camera."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict

import numpy as np
import pytest
import yaml

from process_visualizer.cell.model import Cell
from process_visualizer.generate.rviz_config import RVizConfig
from process_visualizer.rviz.window_geometry import Rectangle

DEFAULT = Path(__file__).resolve().parents[3] / 'rviz_config' / 'default.rviz'
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
        ('process_visualizer/MarkerArray', 'Stale data'),
        ('rviz/InteractiveMarkers', 'Calibration'),
        ('process_visualizer/DisplayStatus', 'Status report')]
    assert all(display['Enabled'] is True for display in displays)
    assert [display['Class'] for display in displays[2]['Displays']] == ['rviz/TF']


def test_own_grid_replaces_the_default_one(parse: Parse) -> None:
    displays = manager(parse('<device type="other" name="o"><rviz type="Grid" name="Floor"/>'
                             '</device>'))['Displays']
    assert [display['Class'] for display in displays] == [
        'rviz/Group', 'process_visualizer/MarkerArray', 'rviz/InteractiveMarkers',
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


def test_camera_keeps_its_angles_and_looks_at_the_points() -> None:
    config = RVizConfig(str(DEFAULT), 'map')
    before = content(config)['Visualization Manager']['Views']['Current']
    config.look_at(np.array([(4.0, 0.0, 0.0), (6.0, 0.0, 0.0)]))
    after = content(config)['Visualization Manager']['Views']['Current']
    changed = {key for key in after if after[key] != before[key]}
    assert changed == {'Distance', 'Focal Point'}
    assert after['Focal Point']['X'] == pytest.approx(5.0, abs=0.5)


def test_camera_stands_further_away_from_a_narrow_window() -> None:
    points = np.array([(x, y, 0.0) for x in (-3.0, 3.0) for y in (-3.0, 3.0)])
    distances = []
    for width in (600, 1280):
        config = RVizConfig(str(DEFAULT), 'map')
        config.place(Rectangle(0, 0, width, 800))
        config.look_at(points)
        distances.append(config.current_view['Distance'])
    assert distances[0] > distances[1]


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


def test_a_replay_says_so() -> None:
    config = RVizConfig(str(DEFAULT), 'map')
    config.add_replay_band()
    [band] = [it for it in content(config)['Visualization Manager']['Displays']
              if it['Class'] == 'process_visualizer/ReplayBand']
    assert band['State Topic'] == '/bag_player/state' and not band['Shown At Start']
