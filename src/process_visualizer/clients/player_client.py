# SPDX-License-Identifier: BSD-3-Clause
"""The player's services as methods, for the launcher."""
from __future__ import annotations

from typing import Any, Callable, Dict, Optional, Type

from std_srvs.srv import Trigger

from process_visualizer.clients.service_connection import NodeClient
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


class PlayerClient(NodeClient[PlayerState]):
    """Commands the node ``bag_player`` and follows its state.

    Each command returns the player's answer as a text for the user. A command that cannot be
    carried out raises PlayerError with the player's reason, or PlayerUnreachable.
    """

    REFUSED, UNREACHABLE = PlayerError, PlayerUnreachable

    def __init__(self, on_state: Optional[Callable[[PlayerState], None]] = None,
                 node: str = _NODE, timeout_s: float = 10.0, follow_now: bool = True,
                 master_uri: Optional[str] = None) -> None:
        """See NodeClient."""
        super().__init__(node, PlayerState, _SERVICES, timeout_s, on_state, follow_now, master_uri)

    def wait_until_ready(self, timeout_s: float) -> None:
        """Wait until the player runs.

        Raises:
            PlayerUnreachable: it is not running after the timeout.
        """
        self._wait_for_service(_LAST_OFFERED, timeout_s, 'bag_player FILE')

    def play(self) -> str:
        """Continue to play; at the end, start over."""
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
        """Publish the scene again while paused, because the cell has changed."""
        return self._call('repeat')

    def seek(self, position_s: float) -> str:
        """Seek to a position [s from the beginning] in the recording; keep playing or pausing."""
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
        return str(self._answer(name, *request).message)
