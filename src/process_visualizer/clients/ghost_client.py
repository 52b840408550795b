# SPDX-License-Identifier: BSD-3-Clause
"""Commands the node ghost."""
from __future__ import annotations

from typing import Optional, Sequence

from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.msg import GhostArrow as GhostArrowMessage
from process_visualizer.msg import GhostRobot
from process_visualizer.ros_names import GHOST
from process_visualizer.runs.comparison.ghost_arrows import GhostArrow
from process_visualizer.runs.comparison.ghost_tracks import GhostTrack
from process_visualizer.srv import ShowGhost, ShowGhostRequest

_TIMEOUT_S = 10.0  # an hour of joints is to be read


class GhostError(Exception):
    """There is no ghost; says why."""


def show_ghost(tracks: Sequence[GhostTrack], arrows: Sequence[GhostArrow] = (),
               master_uri: Optional[str] = None, start_s: float = 0.0) -> None:
    """Show robots and arrows of another run in step with the player; without any hide them.

    Args:
        tracks: of the robots.
        arrows: of its quantities.
        master_uri: of another master than that of this process.
        start_s: so long the node may still need to start.

    Raises:
        GhostError: the node does not answer, or refuses.
    """
    request = ghost_request(tracks, arrows)
    service = ServiceConnection(f'/{GHOST}/show', ShowGhost, _TIMEOUT_S, master_uri)
    try:
        service.wait(start_s)
        answer = service.call(request.robots, request.arrows)
    except ServiceUnreachable as error:
        raise GhostError(f'The ghost cannot be shown: {error}') from error
    finally:
        service.close()
    if not answer.success:
        raise GhostError(f'The ghost cannot be shown: {answer.message}')


def ghost_request(tracks: Sequence[GhostTrack],
                  arrows: Sequence[GhostArrow]) -> ShowGhostRequest:
    """Return what the node is sent."""
    robots = [GhostRobot(device=it.device, tool=it.tool, joints=list(it.there.joints),
                         times=it.there.times_s.tolist(),
                         there=it.there.positions.ravel().tolist(),
                         here=it.here.ravel().tolist()) for it in tracks]
    return ShowGhostRequest(robots, [_message(it) for it in arrows])


def _message(arrow: GhostArrow) -> GhostArrowMessage:
    return GhostArrowMessage(
        name=arrow.name, frame=arrow.frame, foot_frame=arrow.foot_frame, foot=list(arrow.foot),
        times=arrow.times_s.tolist(), vectors=arrow.vectors.ravel().tolist())
