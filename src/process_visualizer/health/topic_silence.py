# SPDX-License-Identifier: BSD-3-Clause
"""Decides when a topic is silent for longer than usual, from the recorder's counts.

The window shows such a topic after five usual intervals. The recorder itself reports it as a
problem of the recording only after ten (src/recorder/topic_statistics.cpp).
"""
from __future__ import annotations

from typing import Dict, NamedTuple, Optional

_MIN_SILENCE_S = 1.0
_INTERVALS = 5.0
"""Number of usual intervals after which a silence is unusual."""
_PAUSE_FACTOR = 2.0
_MAX_PAUSE_S = 10.0
"""Maximum pause that counts as usual; a longer silence was an outage."""
_WEIGHT = 0.05
_MIN_MESSAGES = 10


class TopicActivity(NamedTuple):
    """Activity of a topic: rate [Hz] over the last second, and silence [s] (None: no message)."""

    rate_hz: float
    silence_s: Optional[float]
    is_silent: bool


class TopicWatch:
    """Learns the usual activity of each topic, and detects unusual silences."""

    def __init__(self) -> None:
        self._usual: Dict[str, _Usual] = {}

    def update(self, topic: str, rate_hz: float, silence_s: Optional[float],
               messages: int, largest_gap_s: float = 0.0,
               is_latched: bool = False) -> TopicActivity:
        """Return the activity for the present counts.

        ``messages`` is the number so far, and ``largest_gap_s`` the longest time between two of
        them (0: unknown); they show what was usual before the first update. The last message of a
        latched topic may hold for any time.
        """
        if silence_s is None:
            return TopicActivity(rate_hz, None, False)
        usual = self._usual.setdefault(topic, _Usual())
        usual.learn(rate_hz, silence_s, messages, 0.0 if is_latched else largest_gap_s)
        return TopicActivity(rate_hz, silence_s, silence_s > usual.longest_silence_s)


class _Usual:
    """The usual rate of a topic, and the longest silence between two messages."""

    def __init__(self) -> None:
        self._rate_hz: Optional[float] = None
        self._messages = 0
        self._pause_s = self._largest_gap_s = 0.0
        self._last_silence_s = 0.0

    def learn(self, rate_hz: float, silence_s: float, messages: int,
              largest_gap_s: float) -> None:
        self._messages = max(self._messages, messages)
        self._largest_gap_s = largest_gap_s
        if silence_s < self._last_silence_s <= _MAX_PAUSE_S:  # a message has ended a silence
            self._pause_s = max(self._pause_s, self._last_silence_s)
        self._last_silence_s = silence_s
        if rate_hz > 0.0:
            before = rate_hz if self._rate_hz is None else self._rate_hz
            self._rate_hz = before + _WEIGHT * (rate_hz - before)

    @property
    def longest_silence_s(self) -> float:
        """The longest usual silence; infinite while too little is known (as for latched topics)."""
        if self._messages < _MIN_MESSAGES:
            return float('inf')
        if self._rate_hz is not None:
            return max(_MIN_SILENCE_S, _INTERVALS / self._rate_hz, _PAUSE_FACTOR * self._pause_s)
        if 0.0 < self._largest_gap_s <= _MAX_PAUSE_S:  # silence before the first update
            return max(_MIN_SILENCE_S, _INTERVALS * self._largest_gap_s)
        return float('inf')
