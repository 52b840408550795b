# SPDX-License-Identifier: BSD-3-Clause
"""The model files of all packages: which may be that of a robot, by its name or its joints."""
from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Collection, Dict, Iterator, List, Optional, Pattern, Tuple

import rospkg

_ROBOT = re.compile(r'<robot\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_JOINT = re.compile(r'<joint\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_ARGUMENT = re.compile(r'<xacro:arg\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_EXPRESSION = re.compile(r'\$\{[^}]*\}|\$\([^)]*\)')
_ENDINGS = ('.urdf', '.xacro')
_DEEPEST, _LARGEST_BYTES = 4, 2 << 20
_NO_MODELS = ('test', 'tests', 'bench', 'build')
_SAFE_PATH = re.compile(r'[\w. /+-]+\Z')


@dataclass(frozen=True)
class ModelFile:
    """A URDF or xacro file that may be a whole robot: ``name`` as its <robot> says.

    ``arguments`` are the names of those that xacro takes.
    """

    package: str
    path: str
    name: str
    folder: str
    arguments: Tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Its absolute path."""
        return os.path.join(self.folder, self.path)

    @property
    def stem(self) -> str:
        """The name of the file without its endings."""
        return os.path.basename(self.path).partition('.')[0]


class ModelFiles:
    """The model files of the packages that ROS finds; each package is looked into once."""

    def __init__(self, packages: Optional[rospkg.RosPack] = None) -> None:
        self._packages = packages or rospkg.RosPack()
        self._files: Optional[List[ModelFile]] = None
        self._joints: Dict[str, List[Pattern[str]]] = {}

    def all(self) -> List[ModelFile]:
        """Return the files of all packages, by their names."""
        if self._files is None:
            self._files = [it for package in sorted(self._packages.list())
                           for it in self._look_into(package)]
        return self._files

    def count_of(self, package: str, joints: Collection[str]) -> int:
        """Return how many of these joints the files of a package may have, by the names in them."""
        patterns = self._joints.get(package, [])
        return sum(any(pattern.fullmatch(joint) for pattern in patterns) for joint in joints)

    def _look_into(self, package: str) -> Iterator[ModelFile]:
        folder = str(self._packages.get_path(package))
        for path in _model_paths(folder):
            text = _text(os.path.join(folder, path))
            self._joints.setdefault(package, []).extend(_patterns(text))
            robot = _ROBOT.search(text)
            # a name that is an expression needs arguments that only a launch file knows
            if robot is not None and '$' not in robot.group(1) and _SAFE_PATH.match(path):
                arguments = tuple(dict.fromkeys(_ARGUMENT.findall(text)))
                yield ModelFile(package, path, robot.group(1), folder, arguments)


def _patterns(text: str) -> List[Pattern[str]]:
    """The names of joints in a file, with any prefix, and any text for what xacro fills in."""
    names = {_EXPRESSION.sub('*', name) for name in _JOINT.findall(text)}
    return [re.compile('.*' + '.*'.join(map(re.escape, name.split('*'))))
            for name in sorted(names)]


def _model_paths(folder: str) -> Iterator[str]:
    for top, folders, names in os.walk(folder):
        below = os.path.relpath(top, folder)
        is_deep = below.count(os.sep) + 1 >= _DEEPEST
        folders[:] = [] if is_deep else sorted(
            it for it in folders if not it.startswith('.') and it not in _NO_MODELS
            and not os.path.isfile(os.path.join(top, it, 'package.xml')))
        for name in sorted(names):
            if name.endswith(_ENDINGS):
                yield os.path.normpath(os.path.join(below, name))


def _text(file: str) -> str:
    """The text of a file; nothing of one that cannot be read."""
    try:
        with open(file, encoding='utf-8', errors='replace') as stream:
            return stream.read(_LARGEST_BYTES)
    except OSError:
        return ''
