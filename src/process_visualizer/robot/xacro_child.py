# SPDX-License-Identifier: BSD-3-Clause
"""The program behind expand_xacro, which expands one file and prints the result as JSON.

usage: python3 -m process_visualizer.robot.xacro_child FILE FOLDER [NAME:=VALUE …]

With a FOLDER the file is untrusted data: see limit_this_process.

It is a separate process because xacro keeps its state in its module.
"""
from __future__ import annotations

import ast
import importlib
import json
import os
import re
import resource
import sys
import sysconfig
from contextlib import redirect_stdout, suppress
from pathlib import Path
from types import TracebackType
from typing import (
    Any,
    Dict,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Set,
)
from xml.dom import minidom
from xml.parsers import expat
from xml.parsers.expat import ExpatError

import rospkg

from process_visualizer.cell.errors import shortened
from process_visualizer.robot.xacro_command import import_xacro, xacro_version

# Limits of an untrusted model while xacro expands it.
#
# xacro evaluates expressions as Python. Its own limits can be bypassed (``vars``, a generator's
# frame), and it includes and loads any file. So the process that expands such a model installs an
# audit hook, which nothing can remove. The hook refuses everything that is not needed: other files,
# processes, connections, and expressions that reach into Python.

_MEMORY_BYTES, _TIME_S = 2_000_000_000, 30
MAX_CHARACTERS = 10_000_000
"""Maximum size of an untrusted model."""
_MAX_REASON = 2000
_REFUSED = frozenset((
    'code', 'ctypes', 'fcntl', 'ftplib', 'function', 'gc', 'http', 'imaplib', 'mmap', 'nntplib',
    'os', 'pickle', 'poplib', 'pty', 'resource', 'setopencodehook', 'shutil', 'signal', 'smtplib',
    'socket', 'sqlite3', 'subprocess', 'syslog', 'telnetlib', 'tempfile', 'urllib',
    'webbrowser'))
"""First words of refused audit events."""
_HARMLESS = frozenset(('os.listdir', 'os.scandir', 'os.walk'))
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_EXPRESSIONS = ('<expression>', b'<expression>', '<string>', b'<string>')
"""File names under which xacro compiles ${…}, and Python the text of $(eval …)."""
_REACHING = re.compile(r'_|(gi|cr|ag|tb|co|f|func)_')
"""Attributes of Python's internal objects: of generators, frames, code, functions."""
_REACHING_NAMES = frozenset(('vars', 'mro', 'format', 'format_map', 'getattr', 'eval', 'exec'))
"""Names that lead from a value into Python, for example to all classes."""
_NEEDED_LATER = ('yaml', 'xacro.substitution_args', 'roslaunch.substitution_args')
"""Modules that some versions of xacro import only when a file needs them."""
_VARIABLES = ('ROS_PACKAGE_PATH', 'ROS_ROOT')
_MANIFESTS = ('package.xml', 'manifest.xml', 'stack.xml')
_CODE = ('.py', '.pyc')


class LimitError(Exception):
    """A model in a recording exceeds its limits; the text says how."""


class _Readable(NamedTuple):
    """Readable folders: for all files, for Python's modules, and for manifests of packages.

    The last ones contain links to packages, which other packages of the same name may hide.
    """

    files: FrozenSet[str]
    code: FrozenSet[str]
    manifests: FrozenSet[str]


def _real(folders: Iterable[str]) -> FrozenSet[str]:
    return frozenset(os.path.realpath(it) for it in folders)


def _code_folders() -> Iterator[str]:
    """Yield the folders of Python's library and of imported modules."""
    yield from (sysconfig.get_path(name) for name in ('stdlib', 'platstdlib'))
    for module in list(sys.modules.values()):
        file = getattr(module, '__file__', None)
        if file:
            yield os.path.dirname(file)


def limit_this_process(folder: str) -> None:
    """Limit this process from now on to reading a folder and packages, and to calculating.

    Environment variables that ROS does not need are removed.
    """
    for name in _NEEDED_LATER:
        with suppress(ImportError):
            importlib.import_module(name)
    packages = rospkg.RosPack()
    readable = _Readable(
        _real((folder, *(packages.get_path(name) for name in packages.list()))),
        _real(_code_folders()), frozenset(map(os.path.abspath, packages.get_ros_paths())))
    for name in list(os.environ):
        if name not in _VARIABLES:
            del os.environ[name]
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (_TIME_S, _TIME_S))
    sys.addaudithook(lambda event, values: _check(event, values, readable))


