# SPDX-License-Identifier: BSD-3-Clause
"""The keys for playing a recording in a terminal."""
from __future__ import annotations

from enum import Enum
from typing import Dict, NamedTuple, Optional, Tuple


class Command(Enum):
    """A command that a key gives to the player; the value is the name of its method."""

    TOGGLE_PAUSED = 'toggle_paused'
    STEP = 'step'
    SEEK_BY = 'seek_by'
    SEEK_TO_BEGIN = 'seek_to_begin'
    SEEK_TO_END = 'seek_to_end'
    FASTER = 'faster'
    SLOWER = 'slower'
    REVERSE = 'reverse'
    TOGGLE_LOOP = 'toggle_loop'
    TOGGLE_PAUSE_TOPICS = 'toggle_pause_topics'
    LOOP_BEGIN = 'loop_begin'
    LOOP_END = 'loop_end'
    HELP = 'help'
    QUIT = 'quit'


class Action(NamedTuple):
    """A command with its distance: messages for STEP, seconds for SEEK_BY, otherwise 0."""

    command: Command
    amount: int = 0


_KEYS: Tuple[Tuple[str, Action], ...] = (
    (' ', Action(Command.TOGGLE_PAUSED)),
    ('s', Action(Command.STEP, 1)),
    ('.', Action(Command.STEP, 1)),
    ('S', Action(Command.STEP, -1)),
    (',', Action(Command.STEP, -1)),
    ('left', Action(Command.SEEK_BY, -1)),
    ('right', Action(Command.SEEK_BY, 1)),
    ('down', Action(Command.SEEK_BY, -10)),
    ('up', Action(Command.SEEK_BY, 10)),
    ('home', Action(Command.SEEK_TO_BEGIN)),
    ('end', Action(Command.SEEK_TO_END)),
    ('[', Action(Command.SLOWER)),
    (']', Action(Command.FASTER)),
    ('r', Action(Command.REVERSE)),
    ('l', Action(Command.TOGGLE_LOOP)),
    ('t', Action(Command.TOGGLE_PAUSE_TOPICS)),
    ('a', Action(Command.LOOP_BEGIN)),
    ('b', Action(Command.LOOP_END)),
    ('?', Action(Command.HELP)),
    ('q', Action(Command.QUIT)),
    ('\x03', Action(Command.QUIT)),  # Ctrl-C where the terminal makes no signal of it
)
_ACTIONS: Dict[str, Action] = dict(_KEYS)

KEY_HELP = """\
  space         pause or play
  s .           one message forward       S ,        one message back
  right left    1 s forward or back       up down    10 s forward or back
  home end      to the beginning, end     r          reverse the direction
  ]             faster                    [          slower
  l             loop on or off            a b        loop from here, to here
  t             pause at --pause-topics, or not
  ?             this help                 q Ctrl-C   quit"""
"""The keys in lines for a terminal 80 columns wide."""


def key_action(key: str) -> Optional[Action]:
    """Return the action of a key (as KeyDecoder names it), or None if it has none."""
    return _ACTIONS.get(key)
