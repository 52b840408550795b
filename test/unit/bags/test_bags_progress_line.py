# SPDX-License-Identifier: BSD-3-Clause
"""The progress line of the player."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.figures import clock_text
from process_visualizer.playback.player_control import PlayerStatus
from process_visualizer.player.player_terminal import ASCII, UNICODE, progress_line, symbols_for

PLAYING = PlayerStatus(
    position_s=12.345, duration_s=62.0, rate=1.0, achieved_rate=1.0, paused=False
)
RATES = st.one_of(st.floats(0.01, 16.0), st.floats(-16.0, -0.01))
TIMES = st.floats(0.0, 1e6)
PROGRESSES = st.builds(PlayerStatus, TIMES, TIMES, RATES, st.floats(-16.0, 16.0), st.booleans(),
                       st.one_of(st.none(), st.tuples(TIMES, TIMES)), st.integers(0, 10 ** 12),
                       st.text())


@pytest.mark.parametrize('seconds, text', [
    (0.0, '0:00.000'), (12.345, '0:12.345'), (59.9996, '1:00.000'), (62.0, '1:02.000'),
    (3599.9994, '59:59.999'), (3600.0, '1:00:00.000'), (36061.5, '10:01:01.500'),
    (-1.5, '-0:01.500'), (-0.0001, '0:00.000')])
def test_time(seconds, text):
    assert clock_text(seconds, 3) == text


@given(st.floats(-1e6, 1e6))
def test_time_can_be_read_back(seconds):
    text = clock_text(seconds, 3)
    value = 0.0
    for part in text.lstrip('-').split(':'):
        value = value * 60 + float(part)
    assert (-value if text.startswith('-') else value) == pytest.approx(seconds, abs=0.000501)


def line_of(width=80, symbols=UNICODE, **changes):
    return progress_line(PLAYING._replace(**changes), width, symbols)


def test_playing():
    assert line_of() == f' ▶ 0:12.345 / 1:02.000  1×  [{"#" * 8}{"-" * 32}]'


def test_backwards():
    assert line_of(rate=-2.0, achieved_rate=-2.0).startswith(' ◀ 0:12.345 / 1:02.000  -2×  [')


def test_paused():
    assert line_of(paused=True, achieved_rate=0.0).startswith(' ⏸ 0:12.345 / 1:02.000  1×  [')


def test_ascii():
    assert line_of(symbols=ASCII).startswith(' >  0:12.345 / 1:02.000  1x  [')
    assert line_of(symbols=ASCII, rate=-0.25, achieved_rate=-0.25).startswith(' <  0:12.345')
    assert line_of(symbols=ASCII, paused=True).startswith(' || 0:12.345')


@pytest.mark.parametrize('rate, achieved, text', [
    (2.0, 1.4, '2× (1.4× reached)'), (-2.0, -1.4, '-2× (-1.4× reached)'),
    (1.0, 0.0, '1× (0× reached)'), (-1.0, -0.0, '-1× (0× reached)'),
    (0.01, 0.005, '0.01× (0.005× reached)')])
def test_slow_down_is_told(rate, achieved, text):
    assert f'  {text}  [' in line_of(rate=rate, achieved_rate=achieved)


def test_slight_slow_down_is_not_told():
    assert 'reached' not in line_of(achieved_rate=0.96)
    assert 'reached' not in line_of(paused=True, achieved_rate=0.0)


def test_dropped_messages_are_told():
    assert '  1×  7 dropped  [' in line_of(dropped=7)
    assert 'dropped' not in line_of()


def test_the_last_mark_is_told():
    assert '  1×  "Naht reißt"  [' in line_of(mark='Naht reißt')
    assert '  1x  "Naht rei?t"  [' in line_of(mark='Naht reißt', symbols=ASCII)
    assert '  1×  "a b?" ' in line_of(mark='a\nb縫')


def test_loop_is_marked():
    line = line_of(position_s=31.0, loop=(0.0, 62.0))
    assert line.endswith(f'[A{"#" * 19}{"-" * 19}B]')
    assert line_of(loop=(31.0, 31.2)).count('B') == 1


def test_nothing_moves_where_the_position_has_fewer_digits():
    places = {line_of(position_s=position_s, duration_s=4000.0).index(' / ')
              for position_s in (0.0, 61.0, 600.0, 3700.0)}
    assert len(places) == 1


def test_recording_of_one_moment():
    assert line_of(position_s=0.0, duration_s=0.0).endswith('  1×  [' + '-' * 40 + ']')


@given(PROGRESSES, st.integers(0, 200), st.sampled_from([UNICODE, ASCII]))
def test_never_wider_than_the_terminal(progress, width, symbols):
    line = progress_line(progress, width, symbols)
    assert len(line) <= width
    assert line.isprintable()
    assert symbols is UNICODE or line.isascii()


@given(PROGRESSES)
def test_a_wide_terminal_shows_all(progress):
    line = progress_line(progress, 200)
    assert clock_text(progress.position_s, 3) in line
    assert clock_text(progress.duration_s, 3) in line
    assert (f'{progress.dropped} dropped' in line) == (progress.dropped > 0)
    assert line.endswith(']')


def test_narrow_terminal_keeps_the_position():
    assert line_of(width=30, dropped=7) == ' ▶ 0:12.345 / 1:02.000  1×'
    assert line_of(width=11) == ' ▶ 0:12.345'


@pytest.mark.parametrize('encoding, symbols', [
    ('utf-8', UNICODE), ('UTF-8', UNICODE), ('ascii', ASCII), ('latin-1', ASCII),
    ('ANSI_X3.4-1968', ASCII), (None, ASCII), ('no-such-encoding', ASCII)])
def test_symbols_that_the_output_can_show(encoding, symbols):
    assert symbols_for(encoding) is symbols
