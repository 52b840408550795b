# SPDX-License-Identifier: BSD-3-Clause
"""Write one translation unit for each folder of C++ sources, for clang-tidy, largest first.

usage: python3 scripts/tidy_units.py BUILD FOLDER

Nearly all of clang-tidy's time goes into the headers of ROS and PCL: one unit that includes all
sources of a folder reads them once. BUILD is catkin's build folder with compile_commands.json;
FOLDER receives the units, their compile_commands.json and clang-tidy's settings. Prints the units.
"""
from __future__ import annotations

import json
import os
import re
import shutil
import sys
from collections import defaultdict
from pathlib import Path
from typing import Dict, List

REPOSITORY = Path(__file__).resolve().parents[1]
INCLUDE = '#include "{}"  // NOLINT(bugprone-suspicious-include)\n'
INCLUDED = re.compile(r'^#include "(/.*)"$', re.MULTILINE)
Command = Dict[str, str]


def sources(commands: List[Command]) -> Dict[Path, Dict[str, Command]]:
    """Return a command for each source file, by folder; a source may be in several targets."""
    folders: Dict[Path, Dict[str, Command]] = defaultdict(dict)
    for command in commands:
        for path in compiled(Path(command['file'])):
            if REPOSITORY in path.parents and 'src' in path.relative_to(REPOSITORY).parts:
                folders[path.parent].setdefault(str(path), command)
    return folders


def compiled(file: Path) -> List[Path]:
    """Return the sources that a command compiles: several for a file of the quick build."""
    names = INCLUDED.findall(file.read_text()) if file.parent.name == 'Unity' else [str(file)]
    return [Path(os.path.realpath(name)) for name in names]


def unit_command(unit: Path, commands: Dict[str, Command]) -> Command:
    """Return the command with the most include paths, for a unit."""
    longest = max(commands.values(), key=lambda command: command['command'].count('-isystem'))
    return {**longest, 'file': str(unit),
            'command': longest['command'].replace(longest['file'], str(unit))}


def main() -> None:
    build, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(REPOSITORY / '.clang-tidy', folder)
    commands = []
    found = sources(json.loads((build / 'compile_commands.json').read_text()))
    for name, members in sorted(found.items(), key=lambda item: -len(item[1])):
        unit = folder / ('_'.join(name.relative_to(REPOSITORY).parts) + '.cpp')
        unit.write_text(''.join(INCLUDE.format(path) for path in sorted(members)))
        commands.append(unit_command(unit, members))
        print(unit)
    (folder / 'compile_commands.json').write_text(json.dumps(commands))


if __name__ == '__main__':
    main()
