# SPDX-License-Identifier: BSD-3-Clause
"""One list of the pure parts for all checkers, and files that the architecture names."""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (ROOT / 'test/pure_folders.txt').read_text(encoding='utf-8').split()
SETTINGS = (ROOT / 'pyproject.toml').read_text(encoding='utf-8')


def test_the_type_checker_is_strict_with_the_pure_parts() -> None:
    assert re.findall(r'"process_visualizer\.(\w+)\.\*"', SETTINGS) == PACKAGES


def test_the_pure_parts_may_import_neither_rospy_nor_qt() -> None:
    contract = SETTINGS.split('name = "The pure parts')[1].split('[[')[0]
    assert re.findall(r'"process_visualizer\.(\w+)"', contract) == PACKAGES


def test_each_file_that_the_architecture_names_exists() -> None:
    text = (ROOT / 'docs/architecture.md').read_text(encoding='utf-8')
    named = re.findall(r'`((?:[a-z_]+/)+[a-z_]+\.py)`', text)
    assert named
    assert [it for it in named if not any((folder / it).exists() for folder in (
        ROOT / 'src/process_visualizer', ROOT))] == []
