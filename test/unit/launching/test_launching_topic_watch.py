# SPDX-License-Identifier: BSD-3-Clause
"""Unusually long silence of a topic."""
from __future__ import annotations

import pytest

from process_visualizer.health.topic_silence import TopicWatch

TOPIC = '/arm/joints'


def silent_for(watch: TopicWatch, rate_hz: float, silence_s: float) -> bool:
    """Let a topic send for a while, then fall silent."""
    for _ in range(50):
        watch.update(TOPIC, rate_hz, 0.5 / rate_hz, 50)
    return watch.update(TOPIC, 0.0, silence_s, 50).is_silent


@pytest.mark.parametrize('rate_hz, silence_s, is_silent', [
    (125.0, 0.5, False), (125.0, 1.1, True), (1.0, 4.0, False), (1.0, 6.0, True)])
def test_silence_is_measured_by_the_usual_rate(rate_hz: float, silence_s: float,
                                               is_silent: bool) -> None:
    assert silent_for(TopicWatch(), rate_hz, silence_s) is is_silent


def test_topic_without_a_message_is_not_silent() -> None:
    activity = TopicWatch().update(TOPIC, 0.0, None, 0)
    assert activity.silence_s is None
    assert not activity.is_silent


def test_topic_that_sends_once_is_never_silent() -> None:
    watch = TopicWatch()
    watch.update(TOPIC, 1.0, 0.1, 1)
    assert not watch.update(TOPIC, 0.0, 3600.0, 1).is_silent


def test_topic_that_pauses_now_and_then_may_do_so() -> None:
    watch = TopicWatch()
    assert silent_for(watch, 50.0, 3.0)
    watch.update(TOPIC, 50.0, 0.01, 60)
    assert not watch.update(TOPIC, 0.0, 5.0, 60).is_silent
    assert watch.update(TOPIC, 0.0, 6.5, 60).is_silent


def test_an_outage_is_not_learned_as_a_pause() -> None:
    watch = TopicWatch()
    assert silent_for(watch, 50.0, 60.0)
    watch.update(TOPIC, 50.0, 0.01, 60)
    assert watch.update(TOPIC, 0.0, 2.0, 60).is_silent


@pytest.mark.parametrize('messages, largest_gap_s, silence_s, is_silent', [
    (500, 0.05, 0.9, False), (500, 0.05, 1.1, True), (500, 3.0, 14.0, False),
    (500, 3.0, 16.0, True), (500, 60.0, 900.0, False), (5, 0.05, 900.0, False),
    (500, 0.0, 900.0, False)])
def test_silence_that_began_before_the_first_look(
        messages: int, largest_gap_s: float, silence_s: float, is_silent: bool) -> None:
    activity = TopicWatch().update(TOPIC, 0.0, silence_s, messages, largest_gap_s)
    assert activity.is_silent is is_silent


def test_a_latched_topic_may_have_been_silent_for_long() -> None:
    assert not TopicWatch().update(TOPIC, 0.0, 900.0, 500, 0.05, is_latched=True).is_silent
