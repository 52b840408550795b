# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, colors and scales of a page with little or no data."""
from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.page.lanes import lane_scale
from process_visualizer.page.numbers import color_of
from process_visualizer.robot.recorded_velocity import velocity_rows

CELL = '''<visualizer>
  <device type="other" name="machine">
    <base frame="machine/base"/>
    <variable topic="feed" frame="needle" axis="0 0 1" unit="m/s" label="feed" color="1 0 0"/>
  </device>
</visualizer>'''


@pytest.fixture
def machine(tmp_path: Path) -> Device:
    path = tmp_path / 'cell.xml'
    path.write_text(CELL, encoding='utf-8')
    return XmlParser().parse(str(path)).device('machine')


@pytest.mark.parametrize('count', [0, 1])
def test_without_two_positions_there_is_no_velocity(count: int) -> None:
    times_s, velocities = velocity_rows(np.arange(count, dtype=float), np.zeros((count, 3)))
    assert not len(times_s) and velocities.shape == (0, 3)


def test_between_two_stretches_there_is_no_velocity() -> None:
    times_s = np.concatenate((np.arange(0.0, 2.0, 0.01), np.arange(10.0, 12.0, 0.01)))
    found_s, velocities = velocity_rows(times_s, np.outer(times_s, [0.1, 0.0, 0.0]))
    assert (np.diff(found_s) >= 0.0).all()
    for moment_s, speed in ((1.0, 0.1), (6.0, math.nan), (11.0, 0.1)):
        assert np.interp(moment_s, found_s, velocities[:, 0]) == pytest.approx(speed, nan_ok=True)


def test_an_arrow_has_the_color_of_its_source(machine: Device) -> None:
    sources = curve_sources([machine])
    assert color_of(machine, 'feed', sources) == (1.0, 0.0, 0.0)
    assert color_of(machine, 'of another run', sources) == (0.5, 0.5, 0.5)


def test_a_lane_without_any_number_has_a_scale() -> None:
    assert lane_scale([np.full(3, math.nan)], []) == {'scale': [0.0, 1.0], 'ticks': []}
    found = lane_scale([np.array([0.0, math.nan, 4.0])], [])
    assert found['scale'][0] <= 0.0 and found['scale'][1] >= 4.0 and found['ticks'][0]
