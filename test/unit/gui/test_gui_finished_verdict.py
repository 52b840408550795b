# SPDX-License-Identifier: BSD-3-Clause
"""The window's verdict on a bag is that of `cell report`."""
from __future__ import annotations

import json
from pathlib import Path

import pytest
import rosbag
from genpy import Time
from std_msgs.msg import String

from process_visualizer.bagio.recorder_topics import ACCOUNT
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import make_report, verdict
from process_visualizer.gui.recording.recording_model import BagVerdict, verdict_on


@pytest.mark.parametrize('dropped, is_good', [(0, True), (3, False), (None, True)])
def test_a_bag(tmp_path: Path, dropped: object, is_good: bool) -> None:
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/a', String('x'), Time(1, 0))
        if dropped is not None:
            account = {'topics': {'/a': {'received': 4, 'dropped': dropped}}, 'clock_jumps': []}
            bag.write(ACCOUNT, String(json.dumps(account)), Time(2, 0))
    with Recording([path]) as recording:
        assert verdict_on([path]) == BagVerdict(is_good, verdict(make_report(recording)))


def test_a_bag_that_cannot_be_read(tmp_path: Path) -> None:
    found = verdict_on([str(tmp_path / 'none.bag')])
    assert not found.is_good
    assert 'none.bag: cannot be opened' in found.text
