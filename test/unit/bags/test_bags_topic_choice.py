# SPDX-License-Identifier: BSD-3-Clause
"""The played topics and their names."""
import fnmatch
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.playback.topic_choice import TopicChoice, checked_prefix, resolved_name

TOPICS = ['/camera/depth/image', '/camera/rgb/image', '/robot/joint_states', '/tf', '/tf_static']
NAMES = st.lists(st.from_regex(r'[A-Za-z][A-Za-z0-9_]{0,4}', fullmatch=True), min_size=1,
                 max_size=3).map(lambda parts: '/' + '/'.join(parts))


def chosen(**arguments):
    choice = TopicChoice(**arguments)
    return [topic for topic in TOPICS if choice.published_name(topic) is not None]


def test_everything_without_a_choice():
    assert [TopicChoice().published_name(topic) for topic in TOPICS] == TOPICS


@pytest.mark.parametrize('include, count', [
    (['/tf'], 1), (['tf'], 1), (['/tf/'], 1), (['//tf'], 1), (['/tf*'], 2), (['/camera/*'], 2),
    (['camera/*'], 2), (['*/image'], 2), (['*image'], 2), (['/*/image'], 2),
    (['/camera/[dr]*/image'], 2), (['/t?'], 1), (['/tf', '/robot/*'], 2), (['*'], 5),
    (['/camera'], 0), (['/TF'], 0), (['image'], 0)])
def test_included(include, count):
    assert len(chosen(include=include)) == count


def test_excluded_wins():
    assert chosen(include=['/camera/*'], exclude=['*/depth/*']) == ['/camera/rgb/image']
    assert chosen(exclude=['/camera/*', '/tf']) == ['/robot/joint_states', '/tf_static']


@pytest.mark.parametrize('prefix', ['old', '/old', '/old/', 'old/', '//old'])
def test_prefix(prefix):
    assert TopicChoice(prefix=prefix).published_name('/tf') == '/old/tf'


@pytest.mark.parametrize('prefix', ['', '/'])
def test_no_prefix(prefix):
    assert TopicChoice(prefix=prefix).published_name('/tf') == '/tf'


def test_remapped_and_then_prefixed():
    choice = TopicChoice(remap={'/tf': '/transforms', 'robot/joint_states': 'joints'}, prefix='p')
    assert choice.published_name('/tf') == '/p/transforms'
    assert choice.published_name('/tf_static') == '/p/tf_static'
    assert choice.published_name('/robot/joint_states') == '/p/joints'


def test_names_are_swapped_not_chained():
    choice = TopicChoice(remap={'/a': '/b', '/b': '/a'})
    assert (choice.published_name('/a'), choice.published_name('/b')) == ('/b', '/a')


def test_choice_is_made_by_the_recorded_name():
    choice = TopicChoice(include=['/tf'], remap={'/tf': '/other'})
    assert choice.published_name('/tf') == '/other'


def test_recorded_name_without_a_slash_is_global():
    assert TopicChoice(include=['/tf']).published_name('tf') == '/tf'


@given(st.lists(NAMES), st.lists(NAMES), NAMES, st.dictionaries(NAMES, NAMES), NAMES)
def test_names_by_definition(include, exclude, prefix, remap, topic):
    name = TopicChoice(include, exclude, prefix, remap).published_name(topic)
    if (include and topic not in include) or topic in exclude:
        assert name is None
    else:
        assert name == prefix + remap.get(topic, topic)


@given(st.text('ab*?[]!-/', max_size=8), NAMES)
def test_patterns_are_those_of_the_shell(pattern, topic):
    globbed = '/' + '/'.join(part for part in pattern.split('/') if part)
    if pattern[:1] in ('*', '?', '['):
        globbed = globbed[1:]
    try:
        expected = fnmatch.fnmatchcase(topic, globbed)
    except re.error:
        with pytest.raises(ValueError, match='is not a pattern'):
            TopicChoice([pattern])
    else:
        assert (TopicChoice([pattern]).published_name(topic) is not None) == expected


@pytest.mark.parametrize('name', ['', '/', '//', 'a b', '/a-b', '1a', '_a', '~a', '/a\n', 'é',
                                  'a.b'])
def test_names_against_the_rules(name):
    with pytest.raises(ValueError, match='not a valid topic name'):
        resolved_name(name)
    with pytest.raises(ValueError, match='not a valid topic name'):
        TopicChoice(remap={'/tf': name})
    with pytest.raises(ValueError, match='not a valid topic name'):
        TopicChoice(remap={name: '/tf'})
    if name.strip('/'):
        with pytest.raises(ValueError, match='not a valid topic name'):
            checked_prefix(name)
        with pytest.raises(ValueError, match='not a valid topic name'):
            TopicChoice(prefix=name)


def test_recorded_name_against_the_rules():
    with pytest.raises(ValueError, match='"/a b" is not a valid topic name.*; exclude it'):
        TopicChoice().published_name('/a b')
    assert TopicChoice(exclude=['/a b']).published_name('/a b') is None
    assert TopicChoice(include=['/tf']).published_name('/a b') is None


@pytest.mark.parametrize('name, namespace, resolved', [
    ('a', '/', '/a'), ('a', '/ns/', '/ns/a'), ('a/b/', '/ns', '/ns/a/b'), ('/a', '/ns/', '/a'),
    ('/2d/scan', '/', '/2d/scan'), ('/_hidden', '/', '/_hidden')])
def test_names_are_resolved(name, namespace, resolved):
    assert resolved_name(name, namespace) == resolved


def test_unmatched_names_come_as_they_were_given():
    choice = TopicChoice(['/tf', 'camra/*', '/camera/*'], ['odom', '/tf_static'])
    assert choice.unmatched(TOPICS) == ['camra/*', 'odom']
    assert TopicChoice().unmatched(TOPICS) == []
    assert TopicChoice(['*']).unmatched([]) == ['*']


def test_unmatched_messages_say_what_to_write():
    choice = TopicChoice(['/robot/joint_state'], ['/weather'])
    near, far = choice.unmatched_messages(TOPICS)
    assert near == ('no topic of the recording fits "/robot/joint_state"; '
                    'did you mean "/robot/joint_states"?')
    assert far.startswith(
        'no topic of the recording fits "/weather"; expected one of: /camera/depth')


def test_unmatched_message_is_short():
    message, = TopicChoice(['/weather']).unmatched_messages([f'/x{i}/y' for i in range(10000)])
    assert len(message) < 300
    message, = TopicChoice(['/weather']).unmatched_messages([])
    assert message.endswith('expected one of: none')


def test_names_that_are_asked_for_whether_or_not_the_recording_has_them():
    choice = TopicChoice(['/a', 'b', '/camera/*', '/c'], ['/c'], '/recorded', {'/b': '/d'})
    assert choice.named() == ['/recorded/a', '/recorded/d']
