# SPDX-License-Identifier: BSD-3-Clause
"""Each source file names the project's license."""
from __future__ import annotations

import subprocess
from pathlib import Path
from typing import List

REPOSITORY = Path(__file__).resolve().parents[2]
LINE = 'SPDX-License-Identifier: BSD-3-Clause'
ENDINGS = ('.py', '.cpp', '.hpp', '.cmake', '.sh')
SHEBANG = b'#!'


def sources() -> List[Path]:
    """The programs and modules under git control."""
    listed = subprocess.run(['git', 'ls-files', '-z'], cwd=REPOSITORY, stdout=subprocess.PIPE,
                            check=False).stdout.decode().split('\0')
    paths = [REPOSITORY / name for name in listed if name]
    return [path for path in paths if path.is_file() and not path.is_symlink()
            and (path.suffix in ENDINGS or path.read_bytes()[:2] == SHEBANG)]


def test_each_source_names_the_license() -> None:
    assert sources()
    assert [str(path) for path in sources()
            if not any(LINE in line for line in path.read_text('utf-8').splitlines()[:2])] == []
