# SPDX-License-Identifier: BSD-3-Clause
"""Bags with many small messages: two robots with tool frames and forces, and three sensors.

838 messages a second on 9 topics; an hour is 3 million messages.
"""
from __future__ import annotations

from pathlib import Path
from typing import Tuple

from bag_maker import BagTopic, MadeBag, made_bag
from message_index import text_message
from std_msgs.msg import String


def _topic(name: str, rate_hz: int, size: int) -> BagTopic:
    return BagTopic(name, rate_hz, String, lambda index, _time_ns: text_message(index, size))


TOPICS: Tuple[BagTopic, ...] = (
    _topic('/ur_rt_upper/q_act', 125, 36), _topic('/ur_rt_upper/tcf', 125, 36),
    _topic('/ft_upper/ft', 94, 36), _topic('/ur_rt_lower/q_act', 125, 36),
    _topic('/ur_rt_lower/tcf', 125, 36), _topic('/ft_lower/ft', 94, 36),
    _topic('/edge_finder_upper', 50, 12), _topic('/edge_finder_lower', 50, 12),
    _topic('/feed_rate_est', 50, 12))


def robots_bag(folder: str, minutes: float) -> MadeBag:
    """Return the bag of this many minutes from the folder; write it if it does not exist."""
    return made_bag(Path(folder) / f'robots_{minutes:g}_min_indexed.bag', TOPICS, minutes * 60)
