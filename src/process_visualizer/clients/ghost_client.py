# SPDX-License-Identifier: BSD-3-Clause
"""Commands the node ghost."""
from __future__ import annotations

from typing import Any, List, Sequence

import rosgraph
import rospy

from process_visualizer.msg import GhostEvent, GhostRobot
from process_visualizer.ros_names import GHOST
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.runs.comparison.live_reference import LiveReference
from process_visualizer.srv import FollowGhost, ShowGhost

_TIMEOUT_S = 5.0


class GhostError(Exception):
    """There is no ghost; says why."""


def show_ghost(tracks: Sequence[GhostTrack]) -> None:
    """Show robots of another run in step with the player; without tracks hide them.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    _call('show', ShowGhost, _robots(tracks))


def follow_ghost(reference: LiveReference, is_visible: bool = True) -> None:
    """Follow the live robots beside a reference, and draw it or not; without tracks follow none.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    events = [GhostEvent(name=event.name, topic=event.topic, field=event.field,
                         threshold=event.threshold, is_above=event.is_above,
                         hysteresis=event.hysteresis, times=list(times_s))
              for event, times_s in reference.events]
    begin, end = ('', '') if reference.span is None else (reference.span.begin, reference.span.end)
    _call('follow', FollowGhost, _robots(reference.tracks), events, begin, end, is_visible)


def _robots(tracks: Sequence[GhostTrack]) -> List[GhostRobot]:
    return [GhostRobot(device=it.device, tool=it.tool, joints=list(it.there.joints),
                       times=it.there.times_s.tolist(), there=it.there.positions.ravel().tolist(),
                       here=it.here.ravel().tolist()) for it in tracks]


def _call(service: str, kind: Any, *request: Any) -> None:
    name = f'/{GHOST}/{service}'
    try:
        rospy.wait_for_service(name, _TIMEOUT_S)  # the node may have started just now
        answer = rospy.ServiceProxy(name, kind)(*request)
    except (rospy.ROSException, rospy.ServiceException, rosgraph.MasterException,
            OSError) as error:
        raise GhostError(f'The ghost cannot be shown: /{GHOST} does not answer '
                         f'({error})') from error
    if not answer.success:
        raise GhostError(f'The ghost cannot be shown: {answer.message}')
