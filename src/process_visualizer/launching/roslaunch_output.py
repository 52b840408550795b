# SPDX-License-Identifier: BSD-3-Clause
"""Parses what roslaunch writes about its processes (ros_comm 1.14 to 1.16)."""
from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Optional

_CONTROL = re.compile(r'\x1b\[[0-9;]*m|\x1b\]2;.*?\x07')
_PROCESS = r'\[(?P<name>[^\[\]]+)-\d+\]'
_STARTED = re.compile(r'process' + _PROCESS + r': started with pid \[(?P<pid>\d+)\]')
_DIED = re.compile(_PROCESS + r' process has died \[pid \d+, exit code (?P<code>-?\d+)')
_FINISHED = re.compile(_PROCESS + r' process has finished cleanly')
_REQUIRED = re.compile(r'REQUIRED process ' + _PROCESS + r' has died!')
_UNLOCATED = re.compile(r'ERROR: cannot launch node of type \[(?P<type>[^\]]*)\]: (?P<why>.*)')
_LOG_FILE = re.compile(r'log file: (?P<path>/.*)\*\.log')
_EXIT_CODE = re.compile(r'process has died \[pid \d+, exit code (?P<code>-?\d+)')


@dataclass(frozen=True)
class ProcessEvent:
    """The message of a line about a process; ``name`` is the node's absolute name.

    ``kind`` is started, exited, required_died or cannot_launch (then ``name`` is package/type).
    ``rest`` is what the node wrote before roslaunch ended the line about its start.
    """

    kind: str
    name: str
    exit_code: int = 0
    reason: str = ''
    rest: str = ''


def plain(line: str) -> str:
    """The line without colours, window titles and its end."""
    return _CONTROL.sub('', line).rstrip()


def parse_line(line: str) -> Optional[ProcessEvent]:
    """The event that a plain line reports, or None."""
    match = _STARTED.search(line)
    if match:
        return ProcessEvent('started', '/' + match['name'], rest=line[match.end():])
    match = _REQUIRED.search(line)
    if match:
        return ProcessEvent('required_died', '/' + match['name'])
    match = _DIED.search(line)
    if match:
        return ProcessEvent('exited', '/' + match['name'], int(match['code']))
    match = _FINISHED.search(line)
    if match:
        return ProcessEvent('exited', '/' + match['name'])
    match = _UNLOCATED.search(line)
    if match:
        return ProcessEvent('cannot_launch', match['type'], reason=match['why'])
    return None


def stdout_file_in(line: str) -> Optional[str]:
    """The file of a node with output to the log, from the line that follows its end."""
    match = _LOG_FILE.fullmatch(line)
    return f'{match["path"]}-stdout.log' if match else None


def exit_code_in(line: str) -> Optional[int]:
    """The exit code in the line that follows the report on a required process."""
    match = _EXIT_CODE.search(line)
    return int(match['code']) if match else None