def _check(event: str, values: Sequence[Any], readable: _Readable) -> None:
    """Raise LimitError for an audit event that is not allowed."""
    if event == 'open':
        _check_open(values[0], int(values[2] or 0), readable)
    elif event == 'compile' and values[1] in _EXPRESSIONS:
        _check_expression(values[0])
    elif event.partition('.')[0] in _REFUSED and event not in _HARMLESS:
        raise LimitError(f'a model in a recording may not use {event}')


def _check_open(path: Any, flags: int, readable: _Readable) -> None:
    if isinstance(path, int):
        return
    name = os.path.realpath(os.fsdecode(path))
    if flags & _WRITING:
        raise LimitError(f'a model in a recording may not write "{name}"')
    is_readable = (_is_below(name, readable.files)
                   or name.endswith(_CODE) and _is_below(name, readable.code)
                   or os.path.basename(name) in _MANIFESTS
                   and _is_below(os.path.abspath(os.fsdecode(path)), readable.manifests))
    if not is_readable:
        raise LimitError(f'a model in a recording may not read "{name}", which is in no package')


def _is_below(name: str, folders: FrozenSet[str]) -> bool:
    """Return whether a file is below one of the folders."""
    above = os.path.dirname(name)
    while above not in folders and os.path.dirname(above) != above:
        above = os.path.dirname(above)
    return above in folders


def _check_expression(source: Any) -> None:
    """Raise LimitError for an expression that is more than a calculation."""
    if not isinstance(source, (str, bytes)):
        return
    try:
        tree = ast.parse(source.strip(), mode='eval')
    except SyntaxError:
        return  # xacro reports the error
    for node in ast.walk(tree):
        name = node.attr if isinstance(node, ast.Attribute) else \
            node.id if isinstance(node, ast.Name) else ''
        if name in _REACHING_NAMES or name.startswith('_') \
                or isinstance(node, ast.Attribute) and _REACHING.match(name) \
                or isinstance(node, (ast.GeneratorExp, ast.Lambda, ast.JoinedStr)):
            raise LimitError('a model in a recording may only calculate, which '
                             f'${{{shortened(_text(source))}}} is not')


def _text(source: 'str | bytes') -> str:
    return source if isinstance(source, str) else source.decode('utf-8', 'replace')


# Search for the position of an element in the files, which xacro itself does not know.

class XacroPlace(NamedTuple):
    """A file, and the line in it; 0 if the line is unknown."""

    file: str
    line: int


class _StartTag(NamedTuple):
    name: str
    attributes: Dict[str, str]
    line: int


def place_in_files(element: Optional[minidom.Element], files: Sequence[str],
                   default: str) -> XacroPlace:
    """Return the place of an element, in the first file with exactly one matching element.

    xacro replaces expressions by values, so an attribute matches any expression in a file.
    Without such a place, return the ``default`` file.
    """
    if element is not None:
        for file in files:
            lines = [tag.line for tag in _start_tags(file) if _is_like(element, tag)]
            if len(lines) == 1:
                return XacroPlace(file, lines[0])
    return XacroPlace(default, 0)


def _is_like(element: minidom.Element, tag: _StartTag) -> bool:
    attributes: Any = element.attributes  # untyped
    here = dict(attributes.items())
    there = {name: value for name, value in tag.attributes.items()
             if not name.startswith(('xmlns', 'xacro:'))}
    return element.tagName == tag.name and all(
        name in there and (there[name] == value or '$' in there[name])
        for name, value in here.items() if not name.startswith(('xmlns', 'xacro:')))


def _start_tags(file: str) -> List[_StartTag]:
    """Return the start tags of a file, or those before the first error."""
    tags: List[_StartTag] = []
    parser = expat.ParserCreate()

    def note(name: str, attributes: Dict[str, str]) -> None:
        tags.append(_StartTag(name, attributes, parser.CurrentLineNumber))

    parser.StartElementHandler = note
    try:
        with open(file, 'rb') as stream:
            parser.ParseFile(stream)
    except (OSError, expat.ExpatError):
        return tags
    return tags


