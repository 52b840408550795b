# SPDX-License-Identifier: BSD-3-Clause
"""Finds topics that are silent for longer than usual, from the counts of the recorder."""
from __future__ import annotations

from typing import Dict, NamedTuple, Optional

_LEAST_SILENCE_S = 1.0
_INTERVALS = 5.0
"""A silence of this many usual intervals is unusual."""
_PAUSE_FACTOR = 2.0
_LONGEST_PAUSE_S = 10.0
"""A longer silence that ended was an outage; a shorter one may belong to the topic."""
_WEIGHT = 0.05
_LEAST_MESSAGES = 10


class TopicActivity(NamedTuple):
    """Activity of a topic: rate in Hz over the last second, silence in s (None: no message)."""

    rate_hz: float
    silence_s: Optional[float]
    is_stale: bool


class TopicWatch:
    """Learns what is usual for each topic, and finds what is not."""

    def __init__(self) -> None:
        self._usual: Dict[str, _Usual] = {}

    def update(self, topic: str, rate_hz: float, silence_s: Optional[float],
               messages: int) -> TopicActivity:
        """Judge the present counts, with the number of messages so far."""
        if silence_s is None:
            return TopicActivity(rate_hz, None, False)
        usual = self._usual.setdefault(topic, _Usual())
        usual.learn(rate_hz, silence_s, messages)
        return TopicActivity(rate_hz, silence_s, silence_s > usual.longest_silence_s)


class _Usual:
    """The usual rate of a topic, and the longest silence between two messages."""

    def __init__(self) -> None:
        self._rate_hz: Optional[float] = None
        self._messages = 0
        self._pause_s = 0.0
        self._last_silence_s = 0.0

    def learn(self, rate_hz: float, silence_s: float, messages: int) -> None:
        self._messages = max(self._messages, messages)
        if silence_s < self._last_silence_s <= _LONGEST_PAUSE_S:  # a message has ended a silence
            self._pause_s = max(self._pause_s, self._last_silence_s)
        self._last_silence_s = silence_s
        if rate_hz > 0.0:
            before = rate_hz if self._rate_hz is None else self._rate_hz
            self._rate_hz = before + _WEIGHT * (rate_hz - before)

    @property
    def longest_silence_s(self) -> float:
        """Infinite while too little is known (a latched topic sends once)."""
        if self._rate_hz is None or self._messages < _LEAST_MESSAGES:
            return float('inf')
        return max(_LEAST_SILENCE_S, _INTERVALS / self._rate_hz, _PAUSE_FACTOR * self._pause_s)
