# SPDX-License-Identifier: BSD-3-Clause
"""The state of the view in reports of RViz's displays."""
from __future__ import annotations

from typing import Tuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from process_visualizer.clients.rviz_view import DrawnView


def report(frames: int, *levels: int) -> DiagnosticArray:
    return DiagnosticArray(status=[DiagnosticStatus(
        level=level, name=f'display {number}', values=[KeyValue('frames', str(frames))])
        for number, level in enumerate(levels)])


def state(view: DrawnView) -> Tuple[bool, bool]:
    return view.wait_until_ok(0.0), view.wait_until_drawn(0.0)


def test_five_more_frames_are_drawn_after_all_displays_are_ok() -> None:
    view = DrawnView()
    view.take(report(3, DiagnosticStatus.OK, DiagnosticStatus.WARN))
    assert state(view) == (False, False)
    view.take(report(4, DiagnosticStatus.OK, DiagnosticStatus.OK))
    assert state(view) == (True, False)
    view.take(report(9, DiagnosticStatus.OK, DiagnosticStatus.OK))
    assert state(view) == (True, True)


def test_an_empty_report_says_nothing() -> None:
    view = DrawnView()
    view.take(DiagnosticArray())
    assert state(view) == (False, False)
    assert 'nothing was received' in view.problems()[0]
    view.take(report(4, DiagnosticStatus.OK))
    view.take(DiagnosticArray())
    assert (state(view), view.frames) == ((True, False), 4)
