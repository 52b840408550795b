# SPDX-License-Identifier: BSD-3-Clause
"""Stand-in for the interactive_markers server, which needs a node."""
from __future__ import annotations

from typing import Any, Callable, Dict

from geometry_msgs.msg import Pose as PoseMessage
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerFeedback


class MarkerServer:
    """Marker server that shows the applied markers, as in RViz."""

    def __init__(self) -> None:
        self.shown: Dict[str, InteractiveMarker] = {}
        self._pending: Dict[str, InteractiveMarker] = {}
        self._callbacks: Dict[str, Callable[[Any], None]] = {}

    def insert(self, marker: InteractiveMarker, callback: Callable[[Any], None]) -> None:
        self._pending[marker.name], self._callbacks[marker.name] = marker, callback

    def setPose(self, name: str, pose: PoseMessage) -> None:  # noqa: N802
        self._pending[name].pose = pose

    def clear(self) -> None:
        self._pending = {}

    def applyChanges(self) -> None:  # noqa: N802
        self.shown = dict(self._pending)

    def feed_back(self, event: int, name: str, pose: PoseMessage) -> None:
        """Send RViz's feedback for a mouse event."""
        self._callbacks[name](InteractiveMarkerFeedback(
            marker_name=name, event_type=event, pose=pose))
