# SPDX-License-Identifier: BSD-3-Clause
"""The services of the player."""
from __future__ import annotations

from typing import Any, Callable, Dict, Type

from std_srvs.srv import Trigger, TriggerResponse

from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.timeline import CommandRefused
from process_visualizer.srv import (
    Seek,
    SeekResponse,
    SetLoop,
    SetLoopResponse,
    SetRate,
    SetRateResponse,
    Step,
    StepResponse,
)


class PlayerServices:
    """One service for each command; each answers success and message."""

    def __init__(self, control: PlayerControl, after: Callable[[], None],
                 node: NodeHandle) -> None:
        """Advertise them; ``after`` is called after each command."""
        self._after = after
        self._node = node
        triggers: Dict[str, Callable[[], str]] = {
            'play': control.play, 'pause': control.pause, 'stop': control.stop,
            'toggle_paused': control.toggle_paused, 'repeat': control.repeat}
        self._services = [self._offer(name, Trigger, TriggerResponse, _without_request(do))
                          for name, do in triggers.items()]
        self._services += [
            self._offer('seek', Seek, SeekResponse, lambda it: control.seek(it.position)),
            self._offer('set_rate', SetRate, SetRateResponse, lambda it: control.set_rate(it.rate)),
            self._offer('step', Step, StepResponse,
                        lambda it: control.step(it.count, it.topic, it.duration)),
            self._offer('set_loop', SetLoop, SetLoopResponse,
                        lambda it: control.set_loop(it.loop, it.begin, it.end)),
        ]

    def close(self) -> None:
        """Shut the services down."""
        for service in self._services:
            service.shutdown()

    def _offer(self, name: str, service: Type[Any], response: Type[Any],
               command: Callable[[Any], str]) -> Any:
        def answer(request: Any) -> Any:
            try:
                result = response(True, command(request))
            except CommandRefused as refusal:
                result = response(False, str(refusal))
            self._after()
            return result

        return self._node.serve(f'~{name}', service, answer)


def _without_request(command: Callable[[], str]) -> Callable[[Any], str]:
    return lambda request: command()
