# SPDX-License-Identifier: BSD-3-Clause
"""Messages to viewers of a live page: the newest of each kind, as fast as each can receive."""
from __future__ import annotations

from typing import List, Optional

import pytest
from live_frame_reader import frames_behind_lengths

from process_visualizer.page.live_feed import (
    MAX_RECENT,
    Admission,
    LiveFeed,
    Message,
    Slot,
    ViewerPace,
)

TOKEN = 'aVeryLongToken'
FRAME_BYTES = 800


def all_of(pace: ViewerPace, now_s: float) -> List[Optional[Message]]:
    found = []
    while True:
        found.append(pace.next(now_s))
        if found[-1] is None:
            return found[:-1]


def test_a_viewer_gets_each_message_once_and_the_layout_first() -> None:
    feed = LiveFeed()
    feed.put(Slot.LANES, b'lanes')
    feed.put_frame(1.0, 1, b'frame')
    feed.put(Slot.LAYOUT, 'layout')
    feed.put(Slot.STATE, 'state')
    first, second = ViewerPace(feed, 0.0), ViewerPace(feed, 0.0)
    assert all_of(first, 0.0) == ['layout', 'state', b'frame', b'lanes']
    feed.put(Slot.STATE, 'state')
    assert all_of(first, 0.0) == []
    assert len(all_of(second, 0.0)) == 4


def frame(number: int) -> bytes:
    return b'%9d' % number + bytes(FRAME_BYTES - 9)


def test_a_viewer_that_does_not_answer_gets_nothing_more_and_then_only_the_newest() -> None:
    feed = LiveFeed()
    quick, slow = ViewerPace(feed, 0.0), ViewerPace(feed, 0.0)
    had = []
    for number in range(100):
        now_s = 0.04 * number
        feed.put_frame(now_s, 1, frame(number))
        assert all_of(quick, now_s) == [frame(number)]
        quick.answered(number + 1, now_s)
        had += all_of(slow, now_s)
    assert had == [frame(number) for number in range(5)]
    assert slow.answered(5, 4.0)
    assert all_of(slow, 4.0) == [frame(99)]


class Link:
    """Link with a delay in each direction [s] and a rate [bytes/s]."""

    def __init__(self, delay_s: float, bytes_s: float) -> None:
        self._delay_s, self._bytes_s, self._free_s = delay_s, bytes_s, 0.0

    def ages_s(self, seconds: float) -> List[float]:
        """The age of frames on arrival; 25 are made per second."""
        feed, ages_s, answers = LiveFeed(), [], []
        pace = ViewerPace(feed, 0.0)
        for step in range(round(seconds / 0.01)):
            now_s = 0.01 * step
            if step % 4 == 0:
                feed.put_frame(now_s, 1, frame(step))
            while answers and answers[0] <= now_s:
                answers.pop(0)
                pace.answered(len(ages_s) - len(answers), now_s)
            message = pace.next(now_s)
            if isinstance(message, bytes):
                self._free_s = max(self._free_s, now_s) + FRAME_BYTES / self._bytes_s
                come_s = self._free_s + self._delay_s
                ages_s.append(come_s - 0.01 * int(message[:9]))
                answers.append(come_s + self._delay_s)
        return ages_s


@pytest.mark.parametrize(('delay_s', 'bytes_s', 'least_hz'), [
    (0.0, 1e6, 24), (0.1, 125e3, 24), (0.2, 125e3, 22), (0.1, 10e3, 9), (0.1, 4e3, 3),
    (0.02, 4e3, 4), (0.4, 125e3, 2)])
def test_on_any_link_frames_come_as_often_as_it_carries_them_and_are_never_old(
        delay_s: float, bytes_s: float, least_hz: float) -> None:
    ages_s = Link(delay_s, bytes_s).ages_s(120.0)
    assert len(ages_s) >= 120.0 * least_hz
    assert max(ages_s[20:]) < 0.55 + 2.0 * FRAME_BYTES / bytes_s


def test_a_slow_link_starves_no_kind_of_message() -> None:
    feed = LiveFeed()
    pace = ViewerPace(feed, 0.0)
    had = []
    for number in range(40):
        feed.put_frame(number, 1, b'f%d' % number)
        feed.put(Slot.LANES, b'l%d' % number)
        feed.put(Slot.STATE, f's{number}')
        had.append(pace.next(number))
        pace.answered(number + 1, number + 0.9)
    kinds = [it[:1] if isinstance(it, bytes) else it[:1].encode() for it in had if it]
    assert [kinds.count(it) for it in (b'f', b'l', b's')] == [13, 13, 14]


