# SPDX-License-Identifier: BSD-3-Clause
"""The summary of messages that were not played."""
from __future__ import annotations

import os

from process_visualizer.player.bag_player import play_summary, printable


def test_nothing_is_said_when_all_was_played() -> None:
    assert play_summary({}, {}, [], 0) == ()


def test_topics_problems_and_slow_subscribers() -> None:
    lines = play_summary({'/b': 2, '/a': 100}, {'/a': 300, '/b': 2}, ['a chunk is missing'], 7)
    assert lines[:3] == ('/a: 100 of 300 messages could not be played',
                         '/b: 2 of 2 messages could not be played', 'a chunk is missing')
    assert lines[3].startswith('7 messages did not reach subscribers')


def test_of_many_problems_the_first_are_told() -> None:
    lines = play_summary({}, {}, [str(number) for number in range(100)], 0)
    assert lines[:3] == ('0', '1', '2') and lines[-1] == 'and 80 more such problems'


def test_any_name_of_a_file_can_be_sent() -> None:
    assert printable('schön ✓.bag') == 'schön ✓.bag'
    printable(os.fsdecode(b'sch\xf6n.bag')).encode()
    assert printable(os.fsdecode(b'sch\xf6n.bag')) == 'sch\ufffdn.bag'
