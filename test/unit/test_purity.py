# SPDX-License-Identifier: BSD-3-Clause
"""The pure parts need neither ROS nodes nor Qt: no import says so, and none drags them in."""
import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Iterator, List

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / 'src'
PACKAGES = (ROOT / 'test/pure_folders.txt').read_text(encoding='utf-8').split()
MODULES = tuple(f'gui/models/playback/{name}.py' for name in (
    'playback_state', 'playback_position', 'loop_points', 'marks', 'step_unit'))
"""Values in a package of Qt's objects."""
FORBIDDEN = ('rospy', 'PyQt5')


def pure_modules() -> List[Path]:
    root = SOURCE / 'process_visualizer'
    paths = [path for package in PACKAGES for path in sorted((root / package).rglob('*.py'))]
    return paths + [root / name for name in MODULES]


def imported_names(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE).with_suffix('').parts
    return '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)


def test_the_type_checker_is_strict_with_the_same_packages() -> None:
    settings = (ROOT / 'pyproject.toml').read_text(encoding='utf-8')
    assert re.findall(r'"process_visualizer\.(\w+)\.\*"', settings) == PACKAGES


def test_some_modules_are_found() -> None:
    assert len(pure_modules()) > 5


@pytest.mark.parametrize('path', pure_modules(), ids=module_name)
def test_no_forbidden_import_is_written(path: Path) -> None:
    roots = {name.split('.')[0] for name in imported_names(path)}
    assert not roots & set(FORBIDDEN)


def test_no_forbidden_module_is_loaded() -> None:
    """Imports all of them in a process of their own and names each that loads what it must not."""
    script = (
        'import importlib, sys\n'
        'for name in sys.argv[1:]:\n'
        '    importlib.import_module(name)\n'
        f'    found = [it for it in {FORBIDDEN!r} if it in sys.modules]\n'
        '    if found:\n'
        '        sys.exit(f"{name} loads {found}")\n')
    names = [module_name(path) for path in pure_modules()]
    result = subprocess.run([sys.executable, '-c', script, *names], cwd=SOURCE, text=True,
                            stderr=subprocess.PIPE, check=False, timeout=60)
    assert result.returncode == 0, result.stderr