def test_clouds_come_to_those_who_want_them_and_take_a_quarter_of_the_time() -> None:
    feed = LiveFeed()
    feed.put(Slot.CLOUD, b'c0')
    plain, eager = ViewerPace(feed, 0.0), ViewerPace(feed, 0.0, has_clouds=True)
    assert all_of(plain, 0.0) == []
    assert all_of(eager, 0.0) == [b'c0']
    feed.put(Slot.CLOUD, b'c1')
    assert all_of(eager, 0.1) == []
    eager.answered(1, 0.2)
    assert all_of(eager, 0.7) == []
    assert all_of(eager, 0.81) == [b'c1']


def test_a_viewer_that_never_answers_is_gone_and_one_that_does_is_not() -> None:
    feed = LiveFeed()
    gone, there = ViewerPace(feed, 0.0), ViewerPace(feed, 0.0)
    for number in range(300):
        now_s = 0.1 * number
        feed.put_frame(now_s, 1, b'%d' % number)
        all_of(gone, now_s)
        all_of(there, now_s)
        there.answered(number + 1, now_s)
        assert not there.is_gone(now_s)
    assert gone.is_gone(30.0)
    assert not gone.is_gone(10.0)
    assert gone.is_gone(10.0, is_awaited=True)
    assert not there.is_gone(now_s, is_awaited=True)


@pytest.mark.parametrize('count', [-1, 0, 2, 10 ** 30])
def test_an_answer_to_what_was_not_sent_is_refused(count: int) -> None:
    feed = LiveFeed()
    feed.put(Slot.STATE, 'state')
    pace = ViewerPace(feed, 0.0)
    all_of(pace, 0.0)
    assert not pace.answered(count, 0.0)
    assert pace.answered(1, 0.0)
    assert not pace.answered(1, 0.0), 'it can say no more than it is sent'


def test_the_past_is_what_was_kept_between_two_times_of_the_present_layout() -> None:
    feed = LiveFeed(memory_s=10.0)
    for number in range(200):
        feed.put_frame(0.1 * number, 1 if number < 150 else 2, b'%d' % number)
    assert frames_behind_lengths(feed.recent(16.05, 16.45)) == [b'161', b'162', b'163', b'164']
    assert frames_behind_lengths(feed.recent(0.0, 100.0))[0] == b'150'
    assert feed.recent(5.0, 1.0) == b''


def test_a_long_past_is_thinned() -> None:
    feed = LiveFeed(memory_s=1000.0)
    for number in range(2 * MAX_RECENT + 1):
        feed.put_frame(0.1 * number, 1, b'%d' % number)
    found = [int(it) for it in frames_behind_lengths(feed.recent(-1.0, 1e9))]
    assert len(found) <= MAX_RECENT
    assert found == list(range(0, 2 * MAX_RECENT + 1, 3))


@pytest.mark.parametrize('host', ['localhost:1', '127.0.0.1:8080', '[::1]:11480', 'localhost'])
def test_this_computer_needs_no_token(host: str) -> None:
    admission = Admission('')
    assert admission.refusal('/', host, None, False) is None
    assert admission.refusal('/live', host, f'http://{host}', True) is None
    assert admission.asked('/page.js') == 'page.js'


@pytest.mark.parametrize('host', ['evil.example', '127.0.0.1.evil.example', '192.168.1.2:11480',
                                  '', '[', 'localhost@evil.example'])
def test_without_a_token_no_other_name_leads_here(host: str) -> None:
    refusal = Admission('').refusal('/', host, None, False)
    assert refusal is not None
    assert refusal.status == 403


@pytest.mark.parametrize('path', ['/', '/page.js', '/aVeryLongTokem/', f'/{TOKEN}', f'//{TOKEN}/',
                                  f'/{TOKEN}x/', f'/{TOKEN.lower()}/', '/ä/', '/\udcff/'])
def test_a_wrong_token_opens_nothing(path: str) -> None:
    admission = Admission(TOKEN)
    assert admission.asked(path) is None
    refusal = admission.refusal(path, 'cell-pc:11480', None, False)
    assert refusal is not None
    assert TOKEN not in refusal.text


def test_the_right_token_opens_the_page_by_any_name() -> None:
    admission = Admission(TOKEN)
    assert admission.path() == f'/{TOKEN}/'
    assert admission.asked(f'/{TOKEN}/') == ''
    assert admission.asked(f'/{TOKEN}/live') == 'live'
    assert admission.refusal(f'/{TOKEN}/', 'cell-pc:11480', None, False) is None


@pytest.mark.parametrize('origin', [None, 'null', 'http://evil.example', 'http://localhost:1',
                                    'file://', 'http://[', 'ftp://localhost:11480'])
def test_a_socket_for_another_page_is_refused(origin: Optional[str]) -> None:
    assert Admission('').refusal('/live', 'localhost:11480', origin, True) is not None


def test_another_page_cannot_read_files_either() -> None:
    assert Admission('').refusal('/model', 'localhost:11480', 'http://evil.example',
                                 False) is not None
