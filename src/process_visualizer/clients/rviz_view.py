# SPDX-License-Identifier: BSD-3-Clause
"""RViz's services for its view, as methods for the launcher."""
from __future__ import annotations

import threading
from typing import Any, Dict, List, Optional, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Bool, String

from process_visualizer.clients.service_connection import (
    ServiceConnection,
    ServiceMissing,
    ServiceUnreachable,
)
from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC, RVIZ

_NODE = f'/{RVIZ}'


class _SendFilePath:
    """The service rviz/SendFilePath: takes a text, returns a truth value.

    RViz's own Python module cannot be used, because it loads all of RViz.
    """

    _md5sum = '92f17244ff295b327b62c307fafe751b'
    _request_class = String
    _response_class = Bool


class RvizViewError(Exception):
    """RViz could not write or read its view; the text gives the reason."""


class RvizView:
    """The view of a running RViz; its methods block."""

    def __init__(self, node: str = _NODE, timeout_s: float = 10.0) -> None:
        """``node`` is the name of RViz; ``timeout_s`` limits each answer."""
        self._node = node
        self._save, self._load, self._load_before = (
            ServiceConnection(f'{node}/{name}', _SendFilePath, timeout_s)
            for name in ('save_config', 'load_config_discarding_changes', 'load_config'))

    def save(self, path: str) -> None:
        """Make RViz write its present view, with the camera, to a file (absolute path).

        Raises:
            RvizViewError: RViz does not answer, or fails.
        """
        self._call([self._save], path, 'cannot write its view to')

    def load(self, path: str) -> None:
        """Make RViz load the view from a file (absolute path).

        RViz before 1.14.5 has only the second service, which discards changes there; later versions
        ask the user.

        Raises:
            RvizViewError: RViz does not answer, or cannot read the file.
        """
        self._call([self._load, self._load_before], path, 'cannot read a view from')

    def close(self) -> None:
        """Close the connections."""
        for service in (self._save, self._load, self._load_before):
            service.close()

    def _call(self, services: Sequence[ServiceConnection], path: str, problem: str) -> None:
        try:
            answer = _first_offered(services, path)
        except ServiceUnreachable as error:
            raise RvizViewError(str(error)) from None
        if not answer.data:
            raise RvizViewError(f'{self._node} {problem} "{path}"')


def _first_offered(services: Sequence[ServiceConnection], path: str) -> Any:
    """Return the answer of the first service that exists."""
    for service in services[:-1]:
        try:
            return service.call(path)
        except ServiceMissing:
            continue
    return services[-1].call(path)


_FRAMES_AFTER_OK = 5
"""Number of frames drawn after all displays became OK: a second with a software renderer."""


class DrawnView:
    """The drawing state of RViz, as last reported."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._report: Optional[DiagnosticArray] = None
        self._frames_when_ok: Optional[int] = None

    @property
    def frames(self) -> int:
        """The number of frames drawn so far."""
        with self._changed:
            return self._frames()

    def take(self, report: DiagnosticArray) -> None:
        """Process a report (from any thread); an empty one says nothing about RViz."""
        if not report.status:
            return
        with self._changed:
            self._report = report
            all_ok = all(status.level == DiagnosticStatus.OK for status in report.status)
            if not all_ok:
                self._frames_when_ok = None
            elif self._frames_when_ok is None:
                self._frames_when_ok = self._frames()
            self._changed.notify_all()

    def begin_again(self) -> None:
        """Reset the drawing state, because the scene has changed."""
        with self._changed:
            self._frames_when_ok = None

    def wait_until_drawn(self, timeout_s: float) -> bool:
        """Wait until all displays are OK and five more frames were drawn."""
        with self._changed:
            return self._changed.wait_for(self._is_drawn, timeout_s)

    def wait_until_ok(self, timeout_s: float) -> bool:
        """Wait until all displays are OK."""
        with self._changed:
            return self._changed.wait_for(lambda: self._frames_when_ok is not None, timeout_s)

    def problems(self) -> List[str]:
        """Return a line for each display that is not OK."""
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
