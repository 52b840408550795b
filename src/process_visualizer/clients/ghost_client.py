# SPDX-License-Identifier: BSD-3-Clause
"""Commands to the node ghost."""
from __future__ import annotations

from typing import Any, List, Optional, Sequence, Type

from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.msg import GhostArrow as GhostArrowMessage
from process_visualizer.msg import GhostEvent, GhostRobot
from process_visualizer.ros_names import GHOST
from process_visualizer.runs.comparison.ghost import GhostTrack, LiveReference, ReferenceArrow
from process_visualizer.srv import (
    FollowGhost,
    FollowGhostRequest,
    ShowGhost,
    ShowGhostRequest,
)

_TIMEOUT_S = 10.0  # the node reads up to an hour of joint positions
_NODE_START_S = 5.0  # the node may have started just now


class GhostError(Exception):
    """The ghost cannot be shown; the text gives the reason."""


def show_ghost(tracks: Sequence[GhostTrack], arrows: Sequence[ReferenceArrow] = (),
               master_uri: Optional[str] = None, start_s: float = 0.0) -> None:
    """Show robots and arrows of another run in step with the player; without any, hide all.

    Args:
        tracks: the robots' tracks.
        arrows: the arrows of the run's quantities.
        master_uri: the URI of another master than this process's, if given.
        start_s: maximum time that the node may still need to start [s].

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    _call('show', ShowGhost, ghost_request(tracks, arrows), master_uri, start_s)


def follow_ghost(reference: LiveReference, is_visible: bool = True) -> None:
    """Follow the live robots with a reference, drawn or hidden; stop if it has no tracks.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    _call('follow', FollowGhost, follow_request(reference, is_visible), None, _NODE_START_S)


def ghost_request(tracks: Sequence[GhostTrack],
                  arrows: Sequence[ReferenceArrow]) -> ShowGhostRequest:
    """Return the request that `show_ghost` sends to the node."""
    return ShowGhostRequest(_robots(tracks), [_message(it) for it in arrows])


def follow_request(reference: LiveReference, is_visible: bool = True) -> FollowGhostRequest:
    """Return the request that `follow_ghost` sends to the node."""
    events = [GhostEvent(name=event.name, topic=event.topic, field=event.field,
                         threshold=event.threshold, is_above=event.is_above,
                         hysteresis=event.hysteresis, times=list(times_s))
              for event, times_s in reference.events]
    begin, end = ('', '') if reference.span is None else (reference.span.begin, reference.span.end)
    return FollowGhostRequest(_robots(reference.tracks), events, begin, end, is_visible)


def _robots(tracks: Sequence[GhostTrack]) -> List[GhostRobot]:
    return [GhostRobot(device=it.device, tool=it.tool, joints=list(it.there.joints),
                       times=it.there.times_s.tolist(), there=it.there.positions.ravel().tolist(),
                       here=it.here.ravel().tolist()) for it in tracks]


def _message(arrow: ReferenceArrow) -> GhostArrowMessage:
    return GhostArrowMessage(
        name=arrow.name, frame=arrow.frame, foot_frame=arrow.foot_frame, foot=list(arrow.foot),
        times=arrow.times_s.tolist(), vectors=arrow.vectors.ravel().tolist())


def _call(name: str, kind: Type[Any], request: Any, master_uri: Optional[str],
          start_s: float) -> None:
    service = ServiceConnection(f'/{GHOST}/{name}', kind, _TIMEOUT_S, master_uri)
    try:
        service.wait(start_s)
        answer = service.call(*(getattr(request, name) for name in request.__slots__))
    except ServiceUnreachable as error:
        raise GhostError(f'The ghost cannot be shown: {error}') from error
    finally:
        service.close()
    if not answer.success:
        raise GhostError(f'The ghost cannot be shown: {answer.message}')
