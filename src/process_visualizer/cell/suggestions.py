# SPDX-License-Identifier: BSD-3-Clause
"""Finds the name that somebody probably meant."""
from __future__ import annotations

import difflib
from pathlib import Path
from typing import Iterable, Optional

_LIKENESS = 0.6


def nearest(word: str, names: Iterable[str]) -> Optional[str]:
    """The name most similar to ``word`` (ignoring case), or None."""
    by_lower_case = {name.lower(): name for name in names}
    found = difflib.get_close_matches(word.lower(), list(by_lower_case), n=1, cutoff=_LIKENESS)
    return by_lower_case[found[0]] if found else None


def advice(word: str, names: Iterable[str]) -> str:
    """Return what to write instead of ``word``: the nearest name, or otherwise all of them."""
    known = sorted(names)
    name = nearest(word, known)
    if name is not None:
        return f'did you mean "{name}"?'
    return 'expected one of: ' + ', '.join(known)


def root_as_global_frame(device: str, root: str) -> str:
    """Return what to do about a model whose root link has the name of the global frame."""
    return (f'as that is the global frame, write prefix="{device}_" in <model> and '
            f'frame="{device}_{root}" in <base>, or call the global frame otherwise: '
            '<visualizer frame="cell">')


def missing_file(path: str) -> str:
    """A message that the file does not exist, and what to name instead."""
    file = Path(path)
    if not file.parent.is_dir():
        return f'there is no file "{file}", nor its folder; check the path'
    name = nearest(file.name, (other.name for other in file.parent.iterdir()))
    meant = 'check the path' if name is None else f'did you mean "{file.with_name(name)}"?'
    return f'there is no file "{file}"; {meant}'
