# SPDX-License-Identifier: BSD-3-Clause
"""The joints of a robot as they are now."""
from __future__ import annotations

from typing import Dict, Optional

from sensor_msgs.msg import JointState

from process_visualizer.nodes.common.node_handle import NodeHandle


class LiveJoints:
    """Subscribes to what the robot's own picture is moved by, so the ghost is in step with that."""

    def __init__(self, node: NodeHandle, device: str) -> None:
        """Begin to listen."""
        self._positions: Dict[str, float] = {}
        self.stamp_s = 0.0
        """When they were measured; 0 before there are any, or if they are not stamped."""
        self._subscriber = node.subscribe(f'/{device}/joint_states', JointState, self._take,
                                          queue_size=10)

    def _take(self, message: JointState) -> None:
        self.stamp_s = message.header.stamp.to_sec()
        self._positions = {**self._positions, **dict(zip(message.name, message.position))}

    def at(self, _time_s: float) -> Optional[Dict[str, float]]:
        """Return the positions [rad or m] by joint; None before there are any."""
        return self._positions or None

    def close(self) -> None:
        """Listen no longer."""
        self._subscriber.unregister()
