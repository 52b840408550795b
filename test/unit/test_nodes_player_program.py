# SPDX-License-Identifier: BSD-3-Clause
"""The player: its priority, unless the user chose another one; its end before it plays."""
import errno
import os
import subprocess
import sys

import pytest

from process_visualizer.launching.ros_api import MasterClient
from process_visualizer.player.player_program import INTERRUPTED, PRIORITY, exit_code

REPORT = """
import os
from process_visualizer.player.player_program import take_priority
os.nice({nice})
take_priority()
print(os.getpriority(os.PRIO_PROCESS, 0))
"""
OURS = os.getpriority(os.PRIO_PROCESS, 0)
"""The niceness with which the tests were started."""


def priority_after(nice, *prefix):
    """The niceness of a program that had another one before."""
    result = subprocess.run([*prefix, sys.executable, '-c', REPORT.format(nice=nice)], check=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return int(result.stdout)


def may_have_priority():
    """Return whether a program of this user may raise its priority."""
    return subprocess.run([sys.executable, '-c', f'import os; os.nice({PRIORITY})'],
                          stderr=subprocess.DEVNULL, check=False).returncode == 0


def test_it_is_taken_where_it_may_be():
    assert priority_after(0) == (PRIORITY if OURS == 0 and may_have_priority() else OURS)


def test_it_is_not_taken_where_the_user_has_chosen():
    assert priority_after(5) == OURS + 5


def test_without_the_right_it_goes_on():
    as_root = ['setpriv', '--bounding-set=-sys_nice'] if os.geteuid() == 0 else []
    assert priority_after(0, 'prlimit', '--nice=0:0', *as_root) == OURS


INTERRUPTED_WHILE_IT_OPENS = """
import sys
from process_visualizer.player.player_program import main

def interrupted(paths):
    raise KeyboardInterrupt

sys.exit(main(['bag_player', 'a.bag'], interrupted))
"""


def test_it_ends_silently_when_interrupted_while_it_opens_a_bag():
    result = subprocess.run([sys.executable, '-c', INTERRUPTED_WHILE_IT_OPENS], check=False,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert (result.returncode, result.stdout) == (INTERRUPTED, '')


def fails_with(error):
    """Stand-in for playback that raises an error."""
    raise error


@pytest.mark.parametrize('error', [
    OSError(errno.ENOSPC, 'No space left on device', '/tmp/a.bag'), OSError(errno.EMFILE, 'Files')])
def test_errors_of_the_system_are_not_the_masters(error, capsys):
    assert exit_code(lambda: fails_with(error)) == 1
    assert capsys.readouterr().err == f'bag_player: {error}\n'


def test_a_missing_master_is_named(capsys):
    assert exit_code(MasterClient('/me', 'http://localhost:1').getPid) == 1
    told = capsys.readouterr().err
    assert told.startswith('bag_player: the ROS master cannot be used: ')
    assert told.endswith('; is roscore running?\n')


WITHOUT_LIBRARY = """
import sys
from process_visualizer.player import timed_sender
from process_visualizer.player.player_program import main

timed_sender.LIBRARY = 'libnone.so'
sys.exit(main(['bag_player', 'a.bag']))
"""


def test_a_missing_library_is_named():
    result = subprocess.run([sys.executable, '-c', WITHOUT_LIBRARY], check=False,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert (result.returncode, result.stdout) == (1, (
        'bag_player: libnone.so: cannot open shared object file: No such file or directory: '
        'build the workspace and source its setup.bash\n'))
