# SPDX-License-Identifier: BSD-3-Clause
"""Damaged bags of every kind: nothing but the project's own errors, in bounded time and memory."""
from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Dict

import pytest
from every_reader import read_all
from mutated_bags import damaged
from small_bags import devices, whole_bags

NUMBERS = range(200)
LONGEST_S = 10.0
MOST_MORE_BYTES = 300 << 20


@pytest.fixture(scope='module')
def bags(tmp_path_factory: pytest.TempPathFactory) -> Dict[str, bytes]:
    return whole_bags(tmp_path_factory.mktemp('bags'))


def test_whole_bags_are_read(tmp_path: Path, bags: Dict[str, bytes]) -> None:
    """Else it would prove nothing that damaged ones are refused."""
    for name, data in bags.items():
        (tmp_path / 'a.bag').write_bytes(data)
        errors = read_all(tmp_path / 'a.bag', devices(tmp_path))
        assert all('has no index' in error for error in errors), name
        assert bool(errors) == ('without index' in name)


def test_damaged_bags_are_read_or_refused(tmp_path: Path, bags: Dict[str, bytes]) -> None:
    its_devices, before = devices(tmp_path), peak_bytes()
    for number in NUMBERS:
        bag = damaged(bags, number)
        (tmp_path / 'a.bag').write_bytes(bag.data)
        begin_s = time.process_time()
        try:
            read_all(tmp_path / 'a.bag', its_devices)
        except Exception as error:
            raise AssertionError(f'damaged bag {number}: {bag.story}') from error
        assert time.process_time() - begin_s < LONGEST_S, (number, bag.story)
        assert peak_bytes() - before < MOST_MORE_BYTES, (number, bag.story)


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
