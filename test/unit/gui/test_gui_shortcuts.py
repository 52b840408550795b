# SPDX-License-Identifier: BSD-3-Clause
"""The displayed keys, and that each has one meaning at a time."""
from __future__ import annotations

from typing import List
from unittest.mock import Mock

from process_visualizer.gui.app.shortcuts import (
    Shortcut,
    general_keys,
    help_text,
    playback_keys,
    recording_keys,
)


def keys_of(shortcuts: List[Shortcut]) -> List[str]:
    return [shortcut.key for shortcut in shortcuts]


def test_no_key_means_two_things_at_once() -> None:
    general = keys_of(general_keys(Mock(), Mock(), Mock()))
    for others in (playback_keys(Mock(), Mock(), Mock()), recording_keys(Mock(), Mock())):
        keys = [*keys_of(others), *general]
        assert len(set(keys)) == len(keys)


def test_m_adds_a_mark_in_playback() -> None:
    add_mark = Mock()
    [key] = [it for it in playback_keys(Mock(), add_mark, Mock()) if it.key == 'M']
    key.action()
    add_mark.assert_called_once_with()


def test_keys_that_do_the_same_share_a_row() -> None:
    text = help_text({'Playback': playback_keys(Mock(), Mock(), Mock()), 'Recording': []})
    assert text.count('one step back') == 1
    assert 'Left&nbsp;&nbsp;,' in text
    assert '<b>Playback</b>' in text and '<b>Recording</b>' in text
