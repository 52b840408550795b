# SPDX-License-Identifier: BSD-3-Clause
"""Prints the share of each folder's lines and branches that the tests have run.

    report_coverage.py FILE …

The files are slipcover's; a line counts as covered if it was run in one of them.
"""
from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any, DefaultDict, Dict, List, NamedTuple, Set

KINDS = ('lines', 'branches')
SOURCES = 'src/process_visualizer/'


class Share(NamedTuple):
    """Numbers of covered and of all lines or branches."""

    run: int
    all: int

    def __str__(self) -> str:
        return f'{100.0 * self.run / self.all:5.1f} % of {self.all}' if self.all else 'none'


def shares(reports: List[Dict[str, Any]], kind: str) -> Dict[str, Share]:
    """Return the coverage of the lines or branches of each folder."""
    executed: DefaultDict[str, Set[Any]] = defaultdict(set)
    every: DefaultDict[str, Set[Any]] = defaultdict(set)
    for report in reports:
        for path, file in report['files'].items():
            inside = path.rpartition(SOURCES)[2] if SOURCES in path else ''
            if not inside:
                continue  # of another folder, such as generated messages
            folder = inside.partition('/')[0]
            found = {(inside, str(it)) for it in file[f'executed_{kind}']}
            executed[folder] |= found
            every[folder] |= found | {(inside, str(it)) for it in file[f'missing_{kind}']}
    return {folder: Share(len(executed[folder]), len(every[folder])) for folder in sorted(every)}


def main() -> None:
    """Print a line for each folder and one for all."""
    reports = [json.loads(Path(path).read_text(encoding='utf-8')) for path in sys.argv[1:]]
    lines, branches = (shares(reports, kind) for kind in KINDS)
    for folder in lines:
        print(f'{folder:14} lines {str(lines[folder]):18} branches {branches[folder]}')
    total = [Share(sum(it.run for it in kind.values()), sum(it.all for it in kind.values()))
             for kind in (lines, branches)]
    print(f'{"the pure parts":14} lines {str(total[0]):18} branches {total[1]}')


if __name__ == '__main__':
    main()
