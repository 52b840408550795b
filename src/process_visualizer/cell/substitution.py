"""Substitution arguments in attributes, resolved by roslaunch's own resolver."""
from __future__ import annotations

import re
from typing import Dict, Mapping

import rospkg
from roslaunch.substitution_args import SubstitutionException, resolve_args

from process_visualizer.cell.suggestions import advice, nearest

_COMMAND = re.compile(r'\$\(\s*([^\s)]*)\s*([^\s)]*)')
_ALLOWED = ('find', 'env', 'optenv', 'arg', 'dirname')


def substitute(text: str, arguments: Mapping[str, str], file: str) -> str:
    """``text`` with every ``$(…)`` replaced; ``file`` is where it stands, for ``$(dirname)``.

    Raises ValueError with advice when a command is unknown or cannot be resolved. ``$(eval)``
    is refused: a configuration is data and runs no code.
    """
    if '$(' not in text:
        return text
    for command, _ in _COMMAND.findall(text):
        if command not in _ALLOWED:
            raise ValueError(f'$({command} …) cannot be used here; '
                             + advice(command, _ALLOWED))
    context: Dict[str, object] = {'arg': dict(arguments), 'filename': file}
    try:
        return str(resolve_args(text, context=context, resolve_anon=False))
    except rospkg.ResourceNotFound:
        raise ValueError(f'"{text}": ' + _missing_package(text)) from None
    except SubstitutionException as error:
        raise ValueError(f'"{text}": {_reason(text, error, arguments)}') from None


def package_advice(package: str) -> str:
    """What to do about a package that is not there."""
    name = nearest(package, rospkg.RosPack().list())
    meant = f'did you mean "{name}"? Otherwise ' if name else ''
    return f'there is no package "{package}"; {meant}install it or source the workspace that has it'


def _missing_package(text: str) -> str:
    packages = rospkg.RosPack().list()
    names = [name for command, name in _COMMAND.findall(text) if command == 'find']
    return package_advice(next((name for name in names if name not in packages), names[0]))


def _reason(text: str, error: Exception, arguments: Mapping[str, str]) -> str:
    names = [name for command, name in _COMMAND.findall(text) if command == 'arg']
    unknown = [name for name in names if name not in arguments]
    if not unknown:
        return str(error)
    known = advice(unknown[0], arguments) if arguments else 'no <arg> is declared'
    return f'there is no argument "{unknown[0]}"; {known}'
