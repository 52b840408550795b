# SPDX-License-Identifier: BSD-3-Clause
"""Several depth sensors in a configuration: the fusion of their clouds, and their own data."""
from __future__ import annotations

from typing import Callable

import pytest

from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Cell

Parse = Callable[..., Cell]

SENSOR = ('<device type="depth_sensor" name="{0}"><topic ns="{0}" name="c" type="pointcloud"/>{1}'
          '</device>')
BOTH = '<device type="depth_sensor" name="both"><fusion {}/></device>'


def cell_of(*devices: str) -> str:
    return f'<visualizer>{"".join(devices)}</visualizer>'


def test_defaults(parse: Parse) -> None:
    cell = parse(cell_of(SENSOR.format('a', ''), SENSOR.format('b', ''),
                         BOTH.format('sensors=" a  b "')))
    fusion = cell.devices[2].fusion
    assert fusion is not None
    assert (fusion.sensors, fusion.voxel_m, fusion.timeout_s) == (('a', 'b'), 0.005, 1.0)
    assert cell.devices[0].fusion is None


def test_where_clouds_come_from(parse: Parse) -> None:
    cell = parse(cell_of(SENSOR.format('a', ''), SENSOR.format('b', '<roi size="1 1 1"/>'),
                         BOTH.format('sensors="a b" voxel="0.01" timeout="3"'),
                         '<device type="depth_sensor" name="d"/>'))
    assert [device.cloud_topic for device in cell.devices] == [
        '/a/c', '/b/roi_points', '/both/fused_points', None]
    assert [device.has_cloud for device in cell.devices] == [True, True, True, False]


@pytest.mark.parametrize('sensors, expected', [
    ('a c', 'there is no depth sensor "c" with a cloud; expected one of: a, bee'),
    ('a bea', 'there is no depth sensor "bea" with a cloud; did you mean "bee"?'),
    ('both', 'there is no depth sensor "both" with a cloud'),
    ('arm', 'there is no depth sensor "arm" with a cloud')])
def test_only_clouds_are_joined(sensors: str, expected: str, parse: Parse) -> None:
    with pytest.raises(ConfigurationError) as error:
        parse(cell_of(SENSOR.format('a', ''), SENSOR.format('bee', ''),
                      '<device type="robot" name="arm"/>', BOTH.format(f'sensors="{sensors}"')))
    (problem,) = error.value.problems
    assert expected in str(problem)


def test_two_sensors_on_one_topic(parse: Parse) -> None:
    with pytest.raises(ConfigurationError) as error:
        parse(cell_of(SENSOR.format('a', ''),
                      SENSOR.format('b', '').replace('ns="b"', 'ns="a"')))
    (problem,) = error.value.problems
    assert '"/a/c" belongs to the depth sensor "a" already' in str(problem)
