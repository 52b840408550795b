# SPDX-License-Identifier: BSD-3-Clause
"""Unmodeled objects in a recording of the simulated cell: after seeks, and backwards."""
from __future__ import annotations

from pathlib import Path
from typing import Dict

import pytest
from running import CELL, CellRun, run_command
from test_watched_cell import assert_lengths, observe

RECORDED_S = 14
HAND = (0.20, 0.10)
POSITIONS_S = (9.0, 3.0, 6.5, 3.0, 12.0, 9.0)
LINE_Y_M, LINE_X_M = 0.15, (-1.0, -0.78)
"""The line on which the hand moves in and out."""


@pytest.fixture(scope='module')
def recording(ros_environment: Dict[str, str], simulated_config: str,
              tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the cell with a hand in it."""
    run = CellRun(['run', simulated_config, '--no-rviz', 'objects:=true', 'image_rate:=10',
                   'intruder:=hand'], ros_environment)
    try:
        run.wait_for_line('/cell_frames: running')
        path = tmp_path_factory.mktemp('bags') / 'hand'
        made = run_command(ros_environment, CELL, 'record', simulated_config, '--duration',
                           f'{RECORDED_S}s', '--folder', str(path.parent), '-O', path.name,
                           '--lz4')
        assert made.returncode == 0, made.stdout
    finally:
        run.end()
    return path.with_suffix('.bag')


def test_a_recording_shows_the_same_hand_after_seeks_and_backwards(
        recording: Path, ros_environment: Dict[str, str], simulated_config: str) -> None:
    run = CellRun(['run', simulated_config, '--mode', 'playback', '--bag', str(recording),
                   '--no-rviz', 'objects:=true'],
                  ros_environment)
    try:
        run.wait_for_line('/cell_frames: running')
        found = observe(ros_environment, 'played', ','.join(map(str, POSITIONS_S)))
    finally:
        run.end()
    hands = dict(zip(POSITIONS_S, found['at']))
    for position_s, objects in zip(POSITIONS_S, found['at']):
        assert [it['number'] for it in objects] == [1], 'nothing is remembered from before'
        # the space below it is occluded: its height and its center's z are unknown
        assert objects[0]['place'][:2] == pytest.approx(hands[position_s][0]['place'][:2],
                                                        abs=0.005)
    seen = [it for objects in (*found['at'], *found['backwards']) for it in objects]
    for it in seen:
        assert_lengths(it['size'][:2], HAND)
        assert it['place'][1] == pytest.approx(LINE_Y_M, abs=0.02)
        assert LINE_X_M[0] - 0.02 < it['place'][0] < LINE_X_M[1] + 0.02
    assert len(found['backwards']) > 10
    assert [len(it) for it in found['backwards']].count(1) > 0.9 * len(found['backwards'])
    assert len({it['number'] for objects in found['backwards'] for it in objects}) == 1
