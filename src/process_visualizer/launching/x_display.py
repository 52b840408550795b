# SPDX-License-Identifier: BSD-3-Clause
"""A check for the display of an X server, on which windows appear."""
from __future__ import annotations

import ctypes
import os
from typing import Mapping

from process_visualizer.shown_text import shown


class NoDisplay(OSError):
    """Raised if no window can be shown; the text says why, and what to do."""


def require_display(instead: str = '', environment: Mapping[str, str] = os.environ) -> None:
    """Check that a window can be shown; otherwise Qt and RViz would abort.

    ``instead`` is a text on what else can be done.

    Raises:
        NoDisplay: the environment names no X server, or one that does not answer.
    """
    if environment.get('QT_QPA_PLATFORM', 'xcb') != 'xcb' or environment.get('WAYLAND_DISPLAY'):
        return
    name = environment.get('DISPLAY', '')
    if name and _answers(name):
        return
    problem = f'the display {shown(name)} (DISPLAY) does not answer' if name \
        else 'there is no display (DISPLAY is not set)'
    advice = 'start it on a desktop, or over ssh with "ssh -X"'
    raise NoDisplay(f'no window can be shown: {problem}; {advice}{instead}')


def _answers(name: str) -> bool:
    try:
        x11 = ctypes.CDLL('libX11.so.6')
    except OSError:
        return True  # Qt and RViz say what is missing
    x11.XOpenDisplay.argtypes, x11.XOpenDisplay.restype = [ctypes.c_char_p], ctypes.c_void_p
    x11.XCloseDisplay.argtypes, x11.XCloseDisplay.restype = [ctypes.c_void_p], ctypes.c_int
    display = x11.XOpenDisplay(os.fsencode(name))
    if display:
        x11.XCloseDisplay(display)
    return bool(display)
