# SPDX-License-Identifier: BSD-3-Clause
"""The player in a terminal: keys work as documented, the line is shown, faults are sentences."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List, Optional

import pytest
import rosgraph
import rospy
from recorded_rows import Row, cell_rows, write_bag
from simulated_player import SimulatedPlayer
from std_msgs.msg import Float32MultiArray

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.playback.timeline import CommandRefused
from process_visualizer.player.bag_player import NothingToPlay, PlaybackFailed, PlayerSettings
from process_visualizer.player.player_options import parse_options
from process_visualizer.player.player_program import INTERRUPTED, ReindexRefused, exit_code, opened
from process_visualizer.player.player_terminal import PlayerTerminal

Play = Callable[..., SimulatedPlayer]


class FakeKeyboard:
    """Keyboard with keys that were pressed."""

    def __init__(self, *keys: str) -> None:
        self._keys = list(keys)

    def read_key(self) -> Optional[str]:
        return self._keys.pop(0) if self._keys else None

    def __enter__(self) -> FakeKeyboard:
        return self

    def __exit__(self, *_: object) -> None:
        pass


class FakeScreen:
    """Terminal of 80 columns, or a file."""

    encoding = 'ascii'

    def __init__(self, is_terminal: bool = True) -> None:
        self.is_terminal, self.columns = is_terminal, 80  # type: bool, Optional[int]
        self.texts: List[str] = []

    def width(self) -> Optional[int]:
        return self.columns

    def write(self, text: str) -> None:
        self.texts.append(text.replace('\r\x1b[K', ''))


class Typist:
    """Keys pressed at a player's terminal."""

    def __init__(self, player: SimulatedPlayer, is_terminal: bool = True,
                 quiet: bool = False) -> None:
        self.player, self.screen, self.quiet = player, FakeScreen(is_terminal), quiet

    def terminal(self, *keys: str) -> PlayerTerminal:
        return PlayerTerminal(self.player.player.status, self.player.player.control,
                              self.player.player.quit, self.quiet, FakeKeyboard(*keys),
                              self.screen)

    def press(self, *keys: str) -> List[str]:
        """Press keys; return the text that is then written."""
        del self.screen.texts[:]
        self.terminal(*keys).read_keys()
        self.player.node.let_work()
        return self.screen.texts


