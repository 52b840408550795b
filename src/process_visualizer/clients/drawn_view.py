# SPDX-License-Identifier: BSD-3-Clause
"""Drawing state of RViz, by the reports of its display DisplayStatus."""
from __future__ import annotations

import threading
from typing import Dict, List, Optional

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC

_FRAMES_AFTER_OK = 5
"""Frames that must have been drawn since every display is OK: a second of a software renderer."""


class DrawnView:
    """The drawing state of RViz, as last reported."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._report: Optional[DiagnosticArray] = None
        self._frames_when_ok: Optional[int] = None

    @property
    def frames(self) -> int:
        """Return how many have been drawn."""
        with self._changed:
            return self._frames()

    def take(self, report: DiagnosticArray) -> None:
        """Take a report; called in any thread."""
        with self._changed:
            self._report = report
            all_ok = all(status.level == DiagnosticStatus.OK for status in report.status)
            if not all_ok:
                self._frames_when_ok = None
            elif self._frames_when_ok is None:
                self._frames_when_ok = self._frames()
            self._changed.notify_all()

    def begin_again(self) -> None:
        """Forget that everything was drawn: the scene has changed."""
        with self._changed:
            self._frames_when_ok = None

    def wait_until_drawn(self, timeout_s: float) -> bool:
        """Wait until all displays are OK and were drawn five times."""
        with self._changed:
            return self._changed.wait_for(self._is_drawn, timeout_s)

    def wait_until_ok(self, timeout_s: float) -> bool:
        """Wait until all displays are OK."""
        with self._changed:
            return self._changed.wait_for(lambda: self._frames_when_ok is not None, timeout_s)

    def problems(self) -> List[str]:
        """The displays that are not OK, one line for each."""
        with self._changed:
            if self._report is None:
                return [f'nothing was received on {DISPLAY_STATUS_TOPIC}: is RViz running '
                        'with a generated configuration?']
            return [f'{status.name}: {status.message}' for status in self._report.status
                    if status.level != DiagnosticStatus.OK]

    def _is_drawn(self) -> bool:
        return (self._frames_when_ok is not None
                and self._frames() >= self._frames_when_ok + _FRAMES_AFTER_OK)

    def _frames(self) -> int:
        if self._report is None:
            return 0
        values: Dict[str, str] = {item.key: item.value for item in self._report.status[0].values}
        return int(values['frames'])
