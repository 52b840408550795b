# SPDX-License-Identifier: BSD-3-Clause
"""The output of a playback."""
from __future__ import annotations

from typing import List, Protocol

from process_visualizer.messages.message_layout import Data


class Output(Protocol):
    """The receiver of played messages; called by one thread."""

    def publish(self, connection: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of a connection, given in pieces, when a monotonic time [ns] has come.

        It comes after those given before. This must not wait for receivers.
        """

    def withdraw(self, connection: int, due_ns: int) -> None:
        """Keep nothing for later subscribers of a connection's source, from a time on [ns].

        For ``revoke`` that is a message like others.
        """

    def revoke(self, after_ns: int) -> int:
        """Take back what is due after a monotonic time [ns]; return how many: the last ones given.

        What is being sent stays, and what was given when its time had passed; so does what was
        given before either of these, or is due at the same time.
        """

    def jump(self, bag_ns: int) -> None:
        """Take note that the position has jumped to a bag time [ns]; its scene follows."""

    def finish(self) -> bool:
        """Take note that play has reached its end; return whether nothing is to follow."""
