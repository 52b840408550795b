# SPDX-License-Identifier: BSD-3-Clause
"""The player's services as methods, for the launcher."""
from __future__ import annotations

from typing import Any, Callable, Dict, Optional, Type

from std_srvs.srv import Trigger

from process_visualizer.clients.service_connection import (
    ServiceConnection,
    ServiceUnreachable,
    StateFollower,
)
from process_visualizer.msg import PlayerState
from process_visualizer.ros_names import BAG_PLAYER
from process_visualizer.srv import Seek, SetLoop, SetRate, Step

_NODE = f'/{BAG_PLAYER}'
_SERVICES: Dict[str, Type[Any]] = {
    'play': Trigger, 'pause': Trigger, 'toggle_paused': Trigger, 'stop': Trigger, 'repeat': Trigger,
    'seek': Seek,
    'set_rate': SetRate, 'step': Step, 'set_loop': SetLoop}
_LAST_OFFERED = 'set_loop'


class PlayerError(Exception):
    """The player refused a command and changed nothing; the text gives the reason."""


class PlayerUnreachable(PlayerError):
    """The player cannot be reached."""


class PlayerClient:
    """Commands the node ``bag_player`` and follows its state; needs an initialized rospy node.

    Every command waits for the player's answer and returns it as a text for the user; do not call
    it in the GUI thread. Connections are kept, for scrubbing, and renewed after a restart of the
    player. A command that cannot be carried out raises PlayerError with the player's reason, or
    PlayerUnreachable. ``on_state`` is called in rospy's thread.
    """

    def __init__(self, on_state: Optional[Callable[[PlayerState], None]] = None,
                 node: str = _NODE, timeout_s: float = 10.0, follow_now: bool = True,
                 master_uri: Optional[str] = None) -> None:
        """Follow the state, from now or from ``begin`` on.

        A player on another master can be commanded, but not followed. A call fails if the player
        does not answer within the timeout.
        """
        self._node = node
        self._follower: StateFollower[PlayerState] = StateFollower(
            f'{node}/state', PlayerState, on_state, follow_now)
        address = self._follower.sender_address if master_uri is None else None
        self._services = {name: ServiceConnection(f'{node}/{name}', service, timeout_s,
                                                  master_uri, address)
                          for name, service in _SERVICES.items()}

    def begin(self) -> None:
        """Start following the state, if the constructor did not; waits for the master."""
        self._follower.begin()

    @property
    def state(self) -> Optional[PlayerState]:
        """The last state; None before the first one."""
        return self._follower.state

    def close(self) -> None:
        """Stop following the state and close the connections; the player continues."""
        self._follower.close()
        for service in self._services.values():
            service.close()

    def wait_until_ready(self, timeout_s: float) -> None:
        """Wait until the player runs.

        Raises:
            PlayerUnreachable: it is not running after the timeout.
        """
        if not self._services[_LAST_OFFERED].wait(timeout_s):
            raise PlayerUnreachable(f'{self._node} is not running; start it with '
                                    '"rosrun process_visualizer bag_player FILE"')

    def wait_for(self, condition: Callable[[PlayerState], bool],
                 timeout_s: Optional[float] = None) -> Optional[PlayerState]:
        """Wait for a state that fulfills a condition; return it, or None after the timeout."""
        return self._follower.wait_for(condition, timeout_s)

    def play(self) -> str:
        """Continue playing; at the end, start over."""
        return self._call('play')

    def pause(self) -> str:
        """Pause."""
        return self._call('pause')

    def toggle_paused(self) -> str:
        """Play if paused, pause if playing."""
        return self._call('toggle_paused')

    def stop(self) -> str:
        """Go to the beginning and pause there."""
        return self._call('stop')

    def repeat(self) -> str:
        """Publish the scene again while paused, for a cell that has changed."""
        return self._call('repeat')

    def seek(self, position_s: float) -> str:
        """Go to a position [s from the beginning] within the recording; keep playing or pausing."""
        return self._call('seek', position_s)

    def set_rate(self, rate: float) -> str:
        """Set the rate: 0.01 to 16, or -16 to -0.01 for backward playback."""
        return self._call('set_rate', rate)

    def step(self, count: int = 0, topic: str = '', duration_s: float = 0.0) -> str:
        """Pause and move by messages of one topic or all (''), or by a time [s] if count is 0."""
        return self._call('step', count, topic, duration_s)

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> str:
        """Repeat the part between two positions [s], or all if both are 0; or stop repeating."""
        return self._call('set_loop', loop, begin_s, end_s)

    def _call(self, name: str, *request: object) -> str:
        try:
            answer = self._services[name].call(*request)
        except ServiceUnreachable as error:
            raise PlayerUnreachable(str(error)) from error
        if not answer.success:
            raise PlayerError(answer.message)
        return str(answer.message)
