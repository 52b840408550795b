# SPDX-License-Identifier: BSD-3-Clause
"""The command line of the player."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.playback.timeline import MAX_REQUESTED_RATE
from process_visualizer.player.player_options import (
    PlayerOptions,
    parse_options,
    topic_remaps,
    without_topic_remaps,
)

BAG = 'some.bag'
SECONDS = st.floats(0.001, 1e6).map(lambda value: round(value, 3))


def refused(capsys, *arguments):
    """The message with which a command line is refused."""
    with pytest.raises(SystemExit) as exit_info:
        parse_options(arguments)
    assert exit_info.value.code == 2
    printed = capsys.readouterr()
    assert printed.out == ''
    return printed.err.splitlines()[-1]


def test_defaults_are_those_of_rosbag_play():
    assert parse_options([BAG]) == PlayerOptions(
        files=(BAG,), rate=1.0, start_s=None, duration_s=None, loop=False, paused=False,
        delay_s=0.2, wait_for_subscribers=False, keep_alive=False, topics=(), exclude=(), prefix='',
        skip_empty_s=None, pause_topics=(), rate_control_topic='', rate_control_max_delay_s=1.0,
        recorded_stamps=False, clock=False, clock_hz=100.0,
        queue_size=100, quiet=False, reindex=False, pauses_beside_others=False)


@pytest.mark.parametrize('arguments, field, value', [
    ('-r 2', 'rate', 2.0), ('-r2', 'rate', 2.0), ('--rate=0.5', 'rate', 0.5),
    ('-r -2', 'rate', -2.0), ('-r -.5', 'rate', -0.5), ('-r-16', 'rate', -16.0),
    ('--rate -0.01', 'rate', -0.01), ('-r 100', 'rate', 100.0), ('-r 0.001', 'rate', 0.001),
    ('-i', 'rate', MAX_REQUESTED_RATE), ('--immediate -r 2', 'rate', MAX_REQUESTED_RATE),
    ('-i -r -1', 'rate', -MAX_REQUESTED_RATE), ('--rate -0.5 -i', 'rate', -MAX_REQUESTED_RATE),
    ('--others pause', 'pauses_beside_others', True),
    ('--others warn', 'pauses_beside_others', False),
    ('-s 3', 'start_s', 3.0), ('--start 0', 'start_s', 0.0), ('--start=1.5', 'start_s', 1.5),
    ('-u 3', 'duration_s', 3.0), ('--duration 0.1', 'duration_s', 0.1),
    ('--dur 3', 'duration_s', 3.0),
    ('-l', 'loop', True), ('--loop', 'loop', True), ('--pause', 'paused', True),
    ('-d 0', 'delay_s', 0.0), ('--delay 2', 'delay_s', 2.0),
    ('--wait-for-subscribers', 'wait_for_subscribers', True),
    ('-k', 'keep_alive', True), ('--keep-alive', 'keep_alive', True),
    ('--topics /a b/*', 'topics', ('/a', 'b/*')),
    ('--topics /a --topics /b', 'topics', ('/a', '/b')),
    ('--exclude /a', 'exclude', ('/a',)),
    ('--skip-empty 2', 'skip_empty_s', 2.0), ('--pause-topics /a b', 'pause_topics', ('/a', '/b')),
    ('--rate-control-topic done', 'rate_control_topic', '/done'),
    ('--rate-control-max-delay 0.2', 'rate_control_max_delay_s', 0.2),
    ('-p old', 'prefix', '/old'), ('--prefix=/old', 'prefix', '/old'), ('-p /', 'prefix', ''),
    ('--clock', 'clock', True), ('--hz 200', 'clock_hz', 200.0),
    ('--hz 0.5', 'clock_hz', 0.5), ('--queue 0', 'queue_size', 0),
    ('--queue 10', 'queue_size', 10), ('--queue=10', 'queue_size', 10),
    ('-q', 'quiet', True), ('--quiet', 'quiet', True), ('--reindex', 'reindex', True),
])
def test_option(arguments, field, value):
    assert getattr(parse_options([BAG, *arguments.split()]), field) == value
    assert parse_options([BAG, *arguments.split()]).files == (BAG,)


@pytest.mark.parametrize('arguments, recorded', [
    ('', False), ('--clock', True), ('--stamps present', False), ('--stamps recorded', True),
    ('--clock --stamps present', False), ('--clock --stamps recorded', True)])
def test_stamps_are_recorded_with_a_clock_unless_said_otherwise(arguments, recorded):
    assert parse_options([BAG, *arguments.split()]).recorded_stamps is recorded


@pytest.mark.parametrize('arguments', [
    'a b c', 'a -r 2 b -l c', '-l a b c', '-r 2 -q a b c', '--topics /x --bags a b c',
    'a --bags b c --topics /x', '--topics /x --bags=a --loop b c', 'a --bags=b --bags=c',
    '--topics /x -- a b c'])
def test_files_may_stand_anywhere(arguments):
    assert sorted(parse_options(arguments.split()).files) == ['a', 'b', 'c']


def test_files_keep_their_order():
    assert parse_options('z y -r 2 x --bags w v'.split()).files == ('z', 'y', 'x', 'w', 'v')


@given(st.floats(0.01, 16), st.booleans(), SECONDS, SECONDS)
def test_numbers_are_taken_exactly(rate, backwards, start_s, duration_s):
    rate = round(-rate if backwards else rate, 4)
    options = parse_options(['-r', f'{rate:f}', BAG, f'-s{start_s}'])
    assert (options.rate, options.start_s, options.duration_s) == (rate, start_s, None)
    assert parse_options([BAG, '-u', str(duration_s)]).duration_s == duration_s


@pytest.mark.parametrize('arguments, message', [
    ('-r 0', 'argument -r/--rate: the rate must not be 0: pause instead'),
    ('-r nan', '"nan" is not a finite number'), ('-r inf', '"inf" is not a finite number'),
    ('-r fast', '"fast" is not a number'), ('-r 2e6', 'the rate must be from 1e-06 to 1e+06'),
    ('-r -2000000', 'the rate must be from'), ('-r 1e-7', 'the rate must be from'),
    ('-s -1', 'argument -s/--start: must be from 0 to 1000000000 s, not -1'),
    ('-s 1e10', 'must be from 0 to'), ('-s nan', 'finite'), ('-s x', 'not a number'),
    ('-u 5 -r -1', 'only for playing forwards'),
    ('-u 0', 'argument -u/--duration: must be more than 0'), ('-u -2', 'must be more than 0'),
    ('-d -1', 'must be from 0 to'), ('--skip-empty -2', 'must be from 0 to'),
    ('--hz 0', 'must be more than 0 and at most 10000 Hz, not 0'), ('--hz 5e4', 'at most 10000'),
    ('--queue 1.5', 'must be a whole number from 0'),
    ('--queue -1', 'must be a whole number'), ('--queue 1e300', 'must be a whole number'),
    ('-p a-b', 'argument -p/--prefix: "a-b" is not a valid topic name'),
    ('--stamps old', 'invalid choice'), ('--no-such', 'unrecognized arguments: --no-such'),
    ('--try-future-version', 'not offered'), ('--rate-control-topic a-b', 'not a valid topic name'),
    ('--rate-control-max-delay -1', 'must be from 0 to'), ('--pause-topics /a-b', 'not a valid'),
])
def test_wrong_command_line(capsys, arguments, message):
    assert message in refused(capsys, BAG, *arguments.split())
    assert message in refused(capsys, *arguments.split(), '--loop', BAG)


def test_no_bag(capsys):
    assert refused(capsys) == 'bag_player: error: no bag is given; name one or more files'
    assert refused(capsys, '--topics', '/a', BAG).endswith(
        'name one or more files, before --topics and --exclude or after --bags')


def test_help_fits_a_terminal(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    with pytest.raises(SystemExit) as exit_info:
        parse_options(['--help'])
    assert exit_info.value.code == 0
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    assert 'pause or play' in printed


def test_topic_remaps():
    arguments = ['/opt/bag_player', 'a.bag', '/tf:=/old/tf', 'image:=depth/', '__name:=player',
                 '_rate:=2', '~state:=/state', '__ns:=/x', '-r', '2', '/tf:=/older/tf']
    assert topic_remaps(arguments) == {'/tf': '/older/tf', '/image': '/depth'}
    assert topic_remaps(arguments, '/cell/') == {'/tf': '/older/tf', '/cell/image': '/cell/depth'}
    assert topic_remaps([]) == {}
    assert without_topic_remaps(arguments) == [
        '/opt/bag_player', 'a.bag', '__name:=player', '_rate:=2', '~state:=/state', '__ns:=/x',
        '-r', '2']


@pytest.mark.parametrize('remap', ['/tf:=', '/tf:=a b', '/tf:=~a', 'tf:=/a:=/b', '/:=/a'])
def test_wrong_remap(remap):
    with pytest.raises(ValueError, match='not a valid topic name'):
        topic_remaps([remap])
