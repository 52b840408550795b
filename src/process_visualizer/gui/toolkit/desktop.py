# SPDX-License-Identifier: BSD-3-Clause
"""The operator's desktop: the editor, the working folder, and the output of programs."""
from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from typing import Iterator, List, Mapping, Optional

from PyQt5.QtCore import QProcess

# Opening a file at a line in the operator's own editor.

_AT_LINE: Mapping[str, str] = {
    'code': '--goto {file}:{line}', 'codium': '--goto {file}:{line}', 'subl': '{file}:{line}',
    'gedit': '+{line} {file}', 'pluma': '+{line} {file}', 'xed': '+{line} {file}',
    'kate': '--line {line} {file}', 'kwrite': '--line {line} {file}',
    'geany': '--line {line} {file}', 'mousepad': '--line {line} {file}',
    'pycharm': '--line {line} {file}', 'emacs': '+{line} {file}', 'gvim': '+{line} {file}',
}
"""Arguments of graphical editors for a line; the editors are tried in this order."""
_IN_TERMINALS = ('vi', 'vim', 'nvim', 'nano', 'pico', 'ed', 'joe', 'jed', 'ne', 'micro', 'hx',
                 'mcedit', 'editor', 'sensible-editor')
_TIME_TO_FAIL_S = 1.0


class EditorError(Exception):
    """No editor could be started; the text names those that were tried."""


def open_in_editor(file: str, line: int, environment: Optional[Mapping[str, str]] = None) -> str:
    """Start the first editor that works; return its program. Blocks up to a second per editor.

    Raises:
        EditorError: no editor works.
    """
    tried = []
    for command in commands(file, line, os.environ if environment is None else environment):
        if _starts(command):
            return command[0]
        tried.append(os.path.basename(command[0]))
    raise EditorError(f'no editor could be started (tried: {", ".join(tried) or "none"}); open '
                      f'{file} at line {line} by hand, or set VISUAL to your graphical editor')


def commands(file: str, line: int, environment: Mapping[str, str]) -> Iterator[List[str]]:
    """Yield the commands to try: $VISUAL, $EDITOR, well-known editors, then the desktop's own."""
    path = environment.get('PATH', os.defpath)
    own = [_words(environment.get(name, '')) for name in ('VISUAL', 'EDITOR')]
    known = [[name] for name in _AT_LINE if shutil.which(name, path=path)]
    for words in [*filter(None, own), *known]:
        name = os.path.basename(words[0])
        if name not in _IN_TERMINALS and '-nw' not in words:
            place = _AT_LINE.get(name, '{file}').split()
            yield [*words, *(word.format(file=file, line=line) for word in place)]
    yield ['xdg-open', file]


def _words(command: str) -> List[str]:
    """Return the words of a command; none if a quote is not closed, so that another is tried."""
    try:
        return shlex.split(command)
    except ValueError:
        return []


def _starts(command: List[str]) -> bool:
    """Start an editor; return False if it exits with an error at once."""
    try:
        process = subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    except OSError:
        return False
    try:
        return process.wait(_TIME_TO_FAIL_S) == 0
    except subprocess.TimeoutExpired:
        return True


def working_folder(environment: Mapping[str, str] = os.environ) -> str:
    """Return the working folder of the calling shell if it is writable, else the home folder.

    roslaunch runs its nodes in ``~/.ros``, where nobody looks for files, but leaves ``PWD`` as set
    by the shell.
    """
    folder = environment.get('PWD', '')
    is_usable = os.path.isabs(folder) and os.path.isdir(folder) and os.access(folder, os.W_OK)
    return folder if is_usable else os.path.expanduser('~')


def output_lines(process: QProcess) -> Iterator[str]:
    """Yield the lines that a program has written completely; after its end, also the last part."""
    while process.canReadLine() or (process.state() == QProcess.NotRunning
                                    and process.bytesAvailable()):
        yield bytes(process.readLine().data()).decode('utf-8', 'replace').rstrip('\r\n')
