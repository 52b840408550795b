# SPDX-License-Identifier: BSD-3-Clause
"""A user without real-time priority gets one hint: a line for limits.conf, and its benefit."""
import getpass
import os
import resource
import subprocess
import sys

import pytest

from process_visualizer.launching.real_time_advice import may_have_real_time_priority

ORDINARY = 'Name:\tcell\nCapInh:\t0000000000000000\nCapEff:\t0000000000000000\n'
ROOT = ORDINARY.replace('CapEff:\t0000000000000000', 'CapEff:\t000001ffffffffff')
ROOT_WITHOUT = ORDINARY.replace('CapEff:\t0000000000000000', 'CapEff:\t000001ffff7fffff')

ADVICE = """
import resource
from process_visualizer.launching.real_time_advice import real_time_advice
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
print(real_time_advice())
"""


@pytest.mark.parametrize(('status', 'limit', 'expected'), [
    (ORDINARY, 0, False), (ORDINARY, 10, True), (ORDINARY, resource.RLIM_INFINITY, True),
    (ROOT, 0, True), (ROOT_WITHOUT, 0, False)])
def test_the_right_is_that_of_the_limit_or_of_root(status: str, limit: int, expected: bool) -> None:
    assert may_have_real_time_priority(status, limit) is expected


def test_the_advice_is_one_sentence_with_the_line_to_write() -> None:
    # removes the privilege if this user has it
    without = ['setpriv', '--bounding-set=-sys_nice'] if os.geteuid() == 0 else []
    result = subprocess.run([*without, sys.executable, '-c', ADVICE], check=True, text=True,
                            stdout=subprocess.PIPE)
    assert result.stdout.count('\n') == 1
    assert f'"{getpass.getuser()} - rtprio 10"' in result.stdout
