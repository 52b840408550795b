# SPDX-License-Identifier: BSD-3-Clause
"""The box of a depth sensor is written into the file, and nothing else changes."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from process_visualizer.cell.file_edit import PoseEditError, PoseEditor
from process_visualizer.cell.model import RegionOfInterest
from process_visualizer.cell.xml_parser import XmlParser


def document(roi: str) -> str:
    return ('<visualizer>\n<device type="depth_sensor" name="k"><!-- a --><topic name="c" '
            f'type="pointcloud"/>\n{roi}</device></visualizer>')


def saved_text(path: Path, roi: str, **new: object) -> str:
    """The text of the <roi> after other values have been saved."""
    path.write_text(document(roi), encoding='utf-8')
    cell = XmlParser().parse(str(path))
    region = cell.devices[0].roi
    assert region is not None
    PoseEditor(cell).save_region('k', replace(region, **new))
    changed = path.read_text(encoding='utf-8')
    return changed.split('\n')[-1].split('</device>')[0]


@pytest.mark.parametrize('before, after', [
    ('<roi frame="f" xyz="1 2 3" size="1 1 1" />', '<roi frame="f" xyz="0.5 2 3" size="2 1 1" />'),
    ('<roi size=" 1  1 1"/>', '<roi size=" 2  1 1" xyz="0.5 2 3"/>'),
])
def test_only_the_numbers_change(before: str, after: str, tmp_path: Path) -> None:
    assert saved_text(tmp_path / 'cell.xml', before, center=(0.5, 2.0, 3.0),
                      size=(2.0, 1.0, 1.0)) == after


def test_what_is_there_already_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / 'cell.xml'
    path.write_text(document('<roi size="1 1 1"/>'), encoding='utf-8')
    cell = XmlParser().parse(str(path))
    region = cell.devices[0].roi
    assert region is not None
    assert PoseEditor(cell).save_region('k', region) is None
    assert [it.name for it in tmp_path.iterdir()] == ['cell.xml']


def test_numbers_from_arguments_are_not_replaced(tmp_path: Path) -> None:
    with pytest.raises(PoseEditError, match=r'3: <roi>: size="\$\(optenv S 1\) 1 1" comes from'):
        saved_text(tmp_path / 'cell.xml', '<roi size="$(optenv S 1) 1 1"/>', size=(2.0, 1.0, 1.0))


def test_a_device_without_a_box(tmp_path: Path) -> None:
    path = tmp_path / 'cell.xml'
    path.write_text('<visualizer><device type="other" name="a"/></visualizer>', encoding='utf-8')
    cell = XmlParser().parse(str(path))
    region = RegionOfInterest('world', (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), cell.devices[0].location)
    with pytest.raises(PoseEditError, match='no longer has a <roi>'):
        PoseEditor(cell).save_region('a', region)
