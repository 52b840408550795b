# SPDX-License-Identifier: BSD-3-Clause
"""Base frame poses at recording time, those saved next to the bag, and the command."""
from __future__ import annotations

import json
import math
import resource
from pathlib import Path
from typing import Any, Dict, List, Tuple
from xml.etree import ElementTree

import pytest
import rosbag
import yaml
from genpy import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.recorder_topics import CALIBRATION, CONFIGURATION
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.recording_calibration import (
    calibration_path,
    read_recording_calibration,
    recorded_frames,
    save_pose,
    saved_poses,
)
from process_visualizer.cell.model import Pose
from process_visualizer.commands.command_line import main
from process_visualizer.robot.rotations import quaternion_from_ypr

CELL = """<visualizer>
  <device type="depth_sensor" name="kinect"><base frame="camera_link" xyz="1 2 3"/>
    <topic name="points" type="pointcloud"/></device>
  <device type="other" name="table"><base frame="table" xyz="0 0 1"/></device>
</visualizer>"""
POSE = Pose((1.02, 2.0, 3.0), (0.0, math.radians(2.0), 0.0))


def frame(child: str, pose: Pose, parent: str = 'world') -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.transform.translation = Vector3(*pose.xyz)
    message.transform.rotation = Quaternion(*quaternion_from_ypr(pose.ypr))
    return message


