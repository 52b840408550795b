# SPDX-License-Identifier: BSD-3-Clause
"""The commands of the player, as the models use them."""
from __future__ import annotations

from typing import Any, Protocol


class PlayerCommands(Protocol):
    """Commands to the player (PlayerClient in clients/player_client.py); each call may block."""

    def wait_until_ready(self, timeout_s: float) -> Any:
        """Wait until the player takes commands."""

    def play(self) -> Any:
        """Play on."""

    def pause(self) -> Any:
        """Stand still."""

    def stop(self) -> Any:
        """Stand still at the beginning."""

    def seek(self, position_s: float) -> Any:
        """Go to a position [s]."""

    def set_rate(self, rate: float) -> Any:
        """Change the rate; below 0 backwards."""

    def step(self, count: int, topic: str = '', duration_s: float = 0.0) -> Any:
        """Pause and move by messages or by a time [s]."""

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> Any:
        """Repeat what is between two positions [s], or no more."""
