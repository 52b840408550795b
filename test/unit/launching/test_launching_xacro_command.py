# SPDX-License-Identifier: BSD-3-Clause
"""Other people's launch files that call xacro, in all usual ways."""
from __future__ import annotations

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Dict

import pytest

MAKERS = Path(__file__).parents[2] / 'data' / 'makers'
FILE = '$(find ur_style_description)/urdf/arm.xacro'
WAYS = ('$(find xacro)/xacro', 'xacro', 'rosrun xacro xacro --inorder')


@pytest.fixture
def environment() -> Dict[str, str]:
    paths = [os.environ['ROS_PACKAGE_PATH'], str(MAKERS)]
    return {**os.environ, 'ROS_PACKAGE_PATH': os.pathsep.join(paths)}


def without_virtual_environment(environment: Dict[str, str]) -> Dict[str, str]:
    own = str(Path(sys.executable).parent)
    paths = [path for path in environment['PATH'].split(os.pathsep) if path != own]
    return {**environment, 'PATH': os.pathsep.join(paths)}


def dumped(folder: Path, environment: Dict[str, str], *commands: str) -> str:
    parameters = ''.join(f'<param name="p{number}" command="{command}"/>'
                         for number, command in enumerate(commands))
    (folder / 'user.launch').write_text(f'<launch>{parameters}</launch>')
    done = subprocess.run(['roslaunch', '--dump-params', str(folder / 'user.launch')],
                          env={**environment, 'ROS_HOME': str(folder)}, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=120, check=False)
    return done.stdout


@pytest.mark.parametrize('active', [True, False])
def test_launch_files_call_xacro(tmp_path: Path, environment: Dict[str, str],
                                 active: bool) -> None:
    environment = environment if active else without_virtual_environment(environment)
    text = dumped(tmp_path, environment, *(f"{way} '{FILE}' tf_prefix:=a_" for way in WAYS))
    assert text.count('a_shoulder_pan_joint') == len(WAYS), text


def test_message_says_which_xacro_it_is(tmp_path: Path, environment: Dict[str, str]) -> None:
    text = dumped(tmp_path, environment, f"$(find xacro)/xacro '{FILE}' kinematics:=nowhere.yaml")
    assert 'nowhere.yaml' in text
    assert f'(xacro {metadata.version("xacro")} in /' in text
