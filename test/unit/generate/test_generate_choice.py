# SPDX-License-Identifier: BSD-3-Clause
"""The choices of the operator."""
from __future__ import annotations

from typing import Callable, List, Optional

import pytest

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice, RvizStart, choose_devices

Parse = Callable[[str], Cell]


@pytest.fixture
def cell(parse: Parse) -> Cell:
    """Three devices; the first has nodes and launch files for both modes."""
    modes = ('', 'ifstate="realtime"', 'ifstate="playback"')
    nodes = ''.join(f'<node pkg="p" type="t" name="n{i}" {mode}/>'
                    f'<launch pkg="p" type="l{i}.launch" {mode}/>' for i, mode in enumerate(modes))
    return parse(f'<device type="robot" name="arm">{nodes}</device>'
                 '<device type="other" name="table"/><device type="depth_sensor" name="camera"/>')


@pytest.mark.parametrize('names, expected', [
    (None, ['arm', 'table', 'camera']), (['camera', 'arm'], ['arm', 'camera']),
    (['table', 'table'], ['table'])])
def test_chosen_devices(names: Optional[List[str]], expected: List[str], cell: Cell) -> None:
    assert [device.name for device in choose_devices(cell, names)] == expected


@pytest.mark.parametrize('names, message', [
    (['arm', 'camra'], 'there is no device "camra"; did you mean "camera"?'),
    (['xyz'], 'there is no device "xyz"; expected one of: arm, camera, table'),
    ([''], 'there is no device ""; expected one of: arm, camera, table'),
    ([], 'no device is chosen; expected one of: arm, table, camera')])
def test_wrong_names(names: List[str], message: str, cell: Cell) -> None:
    with pytest.raises(ValueError) as caught:
        choose_devices(cell, names)
    assert str(caught.value) == message


@pytest.mark.parametrize('mode, numbers', [(Mode.REALTIME, '01'), (Mode.PLAYBACK, '02')])
def test_what_runs_in_a_mode(mode: Mode, numbers: str, cell: Cell) -> None:
    choice = Choice(cell, mode, cell.devices)
    assert [node.name for node in choice.nodes(cell.devices[0])] == [f'n{i}' for i in numbers]
    assert [file.type for file in choice.launch_files(cell.devices[0])] == [
        f'l{i}.launch' for i in numbers]


def test_defaults(cell: Cell) -> None:
    choice = Choice(cell, Mode.REALTIME, cell.devices)
    assert (choice.rviz, choice.bag) == (RvizStart.REQUIRED, None)
