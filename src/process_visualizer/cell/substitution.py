# SPDX-License-Identifier: BSD-3-Clause
"""Substitution arguments in attributes, resolved by roslaunch's own resolver."""
from __future__ import annotations

import os
import re
from typing import Dict, Mapping, Optional

import rospkg
from roslaunch.substitution_args import SubstitutionException, resolve_args

from process_visualizer.cell.errors import advice, nearest, quoted

_COMMAND = re.compile(r'\$\(\s*([^\s)]*)\s*([^\s)]*)')
_NESTED = re.compile(r'\$\([^)]*\$\(')
_UNFINISHED = re.compile(r'\$\([^)]*\Z')
_ALLOWED = ('find', 'env', 'optenv', 'arg', 'dirname')
_MAX_LENGTH = 65_536
"""Maximum characters of a value; without a limit, nested arguments could fill the memory."""


Arguments = Mapping[str, Optional[str]]
"""Values of the ``<arg>`` elements; None for an argument without a usable value."""


class UnresolvedArgumentError(ValueError):
    """Raised for a value that depends on an argument without a value (already reported)."""


def substitute(text: str, arguments: Arguments, file: str) -> str:
    """Return ``text`` with every ``$(…)`` replaced.

    ``file`` is the file that contains the text, for ``$(dirname)``.

    Raises:
        ValueError: a command is unknown or cannot be resolved. ``$(eval)`` is refused: a
            configuration is data and runs no code.
    """
    if '$(' in text:
        _check_commands(text)
    values = _known_values(text, arguments)
    _check_length(text, values)
    context: Dict[str, object] = {'arg': values, 'filename': file}
    try:
        return str(resolve_args(text, context=context, resolve_anon=False))
    except rospkg.ResourceNotFound:
        raise ValueError(f'{quoted(text)}: ' + _missing_package(text)) from None
    except IndexError:  # raised by roslaunch if a value contains "$( )"
        raise ValueError(f'{quoted(text)}: a value in it holds "$( )"; remove that') from None
    except SubstitutionException as error:
        raise ValueError(f'{quoted(text)}: {_reason(text, error, values)}') from None


def _check_commands(text: str) -> None:
    if _UNFINISHED.search(text):
        raise ValueError(f'{quoted(text)}: the ")" that ends "$(" is missing')
    if _NESTED.search(text):
        raise ValueError(f'{quoted(text)}: "$(" cannot be nested in "$("; use an <arg>')
    for command, _ in _COMMAND.findall(text):
        if command not in _ALLOWED:
            raise ValueError(f'{quoted(f"$({command} …)")} cannot be used here; '
                             + advice(command, _ALLOWED))


def _known_values(text: str, arguments: Arguments) -> Dict[str, str]:
    names = [name for command, name in _COMMAND.findall(text) if command == 'arg']
    if any(name in arguments and arguments[name] is None for name in names):
        raise UnresolvedArgumentError
    return {name: value for name, value in arguments.items() if value is not None}


def _check_length(text: str, arguments: Mapping[str, str]) -> None:
    values = {**os.environ, **arguments}
    longest = len(text) + sum(len(values.get(name, '')) for _, name in _COMMAND.findall(text))
    if longest > _MAX_LENGTH:
        raise ValueError(f'{quoted(text)} is longer than {_MAX_LENGTH} characters')


def package_advice(package: str, packages: Optional[rospkg.RosPack] = None) -> str:
    """Return what to do about a missing package; ``packages`` avoids repeated searches."""
    name = nearest(package, (packages or rospkg.RosPack()).list())
    meant = f'did you mean "{name}"? Otherwise ' if name else ''
    return f'there is no package "{package}"; {meant}install it or source the workspace that has it'


def _missing_package(text: str) -> str:
    packages = rospkg.RosPack()
    known = packages.list()
    names = [name for command, name in _COMMAND.findall(text) if command == 'find']
    return package_advice(next((name for name in names if name not in known), names[0]), packages)


def _reason(text: str, error: Exception, arguments: Mapping[str, str]) -> str:
    names = [name for command, name in _COMMAND.findall(text) if command == 'arg']
    unknown = [name for name in names if name and name not in arguments]
    if not unknown:
        return ' '.join(str(error).replace(f'[{text}]', '').split())
    known = advice(unknown[0], arguments) if arguments else 'no <arg> is declared'
    return f'there is no argument "{unknown[0]}"; {known}'
