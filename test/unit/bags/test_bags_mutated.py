# SPDX-License-Identifier: BSD-3-Clause
"""Damaged bags of every kind: only the project's own errors, with bounded work and memory."""
from __future__ import annotations

import resource
from cProfile import Profile
from pathlib import Path
from typing import Callable, Dict

import pytest
from every_reader import read_all
from mutated_bags import damaged
from small_bags import devices, whole_bags

NUMBERS = range(200)
MAX_TIMES_THE_CALLS = 2
"""Relative to the undamaged bag that needs the most calls."""
MAX_MORE_BYTES = 300 << 20


@pytest.fixture(scope='module')
def bags(tmp_path_factory: pytest.TempPathFactory) -> Dict[str, bytes]:
    return whole_bags(tmp_path_factory.mktemp('bags'))


def test_whole_bags_are_read(tmp_path: Path, bags: Dict[str, bytes]) -> None:
    """Otherwise it would prove nothing that damaged ones are refused."""
    for name, data in bags.items():
        (tmp_path / 'a.bag').write_bytes(data)
        errors = read_all(tmp_path / 'a.bag', devices(tmp_path))
        assert all('has no index' in error for error in errors), name
        assert bool(errors) == ('without index' in name)


def test_damaged_bags_are_read_or_refused(tmp_path: Path, bags: Dict[str, bytes]) -> None:
    its_devices, path = devices(tmp_path), tmp_path / 'a.bag'
    of_whole_ones = []
    for data in bags.values():
        path.write_bytes(data)
        of_whole_ones.append(calls(lambda: read_all(path, its_devices)))
    before = peak_bytes()
    for number in NUMBERS:
        bag = damaged(bags, number)
        path.write_bytes(bag.data)
        try:
            count = calls(lambda: read_all(path, its_devices))
        except Exception as error:
            raise AssertionError(f'damaged bag {number}: {bag.story}') from error
        assert count < MAX_TIMES_THE_CALLS * max(of_whole_ones), (number, bag.story, count)
        assert peak_bytes() - before < MAX_MORE_BYTES, (number, bag.story)


def calls(work: Callable[[], object]) -> int:
    """Return the number of function calls, which does not depend on the load of the machine."""
    profile = Profile()
    profile.runcall(work)
    return sum(entry.callcount for entry in profile.getstats())


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
