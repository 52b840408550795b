# SPDX-License-Identifier: BSD-3-Clause
"""The folders of the Python package import each other as docs/architecture.md says, and only so."""
from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path
from typing import Dict, Iterator, Set

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = REPOSITORY / 'src' / 'process_visualizer'
FOREIGN = 'ros1_packages'  # stands for a package of ROS 2, and has its name

Rooms = Dict[str, Set[str]]
ROW = re.compile(r'^\| `([a-z/]+)` \|[^|]*\| ([^|]*) \|$', re.MULTILINE)


def imported(path: Path) -> Iterator[Path]:
    """The modules of the package that a module imports, and packages of which it imports names."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.ImportFrom) and (node.module or '').startswith(f'{PACKAGE.name}.'):
            target = PACKAGE.joinpath(*str(node.module).split('.')[1:])
            yield from (target / f'{alias.name}.py' if (target / f'{alias.name}.py').exists()
                        else target.with_suffix('.py') for alias in node.names)


def room(path: Path) -> str:
    return path.parent.relative_to(PACKAGE).as_posix()


def modules() -> Iterator[Path]:
    for path in PACKAGE.rglob('*.py'):
        if FOREIGN not in path.parts and path.parent != PACKAGE:
            yield path


def rooms_of_the_sources() -> Rooms:
    found: Rooms = defaultdict(set)
    for path in modules():
        found[room(path)] |= {room(it) for it in imported(path)} - {room(path), '.'}
    return {name: others for name, others in found.items() if name not in ('gui', 'gui/models',
                                                                          'gui/views')}


def rooms_of_the_document() -> Rooms:
    text = (REPOSITORY / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    return {name: set(re.findall(r'[a-z][a-z/]*', others)) for name, others in ROW.findall(text)}


def test_the_document_says_what_is_imported() -> None:
    assert rooms_of_the_document() == rooms_of_the_sources()


def test_each_room_imports_only_those_above_it() -> None:
    """So there is no circle."""
    above: Set[str] = set()
    for name, others in rooms_of_the_document().items():
        assert others <= above, name
        above.add(name)


def test_each_file_that_the_document_names_exists() -> None:
    text = (REPOSITORY / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    named = re.findall(r'`((?:[a-z_]+/)+[a-z_]+\.py)`', text)
    assert named
    assert [it for it in named if not any((folder / it).exists()
                                          for folder in (PACKAGE, REPOSITORY))] == []
