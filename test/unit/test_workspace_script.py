# SPDX-License-Identifier: BSD-3-Clause
"""The environment that the demo keeps while preparing the workspace clears the rest."""
from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Dict

import pytest

REPOSITORY = Path(__file__).parents[2]
SCRIPT = '''repository=$0
source "$repository/scripts/workspace.sh"
keep_network
unset "${!ROS_@}"
export ROS_MASTER_URI=http://localhost:11311  # as ROS' own set-up file does
restore_network
echo "$ROS_MASTER_URI ${ROS_HOSTNAME:-} ${ROS_IP:-} $named_master"
'''


@pytest.mark.parametrize('given, kept', [
    ({}, 'http://localhost:11311   '),
    ({'ROS_MASTER_URI': 'http://cell:1', 'ROS_IP': '10.0.0.1'},
     'http://cell:1  10.0.0.1 http://cell:1'),
    ({'ROS_MASTER_URI': 'http://cell:1', 'ROS_HOSTNAME': 'here'},
     'http://cell:1 here  http://cell:1')])
def test_the_network_is_that_of_the_environment(given: Dict[str, str], kept: str) -> None:
    others = {name: value for name, value in os.environ.items() if not name.startswith('ROS_')}
    done = subprocess.run(['bash', '-euc', SCRIPT, str(REPOSITORY)], env={**others, **given},
                          stdout=subprocess.PIPE, text=True, check=True, timeout=30)
    assert done.stdout == f'{kept}\n'
