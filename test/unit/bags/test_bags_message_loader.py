# SPDX-License-Identifier: BSD-3-Clause
"""Messages and their stamps, also in bags with old, empty or truncated definitions."""
from __future__ import annotations

import io
from pathlib import Path
from typing import Any, List

import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped

from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.message_loader import MessageLoader

WHOLE = PoseStamped._full_text


def serialized(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def write(path: Path, definition: str, messages: List[bytes], type_name: str = PoseStamped._type
          ) -> str:
    class Kind(PoseStamped):
        _full_text = definition
        _type = type_name

    with rosbag.Bag(str(path), 'w') as bag:
        for number, data in enumerate(messages):
            bag.write('/pose', (Kind._type, data, Kind._md5sum, Kind), Time(100 + number, 0),
                      raw=True)
    return str(path)


def poses(count: int) -> List[bytes]:
    found = []
    for number in range(count):
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = Time(100, number), 'base'
        found.append(serialized(pose))
    return found


@pytest.mark.parametrize('definition', [
    '', '# nothing but a comment', WHOLE[:20], WHOLE[:len(WHOLE) // 2], WHOLE[:-20],
    'float64 x', WHOLE.replace('Point position', ''), 'what is this?'])
def test_messages_are_played_though_their_definition_is_not_whole(
        tmp_path: Path, definition: str) -> None:
    """They keep their stamps, as with rosbag, if their type is not installed."""
    messages = poses(5)
    bag = write(tmp_path / 'a.bag', definition, messages, 'their_msgs/PoseStamped')
    with Recording([bag]) as recording:
        loader = MessageLoader(recording)
        loaded = loader.load_all(list(range(5)))
        assert [bytes(it.data) for it in loaded] == messages
        assert all(not it.stamp_offsets for it in loaded)
        problem, = loader.problems
        assert problem.startswith('/pose: its stamps stay as they were recorded')
        assert loader.left_out == {}


@pytest.mark.parametrize('definition', [
    WHOLE, WHOLE.replace('std_msgs/Header', 'roslib/Header'),
    WHOLE.replace('\nHeader', '\nroslib/Header').replace('MSG: std_msgs/Header',
                                                         'MSG: roslib/Header')])
def test_stamps_are_found_by_a_whole_definition(tmp_path: Path, definition: str) -> None:
    with Recording([write(tmp_path / 'a.bag', definition, poses(3))]) as recording:
        loader = MessageLoader(recording)
        assert [it.stamp_offsets for it in loader.load_all([0, 1, 2])] == [(4,)] * 3
        assert loader.problems == ()


def test_a_message_that_does_not_fit_its_whole_definition_is_left_out(tmp_path: Path) -> None:
    messages = poses(3)
    messages[1] = messages[1][:-1]
    with Recording([write(tmp_path / 'a.bag', WHOLE, messages)]) as recording:
        loader = MessageLoader(recording)
        assert len(loader.load_all([0, 1, 2])) == 2
        assert loader.left_out == {'/pose': 1}
        assert 'does not fit its definition and is left out' in loader.problems[0]
