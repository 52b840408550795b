# SPDX-License-Identifier: BSD-3-Clause
"""Decoding of keys from a terminal's bytes, and their actions."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.player.player_options import KEY_HELP, Command, KeyAction, key_action
from process_visualizer.player.player_terminal import ESCAPE, UNKNOWN, KeyDecoder

SEQUENCES = {
    '\x1b[A': 'up', '\x1b[B': 'down', '\x1b[C': 'right', '\x1b[D': 'left', '\x1bOA': 'up',
    '\x1bOB': 'down', '\x1bOC': 'right', '\x1bOD': 'left', '\x1b[H': 'home', '\x1b[F': 'end',
    '\x1bOH': 'home', '\x1bOF': 'end', '\x1b[1~': 'home', '\x1b[4~': 'end', '\x1b[7~': 'home',
    '\x1b[8~': 'end', '\x1b[1;5C': UNKNOWN, '\x1b[15~': UNKNOWN, '\x1bq': UNKNOWN,
    '\x1b[200~': UNKNOWN, '\x1bOP': UNKNOWN,
}
CHARACTERS = st.characters(blacklist_characters='\x1b', blacklist_categories=['Cs'])
TYPED = st.lists(st.one_of(CHARACTERS.map(lambda it: (it, it)),
                           st.sampled_from(sorted(SEQUENCES.items()))))


@pytest.mark.parametrize('sequence, key', SEQUENCES.items())
def test_sequence(sequence, key):
    assert KeyDecoder().feed(sequence.encode()) == [key]


@given(TYPED, st.data())
def test_keys_are_the_same_in_any_pieces(typed, data):
    sent = ''.join(sequence for sequence, _ in typed).encode()
    ends = sorted(data.draw(st.sets(st.integers(0, len(sent))))) + [len(sent)]
    decoder, keys = KeyDecoder(), []
    for begin, end in zip([0, *ends], ends):
        keys += decoder.feed(sent[begin:end])
    assert keys == [key for _, key in typed]
    assert not decoder.is_waiting
    assert decoder.flush() == []


@given(st.lists(st.binary(max_size=40)))
def test_any_bytes_end_in_keys(pieces):
    decoder = KeyDecoder()
    keys = [key for piece in pieces for key in decoder.feed(piece)] + decoder.flush()
    assert not decoder.is_waiting
    assert all(key and '\x1b' not in key for key in keys)
    assert len(keys) <= sum(map(len, pieces)) + 1


def test_lone_escape_is_a_key_once_nothing_follows():
    decoder = KeyDecoder()
    assert decoder.feed(b'\x1b') == []
    assert decoder.is_waiting
    assert decoder.flush() == [ESCAPE]
    assert decoder.feed(b'q') == ['q']


def test_escape_twice():
    decoder = KeyDecoder()
    assert decoder.feed(b'\x1b\x1b') == [ESCAPE]
    assert decoder.flush() == [ESCAPE]


def test_endless_sequence_is_given_up():
    decoder = KeyDecoder()
    keys = decoder.feed(b'\x1b[' + b'1' * 1000)
    assert keys[0] == ESCAPE
    assert not decoder.is_waiting


def test_broken_characters_do_no_harm():
    assert KeyDecoder().feed(b'\xff\xfes') == ['\ufffd', '\ufffd', 's']


@pytest.mark.parametrize(
    'key, action',
    [
        (' ', KeyAction(Command.TOGGLE_PAUSED)),
        ('s', KeyAction(Command.STEP, 1)),
        ('.', KeyAction(Command.STEP, 1)),
        ('S', KeyAction(Command.STEP, -1)),
        (',', KeyAction(Command.STEP, -1)),
        ('left', KeyAction(Command.SEEK_BY, -1)),
        ('right', KeyAction(Command.SEEK_BY, 1)),
        ('down', KeyAction(Command.SEEK_BY, -10)),
        ('up', KeyAction(Command.SEEK_BY, 10)),
        ('home', KeyAction(Command.SEEK_TO_BEGIN)),
        ('end', KeyAction(Command.SEEK_TO_END)),
        ('[', KeyAction(Command.SLOWER)),
        (']', KeyAction(Command.FASTER)),
        ('r', KeyAction(Command.REVERSE)),
        ('l', KeyAction(Command.TOGGLE_LOOP)),
        ('a', KeyAction(Command.LOOP_BEGIN)),
        ('b', KeyAction(Command.LOOP_END)),
        ('?', KeyAction(Command.HELP)),
        ('q', KeyAction(Command.QUIT)),
        ('\x03', KeyAction(Command.QUIT)),
        ('x', None),
        ('', None),
        (ESCAPE, None),
        (UNKNOWN, None),
        ('\x1a', None),
    ],
)
def test_action_of_a_key(key, action):
    assert key_action(key) == action


def test_help_names_every_key_that_does_something():
    shown = {'space': ' ', 'Ctrl-C': '\x03'}
    named = {shown.get(word, word) for word in KEY_HELP.replace(',', ' , ').split()}
    candidates = [*map(chr, range(128)), *SEQUENCES.values()]
    assert {key for key in candidates if key_action(key)} <= named
    assert max(map(len, KEY_HELP.splitlines())) <= 80
