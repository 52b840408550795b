# SPDX-License-Identifier: BSD-3-Clause
"""The user reference contains what the language defines."""
from pathlib import Path

import pytest

from process_visualizer.cell.elements import DISPLAY_TYPES, TAGS
from process_visualizer.cell.reference_and_schema import updated_reference

REFERENCE = Path(__file__).resolve().parents[3] / 'docs' / 'configuration.md'


def test_tables_are_up_to_date() -> None:
    """Otherwise run scripts/make_reference.py."""
    text = REFERENCE.read_text(encoding='utf-8')
    assert updated_reference(text) == text


@pytest.mark.parametrize('name', sorted(TAGS))
def test_every_tag_has_its_table(name: str) -> None:
    text = REFERENCE.read_text(encoding='utf-8')
    block = text.split(f'<!-- begin {name} -->')[1].split(f'<!-- end {name} -->')[0]
    for attribute in TAGS[name].attributes:
        assert f'`{attribute}`' in block


def test_every_display_type_is_listed() -> None:
    text = REFERENCE.read_text(encoding='utf-8')
    for name in DISPLAY_TYPES:
        assert f'| `{name}` |' in text


def test_a_stale_table_is_made_anew() -> None:
    stale = 'before\n<!-- begin remap -->\nold\n<!-- end remap -->\nafter\n'
    new = updated_reference(stale)
    assert 'old' not in new and '`from`' in new
    assert new.startswith('before\n') and new.endswith('after\n')


def test_an_unknown_block_is_an_error() -> None:
    with pytest.raises(KeyError):
        updated_reference('<!-- begin nonsense -->\n<!-- end nonsense -->\n')
