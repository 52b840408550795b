# SPDX-License-Identifier: BSD-3-Clause
"""Writes the golden files again, from the current output.

Run it in the environment of the workspace and check the changes that git shows:
./scripts/build python3 test/unit/generate/write_golden.py && git diff test/data/golden
"""
from __future__ import annotations

from golden import CASES, FOLDER, golden_texts, make_plan


def main() -> None:
    """Write the files of all cases."""
    for case in CASES:
        for ending, text in golden_texts(make_plan(case)).items():
            path = FOLDER / (case + ending)
            path.write_text(text, encoding='utf-8')
            print(path)


if __name__ == '__main__':
    main()
