# SPDX-License-Identifier: BSD-3-Clause
"""Message definitions that are installed, for publishers that do not send theirs.

rosjava, goroslib, rosbridge and others send an empty definition, or one without the types that it
uses. That of an installed package stands in for it if it has the same MD5 sum. It is read out of
the package's Python module for the type, which is not imported: a bag starts nothing.
"""
from __future__ import annotations

import ast
import re
import sys
from functools import lru_cache
from pathlib import Path
from typing import Optional

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.definition_checksum import definition_checksum
from process_visualizer.messages.message_definition import DefinitionError, short_name

_TYPE = re.compile(r'([A-Za-z]\w*)/([A-Za-z]\w*)', re.ASCII)
_MAX_BYTES = 4 << 20  # of a module
_TEXT = '_full_text'


def with_definition(connection: Connection) -> Connection:
    """Return a connection with the installed definition, if its own is none and that one is it."""
    if _checksum(connection.type, connection.message_definition) == connection.md5sum:
        return connection
    text = _installed(short_name(connection.type))
    if text is None or _checksum(connection.type, text) != connection.md5sum:
        return connection
    return connection._replace(message_definition=text)


def installed_connection(topic: str, type_name: str) -> Optional[Connection]:
    """Return what a publisher of an installed type says; None if it is not installed."""
    text = _installed(short_name(type_name))
    checksum = '' if text is None else _checksum(type_name, text)
    return Connection(topic, type_name, checksum, text or '', False, '') if checksum else None


def definition_problem(connection: Connection) -> str:
    """Return why the messages of a connection cannot be understood; '' if they can be."""
    sent = connection.message_definition.strip()
    found = _checksum(connection.type, connection.message_definition)
    if found and sent:
        return ''
    kind = short_name(connection.type)
    package, installed = kind.partition('/')[0], _installed(kind)
    if found == connection.md5sum and not installed:  # that of std_msgs/Empty is empty
        return ''
    if installed is not None:
        why = (f'the one that is installed has the MD5 sum {_checksum(kind, installed)} instead of '
               f'{connection.md5sum}; install the version of {package} that was used then')
    else:
        why = f'the type is not installed here either; install the package {package}'
    return (f'{connection.topic}: its messages cannot be understood: they came with '
            f'{"a part of the" if sent else "no"} definition of {kind}, and {why}')


@lru_cache(maxsize=512)
def _checksum(type_name: str, text: str) -> str:
    """The MD5 sum of a definition; '' if it cannot be understood, or lacks a type."""
    try:
        return definition_checksum(type_name, text)
    except DefinitionError:
        return ''


@lru_cache(maxsize=512)
def _installed(type_name: str) -> Optional[str]:
    """The whole definition of package/Type; None if it is not installed."""
    matched = _TYPE.fullmatch(type_name)
    if matched is None:
        return None
    package, name = matched.groups()
    for folder in sys.path:
        text = _text_in(Path(folder, package, 'msg', f'_{name}.py'))
        if text is not None:
            return text
    return None


def _text_in(module: Path) -> Optional[str]:
    """The definition in a module that genpy has made; None if it is none."""
    try:
        if not module.is_file() or module.stat().st_size > _MAX_BYTES:
            return None
        tree = ast.parse(module.read_text(encoding='utf-8'))
    except (OSError, ValueError, SyntaxError):
        return None
    values = [it.value for kind in tree.body if isinstance(kind, ast.ClassDef) for it in kind.body
              if isinstance(it, ast.Assign) and isinstance(it.targets[0], ast.Name)
              and it.targets[0].id == _TEXT]
    texts = [it.value for it in values if isinstance(it, ast.Constant)]
    return texts[0] if texts and isinstance(texts[0], str) else None
