# SPDX-License-Identifier: BSD-3-Clause
"""Topics of a recording that the operator deselects are not played."""
from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Callable, List, Tuple

import pytest
from launch_loading import load_text, nodes

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.launch_file import LaunchFileBuilder, recorded_topics
from process_visualizer.generate.plan import BAG_PART

OVEN = ('<device type="other" name="oven"><topic ns="oven" name="q"/><topic name="p"/>'
        '<topic name="secret" record="False"/></device>')


@pytest.fixture
def everything(parse: Callable[[str], Cell]) -> Choice:
    cell = parse(OVEN)
    return Choice(cell, Mode.PLAYBACK, cell.devices, RvizStart.NONE, '/a.bag')


def played(choice: Choice, folder: Path) -> List[str]:
    """The topic arguments of the player; empty without a player."""
    launched = nodes(load_text(LaunchFileBuilder(choice, {}, {}).text(), folder))
    player = launched.get('/bag_player')
    words = [] if player is None else shlex.split(player.args)
    return words[words.index('--topics') + 1:] if words else []


@pytest.mark.parametrize('left_out, expected', [
    ((), ['/oven/q', '/p']), (('/p', '/unknown'), ['/oven/q']), (('/p', '/oven/q'), [])])
def test_the_player_is_told_the_others(everything: Choice, tmp_path: Path,
                                       left_out: Tuple[str, ...], expected: List[str]) -> None:
    assert played(replace(everything, left_out=left_out), tmp_path) == expected


SENSOR = ('<device type="depth_sensor" name="eye"><topic name="cloud" type="pointcloud" '
          'msg="sensor_msgs/PointCloud2"/><objects/></device>')


def test_objects_are_recorded_but_found_again_when_played(parse: Callable[[str], Cell],
                                                          tmp_path: Path) -> None:
    cell = parse(SENSOR)
    assert recorded_topics(cell.devices) == ['/cloud', '/eye/objects']
    choice = Choice(cell, Mode.PLAYBACK, cell.devices, RvizStart.NONE, '/a.bag')
    assert played(choice, tmp_path) == ['/cloud']


def test_only_the_player_is_started_again(everything: Choice) -> None:
    before = generate_parts(everything).parts
    after = generate_parts(replace(everything, left_out=('/p',))).parts
    assert set(before) == set(after)
    assert [name for name in before if before[name] != after[name]] == [BAG_PART]
