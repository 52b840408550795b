# SPDX-License-Identifier: BSD-3-Clause
"""Complaints of a node last as long as their cause, and no longer."""
from __future__ import annotations

from typing import List, Tuple

from hypothesis import given
from hypothesis import strategies as st
from simulated_node import SimulatedNode

from process_visualizer.nodes.common.complaints import HOLD_S, ComplaintBook, Complaints

MESSAGES = st.lists(st.tuples(st.floats(0.001, 5.0), st.booleans()), min_size=1, max_size=40)
"""Interval of each message after the previous one [s], and whether it is good."""


def test_counts_what_is_left_out_since_it_began() -> None:
    book = ComplaintBook()
    for now_s in (1.0, 1.1, 1.2):
        book.add('/tcf', f'a message at {now_s}', now_s)
    complaint = book.present(1.3)['/tcf']
    assert (complaint.count, complaint.since_s, complaint.text) == (3, 1.0, 'a message at 1.2')


def test_a_last_message_that_was_bad_stays() -> None:
    book = ComplaintBook()
    book.note_good('/tcf', 0.5)
    book.add('/tcf', 'zero', 1.0)
    assert '/tcf' in book.present(1000.0)


def test_what_is_mended_is_told_once() -> None:
    book = ComplaintBook()
    book.state('frame', 'not in tf', 1.0, {'frame': 'a'})
    assert dict(book.present(2.0)['frame'].values) == {'frame': 'a'}
    book.end('frame')
    book.end('frame')
    assert (book.present(2.1), list(book.take_ended()), book.take_ended()) == ({}, ['frame'], {})


def test_what_begins_again_has_not_ended() -> None:
    book = ComplaintBook()
    book.state('frame', 'not in tf', 1.0)
    book.end('frame')
    book.state('frame', 'not in tf', 2.0)
    assert (list(book.present(2.0)), book.take_ended()) == (['frame'], {})


@given(MESSAGES)
def test_a_complaint_stands_until_good_messages_come_for_some_time(
        messages: List[Tuple[float, bool]]) -> None:
    book, now_s, bad_s, good_since_bad = ComplaintBook(), 0.0, None, False
    for after_s, is_good in messages:
        now_s += after_s
        if is_good:
            book.note_good('/tcf', now_s)
            good_since_bad = True
        else:
            book.add('/tcf', 'bad', now_s)
            bad_s, good_since_bad = now_s, False
        holds = bad_s is not None and not (good_since_bad and now_s - bad_s > HOLD_S)
        assert ('/tcf' in book.present(now_s)) == holds
        if not holds:
            bad_s = None


def test_the_log_tells_that_a_complaint_is_over() -> None:
    node = SimulatedNode()
    complaints = Complaints(node, 'robot')
    complaints.state('frame', 'frame a is not in tf')
    node.advance(2.0)
    complaints.end('frame')
    node.advance(1.0)
    assert node.log == [('warn', 'robot: frame a is not in tf'),
                        ('info', 'robot: frame a is not in tf: over after 2.0 s')]
