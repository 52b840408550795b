# SPDX-License-Identifier: BSD-3-Clause
"""The line that counts the tests: of pytest, GoogleTest and rostest, and of steps without tests."""
from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import List

SCRIPT = Path(__file__).parents[2] / 'scripts' / 'count_tests.py'
PASSED, FAILED = '<testcase classname="a" name="good"/>', \
    '<testcase classname="a" name="bad"><failure type="x">no</failure></testcase>'
ERROR = '<testcase classname="a" name="ugly"><error type="x">no</error></testcase>'


def suite(*cases: str, failures: int = 0, errors: int = 0) -> str:
    return (f'<testsuite name="suite" failures="{failures}" errors="{errors}">'
            + ''.join(cases) + '</testsuite>')


def counted(folder: Path, code: int, *steps: str) -> List[str]:
    """The printed lines."""
    done = subprocess.run([sys.executable, str(SCRIPT), str(folder), *steps],
                          stdout=subprocess.PIPE, text=True, check=False)
    assert done.returncode == code, done.stdout
    return done.stdout.splitlines()


def test_all_kinds_of_files_count(tmp_path: Path) -> None:
    (tmp_path / 'unit.xml').write_text(f'<testsuites>{suite(PASSED, PASSED)}</testsuites>')
    (tmp_path / 'package').mkdir()
    (tmp_path / 'package' / 'rosunit-a.xml').write_text(suite(PASSED))
    assert counted(tmp_path, 0) == ['3 passed, 0 failed']


def test_the_failed_ones_are_named(tmp_path: Path) -> None:
    (tmp_path / 'unit.xml').write_text(suite(PASSED, FAILED, ERROR, failures=1, errors=1))
    assert counted(tmp_path, 1, 'unit tests') == [
        'FAILED a::bad', '    no', 'FAILED a::ugly', '    no', 'FAILED step unit tests',
        '1 passed, 2 failed']


def test_the_end_of_what_was_said_of_a_failure_is_told_again(tmp_path: Path) -> None:
    said = '\n'.join(f'line {number}' for number in range(100))
    (tmp_path / 'unit.xml').write_text(
        suite(f'<testcase classname="a" name="b"><failure message="m">{said}</failure></testcase>'))
    assert counted(tmp_path, 1)[:26] == [
        'FAILED a::b', *(f'    line {number}' for number in range(75, 100))]


def test_that_a_program_ran_is_no_test_but_that_it_did_not_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / 'rostest-a.xml').write_text(suite(PASSED))
    (tmp_path / 'rosunit-a.xml').write_text(suite(PASSED))
    (tmp_path / 'rostest-b.xml').write_text(suite(FAILED, failures=1))
    assert counted(tmp_path, 1, 'b.test')[-1] == '1 passed, 1 failed'


def test_a_set_up_that_failed_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / 'rosunit-a.xml').write_text(suite(PASSED, errors=1))
    assert counted(tmp_path, 1, 'a.test') == [
        'FAILED suite: set-up', 'FAILED step a.test', '1 passed, 1 failed']


def test_a_step_without_tests_counts_once(tmp_path: Path) -> None:
    (tmp_path / 'unit.xml').write_text(suite(PASSED, FAILED, failures=1))
    assert counted(tmp_path, 1, 'ruff', 'unit tests')[-1] == '1 passed, 2 failed'


def test_what_was_left_out_is_told(tmp_path: Path) -> None:
    left_out = ('<testcase classname="a" name="b"><skipped/></testcase>',
                '<testcase classname="a" name="c" status="notrun"/>')
    (tmp_path / 'unit.xml').write_text(suite(PASSED, *left_out))
    assert counted(tmp_path, 0) == ['1 passed, 0 failed, 2 skipped']


def test_a_file_that_is_cut_off_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / 'unit.xml').write_text(suite(PASSED)[:-5])
    assert counted(tmp_path, 1) == ['FAILED unit.xml: cannot be read', '0 passed, 1 failed']


def test_nothing_is_no_success(tmp_path: Path) -> None:
    assert counted(tmp_path, 1) == ['0 passed, 0 failed']
