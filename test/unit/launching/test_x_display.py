# SPDX-License-Identifier: BSD-3-Clause
"""Windows need a display; a message appears if there is none."""
from __future__ import annotations

from typing import Dict

import pytest

from process_visualizer.launching.x_display import NoDisplay, require_display


@pytest.mark.parametrize('environment, problem', [
    ({}, 'there is no display (DISPLAY is not set)'),
    ({'DISPLAY': ''}, 'there is no display (DISPLAY is not set)'),
    ({'DISPLAY': ':4711'}, 'the display :4711 (DISPLAY) does not answer'),
    ({'DISPLAY': ':4711', 'QT_QPA_PLATFORM': 'xcb'},
     'the display :4711 (DISPLAY) does not answer'),
    ({'DISPLAY': '\x1b[31m'}, 'the display \\x1b[31m (DISPLAY) does not answer')])
def test_what_is_wrong_is_said(environment: Dict[str, str], problem: str) -> None:
    with pytest.raises(NoDisplay) as caught:
        require_display('; or add --no-rviz', environment)
    assert str(caught.value) == (f'no window can be shown: {problem}; start it on a desktop, or '
                                 'over ssh with "ssh -X"; or add --no-rviz')


@pytest.mark.parametrize('environment', [
    {'QT_QPA_PLATFORM': 'offscreen'}, {'WAYLAND_DISPLAY': 'wayland-0'}])
def test_other_platforms_need_none(environment: Dict[str, str]) -> None:
    require_display(environment=environment)
