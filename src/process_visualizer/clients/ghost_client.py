# SPDX-License-Identifier: BSD-3-Clause
"""Commands the node ghost."""
from __future__ import annotations

from typing import Sequence

import rosgraph
import rospy

from process_visualizer.msg import GhostRobot
from process_visualizer.ros_names import GHOST
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.srv import ShowGhost


class GhostError(Exception):
    """There is no ghost; says why."""


def show_ghost(tracks: Sequence[GhostTrack]) -> None:
    """Show robots of another run in step with the player; without tracks hide them.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    robots = [GhostRobot(device=it.device, tool=it.tool, joints=list(it.there.joints),
                         times=it.there.times_s.tolist(),
                         there=it.there.positions.ravel().tolist(),
                         here=it.here.ravel().tolist()) for it in tracks]
    try:
        answer = rospy.ServiceProxy(f'/{GHOST}/show', ShowGhost)(robots)
    except (rospy.ServiceException, rosgraph.MasterException, OSError) as error:
        raise GhostError(f'The ghost cannot be shown: /{GHOST} does not answer '
                         f'({error})') from error
    if not answer.success:
        raise GhostError(f'The ghost cannot be shown: {answer.message}')