_ARGUMENT = re.compile(r'''<xacro:arg\s[^>]*?\bname\s*=\s*["']([^"']+)|'''
                       r'''\$\(arg\s+([^)\s]+)|\barg\(\s*["']([^"']+)''')
"""Matches the declaration or the use of an argument in a file."""


def main(arguments: List[str]) -> int:
    """Print the text of an expanded file, or the reason for a failure."""
    path, folder, given = arguments[0], arguments[1], arguments[2:]
    mappings = dict(argument.split(':=', 1) for argument in given)
    with redirect_stdout(sys.stderr):  # output of a file is not part of the result
        result = _result(path, folder, mappings)
    json.dump(result, sys.stdout)
    return 0


def _result(path: str, folder: str, mappings: Dict[str, str]) -> Mapping[str, Any]:
    try:
        xacro = import_xacro()
    except ImportError:
        return {'missing': True}
    result: Dict[str, Any] = {'xacro': xacro_version(xacro)}
    try:
        files = _files_read()
        if folder:
            limit_this_process(folder)
        document = xacro.process_file(path, mappings=dict(mappings))
        text = document.toprettyxml(indent='  ')
        if folder and len(text) > MAX_CHARACTERS:
            raise LimitError('a model in a recording may not have more than '
                             f'{MAX_CHARACTERS} characters')
        result.update(files=sorted(files), text=text,
                      unused=_unused(mappings, [path, *xacro.all_includes]))
    except Exception as error:  # expressions in xacro files can raise anything
        place = _place(xacro, path, error)
        result.update(message=' '.join((str(error) or repr(error)).split())[:_MAX_REASON],
                      package=_missing_package(error), argument=_missing_argument(error),
                      file=place.file, line=place.line)
    return result


def _files_read() -> Set[str]:
    """Return a set that collects the files opened from now on, except Python's modules.

    These are included files, YAML files, and manifests of packages.
    """
    files: Set[str] = set()

    def take(event: str, values: Sequence[Any]) -> None:
        if event == 'open' and isinstance(values[0], str) \
                and not (values[0].endswith('.py') or '__pycache__' in values[0]):
            files.add(os.path.abspath(values[0]))

    sys.addaudithook(take)
    return files


def _unused(mappings: Mapping[str, str], files: List[str]) -> Dict[str, List[str]]:
    """Return arguments that no file mentions, each with the known arguments of the files."""
    texts = [Path(file).read_text(encoding='utf-8', errors='replace') for file in files]
    known = {name for text in texts for names in _ARGUMENT.findall(text) for name in names if name}
    return {name: sorted(known) for name in mappings if name not in known}


def _missing_package(error: Exception) -> str:
    """Return the name of a package that was not found; '' for other errors."""
    cause = getattr(error, 'exc', None)  # the error wrapped by xacro's own one
    return str(cause.args[0]) if isinstance(cause, rospkg.ResourceNotFound) else ''


def _missing_argument(error: Exception) -> str:
    """Return the name of an argument without a value; '' for other errors."""
    cause: Any = getattr(error, 'exc', None)
    return str(cause.args[0]) if type(cause).__name__ == 'ArgException' else ''


def _place(xacro: Any, path: str, error: Exception) -> XacroPlace:
    """Return the place where xacro stopped, in the innermost macro's or last included file."""
    files = [file for file in (xacro.filestack or [path]) if file is not None] or [path]
    if isinstance(error, ExpatError):
        return XacroPlace(files[-1], error.lineno)
    macros = [macro.history[-1][-1] for macro in (xacro.macrostack or []) if macro.history]
    try:
        return place_in_files(_innermost_element(error.__traceback__),
                              [*reversed(macros), *reversed(files)], files[-1])
    except LimitError:  # the file is not readable
        return XacroPlace(path, 0)


def _innermost_element(traceback: Optional[TracebackType]) -> Optional[minidom.Element]:
    """Return the element that was being expanded, which xacro's functions call ``node``."""
    found = None
    while traceback is not None:
        node = traceback.tb_frame.f_locals.get('node')
        if isinstance(node, minidom.Element):
            found = node
        traceback = traceback.tb_next
    return found


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
