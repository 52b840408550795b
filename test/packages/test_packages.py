# SPDX-License-Identifier: BSD-3-Clause
"""A clone in a fresh workspace: built and installed, with both packages and their content found."""
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, Tuple

import pytest

REPOSITORY = Path(__file__).parents[2]
EXECUTABLES = {
    'process_visualizer': ['cell', 'cell_frames', 'depth_proc', 'ghost', 'robot_proc',
                           'scene_watch', 'sensor_fit', 'variable_proc', 'view_picture',
                           'view_relay'],
    'sewing_cell': ['kinect_roi', 'sewing_machine.py', 'simulator'],
}
SHARED = {
    'process_visualizer': ['devices.xml', 'devices.xsd', 'rviz_config/default.rviz',
                           'nodelet_plugins.xml', 'rviz_plugins.xml', 'urdf/ur.urdf.xacro',
                           'meshes/ur-link0.dae'],
    'sewing_cell': ['devices/simulated.xml', 'urdf/ur_rt_upper.urdf.xacro',
                    'meshes/sewing_machine.dae', 'launch/openni_play.launch'],
}


def clean_environment(home: Path) -> Dict[str, str]:
    """Return the environment after a fresh login and activation of the virtual environment."""
    path = f'{Path(sys.executable).parent}:/usr/sbin:/usr/bin:/sbin:/bin'
    return {'HOME': str(home), 'PATH': path, 'LANG': 'C.UTF-8', 'VIRTUAL_ENV': sys.prefix}


def in_space(setup: Path, command: str) -> 'subprocess.CompletedProcess[str]':
    """Run a shell command after sourcing a space's set-up file."""
    return subprocess.run(['bash', '-c', f'source {setup} && {command}'], text=True,
                          env=clean_environment(setup.parents[1]), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False)


@pytest.fixture(scope='module')
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with a clone of the last commit, built and installed in a clean environment.

    Each source is compiled by itself, as users build it. The test is about compiling and installed
    paths only: nothing is optimized.
    """
    folder = tmp_path_factory.mktemp('workspace')
    clone = folder / 'src' / 'process_visualizer'
    subprocess.run(['git', 'clone', '-q', str(REPOSITORY), str(clone)], check=True)
    build = subprocess.run(
        ['catkin_make', f'-DPYTHON_EXECUTABLE={sys.executable}', '-DCMAKE_BUILD_TYPE=Debug',
         '-DCMAKE_CXX_FLAGS_DEBUG=', f'-j{os.cpu_count()}', 'install', 'tests'], cwd=folder,
        env=clean_environment(folder), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, check=False)
    assert build.returncode == 0, build.stdout[-4000:]
    return folder


@pytest.fixture(params=['devel', 'install'])
def setup(request: pytest.FixtureRequest, workspace: Path) -> Path:
    return workspace / str(request.param) / 'setup.bash'


@pytest.mark.parametrize('package', sorted(EXECUTABLES))
def test_the_package_is_found(setup: Path, package: str) -> None:
    found = in_space(setup, f'rospack find {package}')
    assert found.returncode == 0, found.stdout
    folder = Path(found.stdout.strip().splitlines()[-1])
    assert folder.name == package
    assert [name for name in SHARED[package] if not (folder / name).exists()] == []


def executables() -> List[Tuple[str, str]]:
    return [(package, name) for package, names in EXECUTABLES.items() for name in names]


@pytest.mark.parametrize(('package', 'name'), executables())
def test_the_executable_is_found_once(setup: Path, package: str, name: str) -> None:
    found = in_space(setup, f'catkin_find --first-only --libexec {package} {name}')
    assert os.access(found.stdout.strip().splitlines()[-1], os.X_OK), found.stdout


def test_a_command_runs(setup: Path) -> None:
    checked = in_space(setup, 'rosrun process_visualizer cell check '
                              '"$(rospack find sewing_cell)/devices/simulated.xml"')
    assert checked.returncode == 0, checked.stdout
    assert '6 devices, no problem' in checked.stdout


@pytest.mark.parametrize('command', ['$(find xacro)/xacro', 'xacro'])
def test_launch_files_call_xacro(setup: Path, tmp_path: Path, command: str) -> None:
    (tmp_path / 'user.launch').write_text(
        f"<launch><param name='model' command='{command} "
        "$(find sewing_cell)/urdf/ur_rt_upper.urdf.xacro'/></launch>")
    dumped = in_space(setup, f'roslaunch --dump-params {tmp_path}/user.launch')
    assert 'ur_rt_upper/link0' in dumped.stdout, dumped.stdout


def test_every_launch_file_loads(setup: Path) -> None:
    listed = in_space(setup, 'cd "$(rospack find sewing_cell)/launch" && '
                             'for file in *.launch; do roslaunch --nodes sewing_cell "$file" || '
                             'echo "FAILED $file"; done')
    assert 'FAILED' not in listed.stdout, listed.stdout
    assert '/camera/camera_nodelet_manager' in listed.stdout
