# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C at any time during loading ends the programs silently, by the signal."""
from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

REPOSITORY = Path(__file__).parents[2]
PROGRAMS = sorted(path for folder in ('nodes', 'sewing_cell/nodes')
                  for path in (REPOSITORY / folder).iterdir() if path.is_file())

INTERRUPTED = """
import os, runpy, signal, sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == 'numpy' or name == 'rospy':
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
runpy.run_path(sys.argv[1], run_name='__main__')
"""
RESTORED = """
import signal
from process_visualizer.interrupts import silent_interrupts
with silent_interrupts():
    during = signal.getsignal(signal.SIGINT)
print(during.name, signal.getsignal(signal.SIGINT) is signal.default_int_handler)
"""


def run(words: List[str], **options: object) -> 'subprocess.CompletedProcess[str]':
    """Run Python, with SIGINT as in a terminal."""
    return subprocess.run([sys.executable, *words], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=60, check=False,
                          preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
                          **options)  # type: ignore[call-overload]


@pytest.mark.parametrize('program', PROGRAMS, ids=lambda path: path.stem)
def test_nothing_is_printed(program: Path) -> None:
    ended = run(['-c', INTERRUPTED, str(program), '--help'],
                env={**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'})
    assert (ended.returncode, ended.stdout) == (-signal.SIGINT, '')


def test_afterwards_it_is_an_exception_again() -> None:
    assert run(['-c', RESTORED]).stdout.split() == ['SIG_DFL', 'True']


def test_what_is_to_be_ignored_stays_so() -> None:
    """As in the background of a script."""
    ended = subprocess.run([sys.executable, '-c', RESTORED], stdout=subprocess.PIPE, text=True,
                           timeout=60, check=True,
                           preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    assert ended.stdout.split() == ['SIG_IGN', 'False']
