# SPDX-License-Identifier: BSD-3-Clause
"""The table of ``cell export``: its numbers are those at the position."""
from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Dict, List

import pyarrow.parquet
import pytest
import rosbag
from cycle_bags import write_bag
from sewing_runs import CELL, write_sewing_run

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.curves.position_values import PositionValues


def exported(folder: Path, *words: str) -> List[Dict[str, str]]:
    table = folder / 'table.csv'
    assert main(['export', *words, '-o', str(table)]) == 0
    with table.open(encoding='utf-8', newline='') as file:
        return list(csv.DictReader(file))


NAMES = {'v': 'tool speed', 'F': 'tool force'}


def test_each_row_has_the_numbers_at_its_position(tmp_path: Path) -> None:
    bag = write_sewing_run(tmp_path, 'a.bag')
    rows = exported(tmp_path, bag, '--rate', '3')
    begin_s = float(rows[0]['time [s]'])
    assert float(rows[-1]['time [s]']) == pytest.approx(begin_s + (len(rows) - 1) / 3, abs=1e-6)
    devices = XmlParser().parse(str(CELL)).devices
    values, compared = PositionValues([bag], devices), 0
    try:
        for row in rows[1:-1]:
            for (device, label, _), value in values.at(float(row['time [s]'])).items():
                column = next(it for it in row
                              if it.startswith(f'{device} {NAMES.get(label, label)}'))
                assert float(row[column] or math.nan) == pytest.approx(
                    math.nan if value is None else value, rel=1e-6, abs=1e-6, nan_ok=True), column
                compared += value is not None
    finally:
        values.close()
    assert compared > 5 * len(rows)


def test_the_joints_are_those_that_the_robot_shows(tmp_path: Path) -> None:
    bag = write_sewing_run(tmp_path, 'a.bag')
    rows = exported(tmp_path, bag, '--rate', '3')
    joints = [it for it in rows[0] if it.startswith('ur_rt_upper joint ')]
    assert len(joints) == 6 and all(it.endswith(' [rad]') for it in joints)
    with rosbag.Bag(bag) as recorded:
        begin_ns = min(time.to_nsec() for _, _, time in recorded.read_messages())
        sent = [((time.to_nsec() - begin_ns) / 1e9, message.data) for _, message, time
                in recorded.read_messages('/ur_rt_upper/q_act')]
    for row in rows[1:]:
        last = [data for time_s, data in sent if time_s <= float(row['time [s]']) + 1e-9][-1]
        assert [float(row[it]) for it in joints] == pytest.approx(last, rel=1e-6)


def test_several_runs_stand_below_each_other(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, cycles=3)
    rows = exported(tmp_path, f'{bag}#1', f'{bag}#3', '--rate', '2')
    assert sorted({row['run'].rpartition('#')[2] for row in rows}) == ['1', '3']


def test_parquet_has_the_same_numbers(tmp_path: Path) -> None:
    bag = write_bag(tmp_path)
    rows = exported(tmp_path, f'{bag}#1', '--rate', '5')
    path = tmp_path / 'table.parquet'
    assert main(['export', f'{bag}#1', '--rate', '5', '-o', str(path)]) == 0
    table = pyarrow.parquet.read_table(path).to_pydict()
    assert list(table) == list(rows[0])
    assert table['run'] == [row['run'] for row in rows]
    for name in list(table)[1:]:
        assert table[name] == pytest.approx([float(row[name] or math.nan) for row in rows],
                                            rel=1e-8, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(('words', 'problem'), [
    (['-o', 'table.xls'], 'name a file that ends in .csv, .parquet, .mcap'),
    (['-o', 'table.csv', '--rate', '0'], '--rate 0: write a number above 0'),
    (['-o', 'table.csv', '--rate', 'nan'], '--rate nan: write a number'),
    (['-o', 'table.csv', '--from', '0:30'], 'a.bag#1 goes from')])
def test_what_cannot_be_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                 words: List[str], problem: str) -> None:
    name = str(tmp_path / words[1])
    assert main(['export', f'{write_bag(tmp_path)}#1', '-o', name, *words[2:]]) == 1
    assert problem in capsys.readouterr().err
    assert not Path(name).exists()
