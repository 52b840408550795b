# SPDX-License-Identifier: BSD-3-Clause
"""Prints the failed tests of all JUnit files below a folder, and counts; exit code 1 if one failed.

    count_tests.py FOLDER [STEP …]

The steps are the parts of ./run_tests that failed. One without a failed test, such as a checker or
a program that died before it reported its tests, counts as a failure itself.
"""
from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import List, NamedTuple, Sequence
from xml.etree import ElementTree

_WRAPPER = 'rostest-'
"""Prefix of the files in which rostest reports whether a test's program ran at all."""

_MESSAGE_LINES = 25


class Case(NamedTuple):
    """A test, its result (passed, failed or skipped), and the message of a failure."""

    name: str
    outcome: str
    message: str = ''


def cases_in(path: Path) -> List[Case]:
    """The tests in a JUnit file, without the entries about programs that ran."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError:
        return [Case(f'{path.name}: cannot be read', 'failed')]
    cases = [Case(f'{it.get("classname")}::{it.get("name")}', _outcome(it), _message(it))
             for it in root.iter('testcase')]
    cases += _failures_without_case(root, cases)
    if path.name.startswith(_WRAPPER):
        return [case for case in cases if case.outcome != 'passed']
    return cases


def failures_in(cases: Sequence[Case]) -> List[Case]:
    """Return the failed tests."""
    return [case for case in cases if case.outcome == 'failed']


def _outcome(case: ElementTree.Element) -> str:
    if case.find('failure') is not None or case.find('error') is not None:
        return 'failed'
    skipped = case.find('skipped') is not None or case.get('status') == 'notrun'
    return 'skipped' if skipped else 'passed'


def _message(case: ElementTree.Element) -> str:
    """Return the end of the message of a failure; its beginning is in the output of the test."""
    said = [it for it in case if it.tag in ('failure', 'error')]
    texts = [f'{it.get("message") or ""}\n{it.text or ""}' for it in said]
    return '\n'.join('\n'.join(text.strip().splitlines()[-_MESSAGE_LINES:]) for text in texts)


def _failures_without_case(root: ElementTree.Element, cases: Sequence[Case]) -> List[Case]:
    """Return failures that a suite counts without a case, such as unittest's of setUpClass."""
    suites = [root] if root.tag == 'testsuite' else root.findall('testsuite')
    counted = sum(int(suite.get(kind) or 0) for suite in suites for kind in ('errors', 'failures'))
    names = [suite.get('name') or '' for suite in suites]
    return [Case(f'{", ".join(names)}: set-up', 'failed')] * (counted - len(failures_in(cases)))


def main() -> int:
    """Print the names of failed tests and the line of counts; return the exit code."""
    folder, steps = Path(sys.argv[1]), sys.argv[2:]
    files = [cases_in(path) for path in sorted(folder.rglob('*.xml'))]
    for case in [case for cases in files for case in failures_in(cases)]:
        print('FAILED', case.name)
        for line in case.message.splitlines():
            print('   ', line)
    for step in steps:
        print('FAILED step', step)
    counts = Counter(case.outcome for cases in files for case in cases)
    silent = max(0, len(steps) - sum(bool(failures_in(cases)) for cases in files))
    failed = counts['failed'] + silent
    skipped = f', {counts["skipped"]} skipped' if counts['skipped'] else ''
    print(f'{counts["passed"]} passed, {failed} failed{skipped}')
    return 1 if failed or not counts['passed'] else 0


if __name__ == '__main__':
    sys.exit(main())
