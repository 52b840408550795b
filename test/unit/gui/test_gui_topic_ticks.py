# SPDX-License-Identifier: BSD-3-Clause
"""The ticked topics, and their displayed state."""
from __future__ import annotations

from dataclasses import replace

import pytest
from recording_stand_in import HERE, devices, seen

from process_visualizer.cell.model import SoughtObjects
from process_visualizer.gui.recording.recording_choices import TopicHealth, TopicTicks
from process_visualizer.gui.recording.topic_list import rate_or_silence


@pytest.fixture
def ticks() -> TopicTicks:
    them = TopicTicks()
    them.set_devices(devices())
    return them


def health(ticks: TopicTicks) -> TopicHealth:
    return ticks.rows()[0].health


def test_the_configuration_presets(ticks):
    assert ticks.ticked() == ('/robot/q_act', '/robot/tcf', '/kinect/image')
    assert [row.device for row in ticks.rows()] == ['robot', 'robot', 'kinect', 'kinect']


def test_a_tick_stays_when_the_devices_change(ticks):
    ticks.tick('/kinect/points', True)
    ticks.set_devices(devices()[:1])
    assert ticks.ticked() == ('/robot/q_act', '/robot/tcf')
    ticks.set_devices(devices())
    assert '/kinect/points' in ticks.ticked()
    ticks.preset()
    assert '/kinect/points' not in ticks.ticked()


def test_a_topic_of_two_devices_is_there_once(ticks):
    ticks.set_devices([*devices(), *devices()])
    assert len(ticks.rows()) == 4


def test_objects_are_recorded_unless_the_operator_unticks_them(ticks):
    sought = SoughtObjects(0.5, 0.2, 0.03, 0.5, None, None, (), HERE)
    ticks.set_devices([*devices()[:1], replace(devices()[1], objects=sought)])
    assert [row.device for row in ticks.rows() if row.name == '/kinect/objects'] == ['kinect']
    assert '/kinect/objects' in ticks.ticked()
    ticks.tick('/kinect/objects', False)
    assert '/kinect/objects' not in ticks.ticked()


def test_health(ticks):
    assert health(ticks) is TopicHealth.UNKNOWN
    ticks.take([seen('/robot/q_act')])
    assert health(ticks) is TopicHealth.GOOD and ticks.rows()[0].rate_hz == 125.0
    ticks.take([seen('/robot/q_act', rate_hz=0.0, silence_s=1.5)])
    assert health(ticks) is TopicHealth.SILENT
    ticks.take([seen('/robot/q_act', publishers=0)])
    assert health(ticks) is TopicHealth.NO_PUBLISHER
    ticks.take([seen('/robot/q_act', silence_s=None, messages=0, rate_hz=0.0)])
    assert health(ticks) is TopicHealth.NO_MESSAGE


def test_a_latched_topic_has_no_rate_while_it_rests(ticks):
    for rate_hz, text in ((0.0, 'latched'), (2.0, '2.0\u2009Hz')):
        ticks.take([seen('/robot/q_act', rate_hz, 20.0, messages=1, is_latched=True)])
        assert rate_or_silence(ticks.rows()[0]) == text
    ticks.take([seen('/robot/q_act', 0.0, None, messages=0, publishers=0)])
    assert rate_or_silence(ticks.rows()[0]) == 'no publisher'


def test_what_is_slow_or_was_latched_is_not_silent(ticks):
    ticks.take([seen('/robot/q_act', rate_hz=0.5, silence_s=2.0)])
    assert health(ticks) is TopicHealth.GOOD
    ticks.take([])
    ticks.take([seen('/robot/q_act', rate_hz=1.0, silence_s=0.1, messages=1)])
    ticks.take([seen('/robot/q_act', rate_hz=0.0, silence_s=60.0, messages=1)])
    assert health(ticks) is TopicHealth.GOOD


def test_ticks_are_those_of_the_last_session(ticks: TopicTicks) -> None:
    ticks.tick('/kinect/image', False)
    ticks.tick('/robot/q_act', True)  # as in the configuration
    assert ticks.changed == {'/kinect/image': False}
    later = TopicTicks()
    later.restore(ticks.changed)
    later.set_devices(devices())
    assert later.ticked() == ('/robot/q_act', '/robot/tcf')


def test_what_is_not_recorded_does_not_count_as_coming_in(ticks: TopicTicks) -> None:
    """Images that were not ticked made it half an hour until the disk is full, not four days."""
    image = seen('/kinect/image', 30.0)._replace(bytes=1000 * 614_400)
    ticks.take([seen('/robot/q_act'), image, seen('/other', 1.0)])
    assert ticks.ticked_share() == pytest.approx(1.0)
    ticks.tick('/kinect/image', False)
    assert ticks.ticked_share() == pytest.approx(126.0 * 60.0 / (126.0 * 60.0 + 30.0 * 614_400.0))
