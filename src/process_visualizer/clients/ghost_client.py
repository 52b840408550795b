# SPDX-License-Identifier: BSD-3-Clause
"""Commands the node ghost."""
from __future__ import annotations

from typing import Any, Callable, List, Sequence

import rosgraph
import rospy

from process_visualizer.msg import GhostEvent, GhostRobot
from process_visualizer.ros_names import GHOST
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.runs.comparison.live_reference import LiveReference
from process_visualizer.srv import FollowGhost, ShowGhost


class GhostError(Exception):
    """There is no ghost; says why."""


def show_ghost(tracks: Sequence[GhostTrack]) -> None:
    """Show robots of another run in step with the player; without tracks hide them.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    _call(lambda: rospy.ServiceProxy(f'/{GHOST}/show', ShowGhost)(_robots(tracks)))


def follow_ghost(reference: LiveReference) -> None:
    """Show a reference in step with the live robots; without tracks hide it.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    events = [GhostEvent(name=event.name, topic=event.topic, field=event.field,
                         threshold=event.threshold, is_above=event.is_above,
                         hysteresis=event.hysteresis, times=list(times_s))
              for event, times_s in reference.events]
    begin, end = ('', '') if reference.span is None else (reference.span.begin, reference.span.end)
    _call(lambda: rospy.ServiceProxy(f'/{GHOST}/follow', FollowGhost)(
        _robots(reference.tracks), events, begin, end))


def _robots(tracks: Sequence[GhostTrack]) -> List[GhostRobot]:
    return [GhostRobot(device=it.device, tool=it.tool, joints=list(it.there.joints),
                       times=it.there.times_s.tolist(), there=it.there.positions.ravel().tolist(),
                       here=it.here.ravel().tolist()) for it in tracks]


def _call(service: Callable[[], Any]) -> None:
    try:
        answer = service()
    except (rospy.ServiceException, rosgraph.MasterException, OSError) as error:
        raise GhostError(f'The ghost cannot be shown: /{GHOST} does not answer '
                         f'({error})') from error
    if not answer.success:
        raise GhostError(f'The ghost cannot be shown: {answer.message}')
