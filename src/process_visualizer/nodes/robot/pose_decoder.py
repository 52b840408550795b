# SPDX-License-Identifier: BSD-3-Clause
"""The interface of decoders that find the poses of a tool in recorded messages."""
from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Mapping, Optional

import rospy

from process_visualizer.nodes.robot.robot_messages import ToolPose


class FramesNotConnected(ValueError):
    """The frames between a pose and the base frame are not known: other nodes send them."""


class PoseDecoder(ABC):
    """Receives messages in their order; each may give a pose in the base frame."""

    @abstractmethod
    def pose(self, message: bytes) -> Optional[ToolPose]:
        """Return the pose in a message of the tool's topic, if there is one.

        Raises:
            FramesNotConnected: the joints, or other frames, are missing so far.
            ValueError: the message cannot be used.
        """

    @abstractmethod
    def take_joints(self, positions: Mapping[str, float], stamp: rospy.Time
                    ) -> Optional[ToolPose]:
        """Note the positions [rad or m] of joints by name; return the pose if it is a new one.

        Raises:
            FramesNotConnected: as above.
        """
