# SPDX-License-Identifier: BSD-3-Clause
"""Runs the benchmarks' C++ subscriber (arrivals.cpp), which records when messages arrive."""
from __future__ import annotations

import os
import subprocess
import sys
from types import TracebackType
from typing import NamedTuple, Optional, Sequence, Type

import numpy as np

_ARRIVAL = np.dtype([('time_ns', '<i8'), ('topic', '<u4'), ('size', '<u4'), ('front', 'u1', 64)])
_END_TIMEOUT_S = 60.0


class Answer(NamedTuple):
    """Times of a service call and of its answer (``time.monotonic_ns``), and the answer."""

    request_ns: int
    answer_ns: int
    success: bool
    message: str


class ArrivalRecorder:
    """Subscribes to topics from beginning to end; a context manager."""

    def __init__(self, topics: Sequence[str], path: str) -> None:
        self._path = path
        self._process = subprocess.Popen([_program(), path, *topics], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True)
        self._read_line()  # "ready"

    def __enter__(self) -> 'ArrivalRecorder':
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def connected(self) -> int:
        """Return the number of topics that have a publisher."""
        return int(self._ask('connected'))

    def call(self, command: str) -> Answer:
        """Call a service of the player: `seek S`, `rate R`, `pause` or `play`."""
        request_ns, answer_ns, success, message = self._ask(command).split(' ', 3)
        return Answer(int(request_ns), int(answer_ns), success == '1', message)

    def finish(self) -> np.ndarray:
        """Wait until no more messages arrive; return all arrivals.

        They are records of ``time_ns`` (``time.monotonic_ns``), the number of the ``topic``, the
        ``size`` in bytes, and the first 64 bytes as ``front``.
        """
        assert self._process.stdin is not None
        self._process.stdin.close()
        if self._process.wait(_END_TIMEOUT_S) != 0:
            raise RuntimeError('the subscriber of the benchmark has failed')
        return np.fromfile(self._path, _ARRIVAL)

    def _ask(self, command: str) -> str:
        assert self._process.stdin is not None
        print(command, file=self._process.stdin, flush=True)
        return self._read_line()

    def _read_line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError('the subscriber of the benchmark has ended')
        return line.rstrip('\n')


def build_recorder() -> None:
    """Build the subscriber in the workspace of this environment."""
    build_program('bench_arrivals')


def build_program(name: str) -> None:
    """Build a benchmark program in that workspace."""
    command = ['cmake', '--build', os.path.join(_devel(), '..', 'build'), '--target', name]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            check=False)
    if result.returncode != 0:
        sys.exit(f'{result.stdout}\n{name}, a program of the benchmark, could not be built')


def _program() -> str:
    return os.path.join(_devel(), 'lib', 'process_visualizer', 'bench_arrivals')


def _devel() -> str:
    """Return the devel space of the workspace, which is first in the environment."""
    return os.environ['CMAKE_PREFIX_PATH'].split(os.pathsep)[0]
