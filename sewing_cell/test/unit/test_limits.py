# SPDX-License-Identifier: BSD-3-Clause
"""The limits in the configurations: a good seam always stays within them, a poor one does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from process_visualizer.cell.model import WarningLimits
from process_visualizer.cell.xml_parser import XmlParser
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

DEVICES = Path(__file__).parents[2] / "devices"
PERIOD_S, CYCLES = 20.0, 8
TIMES_S = np.arange(0.0, CYCLES * PERIOD_S, 0.02)

configurations = pytest.mark.parametrize("name", ["simulated.xml", "variables.xml"])
seeds = pytest.mark.parametrize("seed", range(6))


def limits_of(name: str, arm: Arm) -> WarningLimits:
    topic = "/edge_finder_" + arm.name.rpartition("_")[2]
    device = XmlParser().parse(str(DEVICES / name)).device("sewing_machine")
    (variable,) = (it for it in device.variables if it.topic == topic)
    assert variable.limits is not None
    return variable.limits


def beyond(limits: WarningLimits, readings: np.ndarray) -> np.ndarray:
    return (readings < limits.low) | (readings > limits.high)


@configurations
@seeds
def test_a_good_seam_keeps_the_limits_in_all_phases(name: str, seed: int) -> None:
    cycle = SewingCycle("good", seed)
    for arm in ARMS:
        assert not beyond(limits_of(name, arm), cycle.edge(arm, TIMES_S)).any()


@configurations
@seeds
def test_a_poor_seam_is_beyond_them_for_a_second_in_each_cycle(name: str, seed: int) -> None:
    cycle = SewingCycle("poor", seed)
    is_beyond = np.array([beyond(limits_of(name, arm), cycle.edge(arm, TIMES_S)) for arm in ARMS])
    in_cycles = is_beyond.any(axis=0).reshape(CYCLES, -1).sum(axis=1) * 0.02
    assert in_cycles.min() > 1.0
