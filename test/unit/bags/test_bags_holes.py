# SPDX-License-Identifier: BSD-3-Clause
"""Times at which no topic was recorded."""
from __future__ import annotations

from pathlib import Path
from typing import List

import numpy as np
import pytest
from bag_files import Row, write_bag

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import as_text, make_report

S = 10 ** 9
BEGIN_NS = 1_700_000_000 * S


def rows(*spans_s: 'tuple[float, float]') -> List[Row]:
    """Two topics at 20 Hz in spans (begin, end) [s]."""
    return [Row(topic, BEGIN_NS + round(time_s * S), b'') for begin_s, end_s in spans_s
            for time_s in np.arange(begin_s, end_s, 0.05) for topic in ('/a', '/b')]


@pytest.mark.parametrize('spans, told', [
    (((0.0, 12.4), (21.4, 30.0)), ('nothing was recorded for 9.0 s from 0:12.3 on; if the recorder '
                                   'or its computer had stopped, messages that arrived just '
                                   'afterwards are late',)),
    (((0.0, 70.0), (73.0, 90.0), (95.0, 99.0)), (
        'nothing was recorded 2 times, the longest time for 5.0 s from 1:30.0 on; if the recorder '
        'or its computer had stopped, messages that arrived just afterwards are late',)),
    (((0.0, 12.4), (14.0, 30.0)), ()),
    (((0.0, 0.05), (60.0, 90.0)), ())])  # latched messages first; the drivers start later
def test_a_time_without_any_message_is_told(tmp_path: Path, spans: 'tuple[tuple[float, float]]',
                                            told: 'tuple[str, ...]') -> None:
    path = write_bag(tmp_path / 'a.bag', rows(*spans))
    assert read_catalog([path]).remarks == told
    with Recording([path]) as recording:
        text = as_text(make_report(recording))
    assert all(it in text for it in told) and ('nothing was recorded' in text) is bool(told)


def test_topics_that_are_silent_now_and_then_have_no_holes(tmp_path: Path) -> None:
    path = write_bag(tmp_path / 'a.bag', rows(*((3.0 * it, 3.0 * it + 0.5) for it in range(20))))
    with Recording([path]) as recording:
        assert len(recording.holes(1.0)) == 0 and recording.remarks == ()