def write_bag(folder: Path, *messages: Any) -> str:
    """A bag with the cell's configuration and these messages on the topic of its frames."""
    config = folder / 'cell.xml'
    config.write_text(CELL)
    stored = {'file': str(config), 'files': {str(config): CELL}, 'arguments': {}}
    path = str(folder / 'seam.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write(CONFIGURATION, String(json.dumps(stored)), Time(10))
        for number, message in enumerate(messages):
            bag.write(CALIBRATION, message, Time(11 + number))
    return path


@pytest.fixture
def bag(tmp_path: Path) -> str:
    """The sensor was moved during recording: the last pose counts."""
    return write_bag(tmp_path, TFMessage([frame('camera_link', Pose()), frame('/table', Pose(
        (0.0, 0.0, 1.0)))]), TFMessage([frame('camera_link', POSE)]))


def launched_frames(folder: Path) -> Dict[str, List[float]]:
    """The frame poses in the launch file."""
    launch = ElementTree.parse(folder / 'cell.launch')
    (node,) = [it for it in launch.iter('node') if it.get('name') == 'cell_frames']
    text = node.find('rosparam').text  # type: ignore[union-attr]
    return {it['child']: it['xyz'] for it in yaml.safe_load(text or '')['frames']}


def test_a_recording_is_played_with_the_poses_saved_for_it(bag: str, tmp_path: Path,
                                                           capsys: Any) -> None:
    save_pose(bag, 'camera_link', Pose((7.5, 2.0, 3.0)))
    save_pose(bag, 'gone', Pose())  # it is no longer in the configuration
    assert main(['generate', str(tmp_path / 'cell.xml'), '--mode', 'playback', '--bag', bag,
                 '--output', str(tmp_path / 'made')]) == 0
    assert f'as saved in {calibration_path(bag)}: camera_link\n' in capsys.readouterr().out
    frames = launched_frames(tmp_path / 'made')
    assert (frames['camera_link'], frames['table']) == ([7.5, 2.0, 3.0], [0.0, 0.0, 1.0])
    save_pose(bag, 'camera_link', None)
    Path(calibration_path(bag)).write_text('[')
    assert main(['generate', str(tmp_path / 'cell.xml'), '--mode', 'playback', '--bag', bag]) == 1
    assert 'cannot be read as poses' in capsys.readouterr().err


def said(arguments: List[str], capsys: Any) -> Tuple[int, str, str]:
    code = main(['calibration', *arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_the_frames_that_the_recorder_stored(bag):
    with Recording([bag]) as recording:
        found = recorded_frames(recording)
    assert set(found) == {'camera_link', 'table'}
    assert found['camera_link'].pose.xyz == pytest.approx(POSE.xyz)
    assert found['camera_link'].pose.ypr == pytest.approx(POSE.ypr)


@pytest.mark.parametrize('broken', [
    TFMessage([frame('camera_link', Pose((math.nan, 0.0, 0.0)))]), String('no frames'),
    TFMessage([TransformStamped(child_frame_id='camera_link')])])
def test_what_is_no_frame_is_left_out(tmp_path, broken):
    path = write_bag(tmp_path, TFMessage([frame('table', POSE)]), broken)
    with Recording([path]) as recording:
        assert set(recorded_frames(recording)) == {'table'}
        assert len(recording.gaps) == 1


def test_poses_are_saved_beside_the_bag_and_forgotten(bag):
    before = Path(bag).read_bytes()
    assert saved_poses(bag) == {}
    save_pose(bag, 'camera_link', POSE)
    assert save_pose(bag, 'table', Pose()) == {'camera_link': POSE, 'table': Pose()}
    assert read_recording_calibration([bag]).saved == {'camera_link': POSE, 'table': Pose()}
    save_pose(bag, 'camera_link', None)
    assert save_pose(bag, 'table', None) == {}
    assert not Path(calibration_path(bag)).exists() and Path(bag).read_bytes() == before


@pytest.mark.parametrize('text', [
    '', '[]', '{"a": 1}', '{"a": {"xyz": [1, 2], "ypr": [0, 0, 0]}}', '[' * 100000,
    '{"a": {"xyz": [1, 2, NaN], "ypr": [0, 0, 0]}}', '{"a": {"xyz": "abc", "ypr": [0, 0, 0]}}'])
def test_a_damaged_file_is_named_and_stays(bag, text):
    path = Path(calibration_path(bag))
    path.write_text(text)
    with pytest.raises(BagError, match=r'seam\.bag\.calibration\.json.*repair or remove it'):
        save_pose(bag, 'camera_link', POSE)
    assert path.read_text() == text


def test_a_disk_that_is_full_is_told_and_nothing_is_left(bag):
    before = sorted(Path(bag).parent.iterdir())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
    try:
        with pytest.raises(BagError, match='cannot be written: File too large'):
            save_pose(bag, 'camera_link', POSE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert sorted(Path(bag).parent.iterdir()) == before


def test_the_command_says_then_and_now(bag, capsys):
    code, out, _ = said([bag], capsys)
    assert code == 2
    assert 'kinect: camera_link in world' in out and '20.0 mm and 2.00° from then' in out
    assert '0.0 mm and 0.00° from then' in out  # the table
    assert 'saved' not in out
    save_pose(bag, 'camera_link', Pose((1.02, 2.003, 3.0), POSE.ypr))
    assert '3.0 mm and 0.00° from then' in said([bag], capsys)[1]


def test_the_command_with_another_configuration(bag, tmp_path, capsys):
    other = tmp_path / 'other.xml'
    other.write_text(CELL.replace('1 2 3"', f'1.02 2 3" ypr="0 {math.radians(2.0)!r} 0"'))
    code, out, _ = said([bag, str(other)], capsys)
    assert code == 0 and str(other) in out
    other.write_text(CELL.replace('<visualizer>', '<visualizer frame="hall">'))
    code, out, _ = said([bag, str(other)], capsys)
    assert code == 0 and out.count('not recorded') == 2


def test_the_command_without_a_configuration(bag, tmp_path, capsys):
    (tmp_path / 'cell.xml').unlink()
    code, out, _ = said([bag], capsys)
    assert code == 0 and 'camera_link in world' in out and 'no configuration' in out


def test_the_command_refuses_bad_input(bag, tmp_path, capsys):
    for arguments in ([str(tmp_path / 'none.bag')], [bag, str(tmp_path / 'none.xml')]):
        code, out, err = said(arguments, capsys)
        assert code == 1 and out == '' and 'none.' in err and 'Traceback' not in err
    foreign = str(tmp_path / 'foreign.bag')
    with rosbag.Bag(foreign, 'w') as other:
        other.write('/a', String('b'), Time(1))
    code, out, err = said([foreign], capsys)
    assert code == 1 and 'does not say where the base frames were' in err
    Path(calibration_path(bag)).write_text('{')
    code, out, err = said([bag], capsys)
    assert code == 1 and 'calibration.json' in err
