# SPDX-License-Identifier: BSD-3-Clause
"""The player with defective recordings: faults are reported, and playback continues."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Any, BinaryIO, Callable, List

import pytest
from recorded_rows import Row, cell_rows, serialized, write_bag
from sensor_msgs.msg import Image
from simulated_player import SimulatedPlayer
from std_msgs.msg import Float32MultiArray

from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_player import NothingToPlay, PlaybackFailed, PlayerSettings

Play = Callable[..., SimulatedPlayer]


class BadImage(Image):
    """Image whose bytes end within its header."""

    def serialize(self, buff: BinaryIO) -> None:
        buff.write(bytes(14))


class FaultyRecording(Recording):
    """Recording that fails at a message because of a program error."""

    faulty_from = 0

    def message(self, position: int) -> memoryview:
        if position >= self.faulty_from:
            raise RuntimeError('a fault')
        return super().message(position)


class LaterFaulty(FaultyRecording):
    """Recording that fails while it plays."""

    faulty_from = 60


@pytest.fixture
def damaged_bag(tmp_path: Path) -> str:
    """A bag with a chunk in its middle that cannot be decompressed."""
    path = Path(write_bag(tmp_path / 'cell.bag', cell_rows(), compression='bz2'))
    content = bytearray(path.read_bytes())
    at = content.index(b'BZh', content.index(b'BZh', len(content) // 3) + 1)
    content[at:at + 40] = bytes(40)
    path.write_bytes(content)
    return str(path)


def test_a_damaged_chunk_is_a_gap_that_is_told_and_summed_up(play: Play, damaged_bag: str) -> None:
    player = play(damaged_bag, plays=True)
    player.end()
    count = len(player.of('/tcf'))
    assert 60 < count < 126
    gap, = player.state.gaps
    assert 'a chunk cannot be read: decompression (bz2) fails' in gap
    player.node.advance(1.0)
    assert player.node.log == [('warn', gap)]
    summary = player.player.summary()
    assert any(f'/tcf: {126 - count} of 126 messages could not be played' in it for it in summary)
    assert gap in summary
    assert not player.player.is_complete


def test_after_the_end_only_the_summary_tells_it(play: Play, damaged_bag: str) -> None:
    player = play(damaged_bag)
    player.seek(0.9)
    player.close()
    player.node.advance(1.0)
    assert player.node.log == []


def test_what_is_left_out_does_not_matter_where_it_was_not_chosen(play: Play,
                                                                  damaged_bag: str) -> None:
    player = play(damaged_bag, plays=True, settings=PlayerSettings(TopicChoice(['/marker'])))
    player.end()
    assert (player.player.is_complete, player.player.summary()) == (True, ())


def test_a_message_that_does_not_fit_its_definition_is_left_out(play: Play, bag_of: Any) -> None:
    player = play(bag_of([*cell_rows(), Row('/image', 500, BadImage())]), plays=True)
    player.end()
    assert '/image: the message at 0.500 s does not fit its definition' in player.state.gaps[0]
    assert len(player.of('/image')) == 25


def test_a_message_with_an_odd_time_is_told(play: Play, bag_of: Any) -> None:
    days_ms = 100 * 24 * 3600 * 1000
    player = play(bag_of([*cell_rows(), Row('/tcf', days_ms, Float32MultiArray(data=[9.0]))]))
    gap, = player.state.gaps
    assert gap.startswith('/tcf: one message has a time far from that of all others')


def test_a_bag_that_disappears_is_played_to_its_end(play: Play, bag_of: Any) -> None:
    bag = bag_of(cell_rows())
    player = play(bag)
    os.remove(bag)
    player.play()
    player.end()
    assert set(player.of('/tcf')) == {serialized(row.message) for row in cell_rows()
                                      if row.topic == '/tcf'}


def test_a_bag_that_is_cut_off_meanwhile_has_a_gap(play: Play, bag_of: Any) -> None:
    bag = bag_of(cell_rows())
    player = play(bag)
    os.truncate(bag, os.path.getsize(bag) // 2)
    player.seek(0.95)
    player.node.advance(0.1)
    assert 'has become shorter' in player.state.gaps[0]
    assert player.seek(0.1).success


@pytest.mark.parametrize('start_s, rate', [(100.0, 1.0), (1.001, -1.0)])
def test_a_start_behind_the_end_plays_nothing(play: Play, cell_bag: str, start_s: float,
                                              rate: float) -> None:
    with pytest.raises(NothingToPlay, match=f'no messages to play from {start_s:g} s on: the '
                                            'recording is 1.000 s long'):
        play(cell_bag, start_s=start_s, rate=rate)


def test_without_a_topic_nothing_is_played(play: Play, cell_bag: str) -> None:
    with pytest.raises(NothingToPlay, match='no chosen topic can be played'):
        play(cell_bag, settings=PlayerSettings(TopicChoice(exclude=['/*'])))


def test_a_name_that_is_not_utf_8(play: Play, tmp_path: Path) -> None:
    bag = os.path.join(os.fsencode(tmp_path), b'sch\xf6n.bag')
    os.rename(write_bag(tmp_path / 'cell.bag', cell_rows()), bag)
    assert play(os.fsdecode(bag)).state.files[0].endswith('sch\ufffdn.bag')


@pytest.mark.parametrize('recording_type', [FaultyRecording, LaterFaulty])
def test_a_fault_of_the_program_ends_it_with_a_sentence(
        play: Play, cell_bag: str, recording_type: Callable[[List[str]], Recording]) -> None:
    player = play(cell_bag, plays=True, recording_type=recording_type)
    player.node.advance(1.0)
    with pytest.raises(PlaybackFailed, match=r"^playback has failed at 0\.\d* s: "
                                             r"RuntimeError\('a fault'\) in .*, line \d+; "):
        player.player.wait()
