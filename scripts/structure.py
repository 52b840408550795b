#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints figures about the structure of the code of a checkout: structure.py [FOLDER]."""
from __future__ import annotations

import ast
import sys
from collections import Counter, defaultdict
from pathlib import Path
from statistics import median
from typing import Dict, List, Set, Union

Function = Union[ast.FunctionDef, ast.AsyncFunctionDef]
_SMALL_LINES, _SHORT_LINES = 50, 3


def main() -> None:
    """Print the figures of the checkout in a folder, by default this one."""
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parents[1])
    paths = {'.'.join(it.relative_to(root / 'src').with_suffix('').parts): it
             for it in sorted((root / 'src').rglob('*.py')) if it.name != '__init__.py'}
    lines = {name: len(it.read_text().splitlines()) for name, it in paths.items()}
    trees = {name: ast.parse(it.read_text()) for name, it in paths.items()}
    importers = _importers(trees)
    single = [it for it in paths if len(importers[it]) == 1]
    beside = [it for it in single if _folder(*importers[it]) == _folder(it)]
    private = {name: _private_functions(tree) for name, tree in trees.items()}
    classes = [it for tree in trees.values() for it in ast.walk(tree)
               if isinstance(it, ast.ClassDef)]
    times = Counter(it.name for it in classes)
    members = sorted(((sum(isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef))
                           for part in it.body), it.name) for it in classes), reverse=True)
    cpp = [len(it.read_text().splitlines()) for folder in ('src', 'include')
           for it in (root / folder).rglob('*') if it.suffix in ('.cpp', '.hpp')]
    total = sum(lines.values())
    small = sum(it < _SMALL_LINES for it in lines.values())
    short = sum(_is_short(it) and _uses(trees[name], it.name) == 1
                for name, found in private.items() for it in found)
    print(f'{len(paths)} Python modules, {total} lines, median {median(lines.values()):.0f}, '
          f'{small} below {_SMALL_LINES} lines')
    print(f'{len(single)} imported by one module, {len(beside)} of them in the same folder')
    print(f'{1000 * sum(map(len, private.values())) / total:.1f} private functions per 1,000 '
          f'lines; {short} of up to {_SHORT_LINES} lines that are used once')
    print('class names that exist twice:', ', '.join(sorted(
        name for name, count in times.items() if count > 1)))
    print('classes with most members:', ', '.join(f'{name} {count}' for count, name in members[:6]))
    print(f'{len(cpp)} C++ files, {sum(cpp)} lines, median {median(cpp):.0f}')


def _folder(module: str) -> str:
    return module.rpartition('.')[0]


def _importers(trees: Dict[str, ast.Module]) -> Dict[str, Set[str]]:
    """Return the modules that import each module."""
    found: Dict[str, Set[str]] = defaultdict(set)
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                imported = [node.module, *(f'{node.module}.{it.name}' for it in node.names)]
            elif isinstance(node, ast.Import):
                imported = [it.name for it in node.names]
            else:
                continue
            for it in imported:
                found[it].add(name)
    return found


def _private_functions(tree: ast.Module) -> List[Function]:
    return [it for it in ast.walk(tree) if isinstance(it, (ast.FunctionDef, ast.AsyncFunctionDef))
            and it.name.startswith('_') and not it.name.startswith('__')]


def _is_short(function: Function) -> bool:
    """Return whether a function is short without its docstring."""
    has_docstring = ast.get_docstring(function) is not None and len(function.body) > 1
    body = function.body[1:] if has_docstring else function.body
    end = body[-1].end_lineno
    return end is not None and end - body[0].lineno < _SHORT_LINES


def _uses(tree: ast.Module, name: str) -> int:
    return sum((isinstance(it, ast.Name) and it.id == name)
               or (isinstance(it, ast.Attribute) and it.attr == name) for it in ast.walk(tree))


if __name__ == '__main__':
    main()
