# SPDX-License-Identifier: BSD-3-Clause
"""A recording of one second, and the real player, which plays it on a simulated clock."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator, List

import pytest
from recorded_rows import cell_rows, write_bag
from simulated_node import SimulatedNode
from simulated_player import SimulatedPlayer


@pytest.fixture(scope='session')
def cell_bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A bag of one second; each number is its time."""
    return write_bag(tmp_path_factory.mktemp('bags') / 'cell.bag', cell_rows())


@pytest.fixture
def bag_of(tmp_path: Path) -> Callable[..., str]:
    """Write messages into a bag; return its path."""
    def write(rows: Any, name: str = 'a.bag', **options: Any) -> str:
        return write_bag(tmp_path / name, rows, **options)
    return write


@pytest.fixture
def play() -> Iterator[Callable[..., SimulatedPlayer]]:
    """Start a player in a time of its own, some days after 1970; see SimulatedPlayer."""
    players: List[SimulatedPlayer] = []

    def start(*bags: str, **options: Any) -> SimulatedPlayer:
        viewer = SimulatedNode('/viewer')
        viewer.ros_offset_s = viewer.wall_offset_s = 500_000.0
        players.append(SimulatedPlayer(viewer, *bags, **options))
        return players[-1]

    yield start
    for player in players:
        player.close()
