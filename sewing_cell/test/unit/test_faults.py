# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from sewing_cell.cycle import SewingCycle
from sewing_cell.faults import KINDS, SIZES, Fault, FaultyCycle, drawn_fault
from sewing_cell.layout import ARMS, LOWER, UPPER

TIMES = np.arange(0.0, 60.0, 0.02)
GOOD = SewingCycle(seed=1)


def values(cycle: SewingCycle, name: str) -> np.ndarray:
    """Return a quantity of the cell: of both arms, or of the machine."""
    if name == "feed":
        return cycle.feed_rate(TIMES)
    columns = {"tool": cycle.tool_frame, "force": cycle.wrench, "edge": cycle.edge}
    return np.hstack([np.reshape(columns[name](arm, TIMES), (len(TIMES), -1)) for arm in ARMS])


def changed(fault: Fault, name: str) -> np.ndarray:
    """Return whether a quantity differs from its value without the fault, at each time."""
    faulty = FaultyCycle(fault, seed=1)
    difference = np.abs(values(faulty, name) - values(GOOD, name))
    return difference.reshape(len(TIMES), -1).max(axis=1) > 1e-9


CONCERNS = {
    "edge_drift": {"edge"},
    "friction": {"force"},
    "slip": {"edge", "force"},
    "sensor_offset": {"edge"},
    "late_feed": {"feed"},
    "dwell": {"edge", "force", "feed", "tool"},
    "feed_wobble": {"feed"},
    "calibration": {"tool"},
    "force_noise": {"force"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_concerns_its_own_quantities_only(kind: str) -> None:
    fault = drawn_fault(kind, GOOD, 5)
    found = {name for name in ("tool", "force", "edge", "feed") if changed(fault, name).any()}
    assert found == CONCERNS[kind]


@pytest.mark.parametrize("kind", KINDS)
def test_before_its_moment_and_in_other_cycles_nothing_is_changed(kind: str) -> None:
    fault = drawn_fault(kind, GOOD, 5).changed(cycle=1)
    for name in CONCERNS[kind]:
        begin, end = TIMES[changed(fault, name)][[0, -1]]
        assert 20.0 + fault.start_s - 0.021 <= begin
        assert end < 40.0


def test_of_one_arm_only() -> None:
    fault = drawn_fault("friction", GOOD, 5).changed(arm="lower")
    faulty = FaultyCycle(fault, seed=1)
    assert np.array_equal(faulty.wrench(UPPER, TIMES), GOOD.wrench(UPPER, TIMES))
    assert not np.array_equal(faulty.wrench(LOWER, TIMES), GOOD.wrench(LOWER, TIMES))


def test_a_dwell_holds_up_everything_by_its_size() -> None:
    fault = Fault("dwell", 8.0, 0.2, "upper")
    faulty = FaultyCycle(fault, seed=1)
    later = faulty.truth(UPPER, np.array([10.2])).position
    np.testing.assert_allclose(later, GOOD.truth(UPPER, np.array([10.0])).position, atol=1e-12)


def test_calibration_is_a_distance() -> None:
    faulty = FaultyCycle(Fault("calibration", 0.0, 0.003, "upper"), seed=1)
    off = faulty.truth(UPPER, TIMES).position - GOOD.truth(UPPER, TIMES).position
    np.testing.assert_allclose(off, np.tile((0.003, 0.0, 0.0), (len(TIMES), 1)), atol=1e-12)


def test_the_seed_decides() -> None:
    for kind in KINDS:
        first, second = (drawn_fault(kind, GOOD, seed) for seed in (5, 5))
        assert first == second
        assert first.size >= SIZES[kind]
        assert 0.0 <= first.start_s < GOOD.schedule.sew.end


def test_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="fault is 'rust'; give one of edge_drift, "):
        drawn_fault("rust", GOOD, 1)
