"""Counts the tests of all JUnit files below a folder; exit code 1 if one failed or none ran."""
from __future__ import annotations

import sys
from pathlib import Path
from typing import Tuple
from xml.etree import ElementTree


def outcome(case: ElementTree.Element) -> str:
    """What became of a test case."""
    if case.find('failure') is not None or case.find('error') is not None:
        return 'failed'
    skipped = case.find('skipped') is not None or case.get('status') == 'notrun'
    return 'skipped' if skipped else 'passed'


def count(folder: Path) -> Tuple[int, int, int]:
    """Passed, failed and skipped cases; a case without content counts once."""
    outcomes = [outcome(case) for path in sorted(folder.rglob('*.xml'))
                for case in ElementTree.parse(path).iter('testcase')]
    return (outcomes.count('passed'), outcomes.count('failed'), outcomes.count('skipped'))


def main() -> int:
    """Print the line that counts; returns the exit code."""
    passed, failed, skipped = count(Path(sys.argv[1]))
    print(f'{passed} passed, {failed} failed' + (f', {skipped} skipped' if skipped else ''))
    return 1 if failed or not passed else 0


if __name__ == '__main__':
    sys.exit(main())
