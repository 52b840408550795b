# SPDX-License-Identifier: BSD-3-Clause
"""Send times of messages, on this computer's clock."""
from __future__ import annotations

import math

_OLDEST_S = 60.0
"""What is said to be older was stamped by a clock that has been put back."""


class SenderClock:
    """Compares the stamps of one sender with the times at which its messages arrive.

    The clocks may differ: the message that needed least time shows by how much. So a message that
    waited, because this program or its computer stood still, is known to be old.
    """

    def __init__(self) -> None:
        self._offset_s = math.inf

    def sent_s(self, stamp_s: float, now_s: float) -> float:
        """Return when a message with this stamp, which arrives now, was sent."""
        self._offset_s = min(self._offset_s, now_s - stamp_s)
        return max(stamp_s + self._offset_s, now_s - _OLDEST_S)
