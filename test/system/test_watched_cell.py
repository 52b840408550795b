# SPDX-License-Identifier: BSD-3-Clause
"""The simulated cell while it sews, with real nodes: Fit of its Kinect, and unmodeled objects."""
from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Iterator, List

import pytest
from running import CellRun

OBSERVER = Path(__file__).with_name('cell_observer.py')
CYCLE_S = 20.0
"""By then, the robots have been everywhere."""
BOX = (0.30, 0.20, 0.15)
WITHIN_M = 0.02


def observe(environment: Dict[str, str], *arguments: str) -> Dict[str, Any]:
    """Run the observer; return its output."""
    run = subprocess.run([sys.executable, str(OBSERVER), *arguments], env=environment,
                         stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=600,
                         check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    answer: Dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
    return answer


@pytest.fixture(scope='module')
def cell(ros_environment: Dict[str, str], simulated_config: str) -> Iterator[None]:
    """The cell runs, without RViz, and has a box in it."""
    run = CellRun(['run', simulated_config, '--no-rviz', 'objects:=true', 'image_rate:=10',
                   'intruder:=box'], ros_environment)
    run.wait_for_line('/cell_frames: running')
    yield
    run.end()


def assert_lengths(lengths: List[float], expected: 'tuple[float, ...]') -> None:
    """Check the lengths of edges, in any order."""
    assert sorted(lengths) == pytest.approx(sorted(expected), abs=WITHIN_M)


def test_what_nobody_modeled_is_found_and_the_robots_are_not(
        cell: None, ros_environment: Dict[str, str]) -> None:
    seen = observe(ros_environment, 'objects', str(CYCLE_S))
    found = [it for several in seen['objects'].values() for it in several]
    assert len(found) > 0.5 * seen['clouds']
    assert {it['link'].split('/')[0] for it in found} <= {'ur_rt_upper', 'ur_rt_lower'}
    middle = sorted(found, key=lambda it: float(it['size'][2]))[len(found) // 2]
    assert len(seen['objects']) == 1, 'it keeps its number'
    assert_lengths(middle['size'], BOX)


def test_fit_finds_the_kinect(cell: None, ros_environment: Dict[str, str],
                              simulated_config: str) -> None:
    fit = observe(ros_environment, 'fit', simulated_config)
    assert fit['shift_m'] < 0.001, fit
    assert fit['turn_deg'] < 0.1, fit