@pytest.fixture(scope='module')
def long_bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A number every 8 ms for 20 s."""
    return write_bag(tmp_path_factory.mktemp('long') / 'long.bag', [
        Row('/tcf', time_ms, Float32MultiArray(data=[time_ms / 1000.0]))
        for time_ms in range(0, 20_001, 8)])


@pytest.fixture
def typist(play: Play, long_bag: str) -> Typist:
    """At a player that is paused at 5 s."""
    return Typist(play(long_bag, start_s=5.0))


@pytest.mark.parametrize('key, position_s', [
    ('s', 5.008), ('.', 5.008), ('S', 4.992), (',', 4.992), ('left', 4.0), ('right', 6.0),
    ('down', 0.0), ('up', 15.0), ('home', 0.0), ('end', 20.0)])
def test_keys_that_move(typist: Typist, key: str, position_s: float) -> None:
    typist.press(key)
    assert typist.player.position_s == pytest.approx(position_s, abs=1e-9)


def test_keys_that_change_how_it_plays(typist: Typist) -> None:
    progress = typist.player.player.status
    assert typist.press(' ') == ['playing 5.000 s\n']
    assert not progress().paused
    assert typist.press(' ') == ['paused 5.000 s\n']
    typist.press(']')
    assert progress().rate > 1.0
    typist.press('[', '[')
    assert progress().rate < 1.0
    typist.press('r')
    assert progress().rate < 0.0
    typist.press('l')
    assert progress().loop == (0.0, 20.0)
    assert typist.press('l') == ['no loop\n']
    assert progress().loop is None


def test_a_loop_from_here_to_there(typist: Typist) -> None:
    assert typist.press('a') == ['the loop will begin at 5.000 s: b sets its end\n']
    typist.press('right')
    assert typist.press('a', 'right', 'b')[-1] == 'loop from 6.000 to 7.000 s\n'
    assert typist.player.player.status().loop == (6.0, 7.0)


def test_what_is_refused_is_told(typist: Typist) -> None:
    typist.press('end')
    text, = typist.press('s')
    assert 'no message after' in text
    assert typist.press('?')[0].startswith('  space         pause or play')
    assert typist.press('x') == []


def test_it_no_longer_pauses_at_topics(play: Play, cell_bag: str) -> None:
    player = play(cell_bag, settings=PlayerSettings(pause_topics=('/marker',)))
    assert Typist(player).press('t') == ['not pausing at topics\n']
    player.play()
    player.node.advance(2.0)
    assert player.position_s == 1.0


def test_who_quits_ends_it(typist: Typist) -> None:
    typist.press('q', 'home')
    assert typist.player.player.has_ended
    assert typist.player.position_s == 5.0


def test_the_line_shows_the_position_in_the_foreground_only(typist: Typist) -> None:
    terminal = typist.terminal()
    terminal.show()
    assert typist.screen.texts[0].startswith(' || 0:05.000 / 0:20.000  1x  [##########-----')
    typist.screen.columns = None
    terminal.show()
    assert len(typist.screen.texts) == 1


@pytest.mark.parametrize('is_terminal, quiet', [(False, False), (True, True)])
def test_nothing_is_shown_in_a_file_or_if_it_is_to_be_quiet(play: Play, cell_bag: str,
                                                            is_terminal: bool,
                                                            quiet: bool) -> None:
    typist = Typist(play(cell_bag), is_terminal, quiet)
    typist.terminal().show()
    assert typist.screen.texts == typist.press(' ', '?') == []


def test_what_was_used_is_left_with_a_new_line(typist: Typist) -> None:
    with typist.terminal('home'):
        pass
    assert typist.screen.texts[-1] == '\n'
    assert typist.player.position_s == 0.0


# Errors that prevent playing are one sentence


@pytest.mark.parametrize('error', [
    BagError('a.bag', 'is empty'), NothingToPlay('nothing'), PlaybackFailed('at 3 s'),
    ReindexRefused('no'), CommandRefused('too short'), ValueError('no topic')])
def test_what_prevents_it_is_told(capsys: pytest.CaptureFixture, error: Exception) -> None:
    def fail() -> int:
        raise error

    assert exit_code(fail) == 1
    assert capsys.readouterr() == ('', f'bag_player: {error}\n')


@pytest.mark.parametrize('error', [
    ConnectionRefusedError('refused'), rosgraph.MasterException('away'),
    rospy.ROSException('gone')])
def test_without_a_master_it_is_told(capsys: pytest.CaptureFixture, error: Exception) -> None:
    def fail() -> int:
        raise error

    assert exit_code(fail) == 1
    assert capsys.readouterr().err == (f'bag_player: the ROS master cannot be used: {error}; is '
                                       'roscore running?\n')


def test_an_interrupt_ends_it_silently(capsys: pytest.CaptureFixture) -> None:
    def interrupt() -> int:
        raise KeyboardInterrupt

    assert exit_code(interrupt) == INTERRUPTED
    assert capsys.readouterr() == ('', '')


# A bag without an index


@pytest.fixture
def cut_off(tmp_path: Path) -> Path:
    """A bag without its last third."""
    bag = Path(write_bag(tmp_path / 'cell.bag', cell_rows()))
    whole = bag.read_bytes()
    bag.write_bytes(whole[:int(len(whole) * 0.7)])
    return bag


def test_a_bag_without_an_index_is_not_copied_unless_wanted(cut_off: Path) -> None:
    with pytest.raises(ReindexRefused, match='bag_player --reindex .* makes .* and plays it'):
        opened(parse_options([str(cut_off)]))
    assert list(cut_off.parent.iterdir()) == [cut_off]


def test_a_bag_without_an_index_is_played_from_a_copy_if_wanted(cut_off: Path, capsys: Any) -> None:
    before = cut_off.read_bytes()
    for told in ('messages', ': playing '):  # the second time the copy exists
        with opened(parse_options(['--reindex', str(cut_off)])) as recording:
            path, = recording.paths
            assert path.endswith('cell.reindexed.bag')
            assert 120 < len(recording.index) < 193
        assert told in capsys.readouterr().err
    assert cut_off.read_bytes() == before
