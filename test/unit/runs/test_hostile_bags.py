# SPDX-License-Identifier: BSD-3-Clause
"""A recording is data: nothing in its configuration is run."""
from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict

import pytest
from hostile_bags import ELSEWHERE, hostile, write_hostile

_OURS = {'process_visualizer', 'robot_state_publisher', 'rviz', 'nodelet'}


@pytest.fixture(scope='module')
def used(tmp_path_factory: pytest.TempPathFactory) -> Dict[str, Any]:
    """The result of each recording, the remaining files, and whether anything connected."""
    folder = tmp_path_factory.mktemp('hostile')
    canaries, made = folder / 'canaries', folder / 'made'
    for path in (canaries, made, folder / 'bags', folder / 'home', folder / 'here'):
        path.mkdir()
    for ending in ('.xml', '.urdf', '.yaml', '.dae', '.py'):
        (folder / f'outside{ending}').write_text(
            '<robot name="secret"><link name="secret"/></robot>')
    with socket.socket() as server:
        server.bind(('127.0.0.1', 0))
        server.listen(5)
        corpus = hostile(canaries, server.getsockname()[1])
        bags = [write_hostile(bag, folder / 'bags') for bag in corpus]
        done = subprocess.run(
            [sys.executable, str(Path(__file__).with_name('hostile_program.py')), str(made), *bags],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False,
            cwd=folder / 'here', env={**os.environ, 'HOME': str(folder / 'home'),
                                      'ROS_HOME': str(folder / 'home'), 'XDG_CONFIG_HOME': ''})
        server.setblocking(False)
        try:
            server.accept()
            connected = True
        except BlockingIOError:
            connected = False
    assert done.returncode == 0, done.stderr
    results = {it['name']: it for it in map(json.loads, done.stdout.splitlines())}
    return {'corpus': {it.name: it for it in corpus}, 'results': results, 'connected': connected,
            'canaries': sorted(it.name for it in canaries.iterdir()),
            'here': list((folder / 'here').iterdir()), 'folder': str(folder),
            'files': [str(it.relative_to(made)) for it in made.rglob('*') if it.is_file()]}


def test_no_recording_runs_writes_or_connects_to_anything(used: Dict[str, Any]) -> None:
    assert len(used['results']) == len(used['corpus']) >= 20
    assert used['canaries'] == []
    assert not used['connected']
    assert used['here'] == []
    assert [it for it in used['files'] if it.endswith('.py') or '/.' in it] == []


def test_only_what_this_package_generates_is_started(used: Dict[str, Any]) -> None:
    for name, result in used['results'].items():
        for node in result['started']:
            assert node['node'].partition('/')[0] in _OURS, name
            assert not node['prefix'] and not node['machine'], name
            assert [it for it in node['environment'] if it[0].startswith('LD_')] == [], name
            for value in (node['args'], *node['parameters'].values()):
                assert '$(' not in value and 'root:' not in value, name
            assert '/use_sim_time' not in node['parameters'], name


def test_what_is_ignored_is_named(used: Dict[str, Any]) -> None:
    for name, result in used['results'].items():
        assert used['corpus'][name].told in result['said'], (name, result['said'])
        assert 'Traceback' not in result['said'], name


def test_no_file_of_this_computer_is_shown(used: Dict[str, Any]) -> None:
    for name, result in used['results'].items():
        shown = [line for line in result['said'].splitlines() if line.startswith(('URDF', '  <'))]
        assert not any('secret' in line or '127.0.0.1' in line for line in shown), name
    assert not Path(ELSEWHERE).exists()
