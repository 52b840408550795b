# SPDX-License-Identifier: BSD-3-Clause
"""Programs that run out of memory or threads say so in a sentence, with exit code 1."""
from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

from process_visualizer.shortage import shortage_words

NODES = Path(__file__).parents[2] / 'nodes'
_MIB = 1 << 20
MANY_THREADS = """
import threading
from process_visualizer.shortage import telling_shortages
threading.stack_size(1 << 46)
with telling_shortages('cell'):
    threading.Thread().start()
"""


def ended(words: List[str], memory_mib: int) -> 'subprocess.CompletedProcess[str]':
    """Run Python with a memory limit."""
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (memory_mib * _MIB, memory_mib * _MIB))

    return subprocess.run([sys.executable, *words], preexec_fn=limit, text=True, timeout=60,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)


@pytest.mark.parametrize('memory_mib', [36, 40, 60])
@pytest.mark.parametrize('words', [['cell', 'report', 'a.bag'], ['bag_player', 'a.bag'], ['gui']],
                         ids=' '.join)
def test_without_memory(words: List[str], memory_mib: int) -> None:
    """Most of these limits are reached while modules are loaded."""
    it = ended([str(NODES / words[0]), *words[1:]], memory_mib)
    assert it.returncode == 1
    assert 'Traceback' not in it.stderr
    assert len(it.stderr.splitlines()) == 1
    assert 'there is not enough memory' in it.stderr


def test_without_threads() -> None:
    it = ended(['-c', MANY_THREADS], 1 << 14)
    assert (it.returncode, it.stdout) == (1, '')
    assert it.stderr.startswith('cell: no thread or process can be started')


def test_a_fork_that_fails() -> None:
    error = BlockingIOError(11, 'Resource temporarily unavailable')
    assert 'no thread or process' in shortage_words(error)


@pytest.mark.parametrize('error', [
    RuntimeError('dictionary changed size'), BlockingIOError(11, 'write could not complete'),
    OSError(28, 'No space left on device'), ImportError('No module named x')], ids=repr)
def test_other_errors_stay(error: Exception) -> None:
    assert shortage_words(error) == ''
