# SPDX-License-Identifier: BSD-3-Clause
"""Facts that C++ and Python both contain are the same in both."""
from __future__ import annotations

import re
from pathlib import Path

from process_visualizer.bagio.recorder_topics import CALIBRATION, STATIC_FRAMES
from process_visualizer.gui.recording.recording_choices import FOR_ANYBODY
from process_visualizer.nodes.common.node_handle import MAX_NAME_CHARACTERS
from process_visualizer.parameters.robot_parameters import JOINT_OFFSETS
from process_visualizer.robot.kinematics import MOVABLE
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CELL_FRAMES,
    DISPLAY_STATUS_TOPIC,
    FLOAT_ARRAY,
    JOINT_PROC,
    JOINT_STATE,
    OWN_TOPICS,
    RVIZ_PLACE_TOPIC,
    SENSOR_FIT,
    STATIC_TF_TOPIC,
)

SOURCES = Path(__file__).resolve().parents[2] / 'src'


def constant(file: str, name: str) -> str:
    """The text between = and ; after a name."""
    found = re.search(rf'{name}(?:\[\])? = ([^;]*);', (SOURCES / file).read_text(encoding='utf-8'))
    assert found is not None
    return found.group(1)


def test_kinds_of_joints_that_move() -> None:
    kinds = constant('joints/joint_message.cpp', 'kMovable')
    assert tuple(re.findall(r'"(\w+)"', kinds)) == MOVABLE


def test_how_long_names_may_be() -> None:
    assert constant('../include/process_visualizer/common/required_name.hpp',
                    'kMaxNameCharacters') == str(MAX_NAME_CHARACTERS)


def test_names_that_the_recorder_knows() -> None:
    file = 'recorder/message.cpp'
    assert constant('../include/process_visualizer/recorder/message.hpp',
                    'kOwnPrefix') == f'"{OWN_TOPICS}"'
    assert constant(file, 'kNode') == f'"/{CELL_FRAMES}"'
    assert constant(file, 'kSource') == f'"{STATIC_TF_TOPIC}"'
    assert constant(file, 'kCalibration') == f'kOwnPrefix + "{CALIBRATION[len(OWN_TOPICS):]}"'
    assert constant(file, 'kOthers') == f'kOwnPrefix + "{STATIC_FRAMES[len(OWN_TOPICS):]}"'


def test_folders_that_the_recorder_takes_from_anybody() -> None:
    source = (SOURCES / 'recorder/recording_request.cpp').read_text(encoding='utf-8')
    found = re.search(r'folders = \{([^}]*)\}', source)
    assert found is not None
    assert tuple(re.findall(r'"(/[^"]*)"', found.group(1))) == FOR_ANYBODY


def test_the_player_that_sensor_fit_asks() -> None:
    assert constant('cloud/sensor_fit.cpp', 'kRepeat') == f'"/{BAG_PLAYER}/repeat"'


def test_types_and_parameter_that_joint_proc_reads() -> None:
    file = 'joints/joint_message.cpp'
    assert constant(file, 'kArray') == f'"{FLOAT_ARRAY}"'
    assert constant(file, 'kJointState') == f'"{JOINT_STATE}"'
    assert f'"~{JOINT_OFFSETS[len(JOINT_PROC) + 1:]}"' in (
        SOURCES / 'joints/joint_processor.cpp').read_text(encoding='utf-8')


def test_names_that_nodes_give_themselves() -> None:
    for file, text in (('cloud/sensor_fit.cpp', f'ros::init(argc, argv, "{SENSOR_FIT}"'),
                       ('joints/joint_processor.cpp', f'ros::init(argc, argv, "{JOINT_PROC}"'),
                       ('recorder/bag_recorder.cpp', f'ros::init(argc, argv, "{BAG_RECORDER}"'),
                       ('displays/display_status.cpp',
                        f'("{DISPLAY_STATUS_TOPIC.rpartition("/")[2]}"'),
                       ('displays/display_status.cpp',
                        f'("{RVIZ_PLACE_TOPIC.rpartition("/")[2]}"')):
        assert text in (SOURCES / file).read_text(encoding='utf-8'), file
