# SPDX-License-Identifier: BSD-3-Clause
"""What finds the poses of a tool in recorded messages."""
from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Mapping, Optional

import rospy

from process_visualizer.nodes.robot.robot_messages import ToolPose


class FramesNotConnected(ValueError):
    """What lies between a pose and the base frame is not known: somebody else sends that."""


class PoseDecoder(ABC):
    """Takes messages in their order; each may bring a pose in the base frame."""

    @abstractmethod
    def pose(self, message: bytes) -> Optional[ToolPose]:
        """Return the pose that comes with a message of the tool's topic, if one does.

        Raises:
            FramesNotConnected: not without the joints, or not yet.
            ValueError: the message cannot be used.
        """

    @abstractmethod
    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """Take the positions [rad or m] of joints by name; return the pose if it is a new one.

        Raises:
            FramesNotConnected: as above.
        """
