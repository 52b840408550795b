# SPDX-License-Identifier: BSD-3-Clause
"""The commands ``cell film`` and ``cell picture``: draw the page of a run, moment by moment."""
from __future__ import annotations

import argparse
import os
import re
import sys
import time
from typing import Dict, List, Optional, Tuple

from process_visualizer.commands.chosen_spans import add_span_options, chosen_spans
from process_visualizer.commands.share_command import add_clouds_option
from process_visualizer.film.film import (
    ENDINGS,
    VIEWS,
    Frame,
    Style,
    ViewAt,
    numbers_beside,
    write_film,
    write_picture,
)
from process_visualizer.health.figures import clock_seconds
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.shown_text import say

_MIN_SIDE, _MAX_SIDE = 160, 4096
_PROGRESS_S = 2.0


def add_film_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell film``."""
    add_span_options(command, 'the film: FILE.mp4 or FILE.gif; a table with the numbers of '
                              'each frame is written beside it')
    command.add_argument('--rate', metavar='HZ', type=float, default=25.0,
                         help='frames in a second (default: 25)')
    command.add_argument('--speed', metavar='TIMES', type=float, default=1.0,
                         help='seconds of the recording per second of the film; 0.25 is slow '
                              'motion')
    command.add_argument('--beside', action='store_true',
                         help='the good run at the left, at the same moment of the process')
    _add_style_options(command)


def add_picture_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell picture``."""
    add_span_options(command, 'the picture: FILE.png')
    command.add_argument('--at', metavar='TIME', required=True,
                         help='of the recording, such as 0:07.4')
    _add_style_options(command)


def _add_style_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('--size', metavar='WxH', type=_size, default=Style().size,
                         help='in pixels (default: 1280x720)')
    command.add_argument('--view', metavar='VIEW[,VIEW@TIME …]', type=_views,
                         default=Style().views,
                         help=f'{", ".join(VIEWS)} (default: {VIEWS[0]}); in a film the camera '
                              'moves to further views at a time of the recording, or at a mark: '
                              'cell,tools@0:07.4,front@needle')
    command.add_argument('--curves', metavar='A,B', default='',
                         help='labels of the curves below; default: all that fit, those that '
                              'differed first')
    command.add_argument('--dark', action='store_true', help='light on dark')
    add_clouds_option(command)


def _style(options: argparse.Namespace) -> Style:
    return Style(options.size, options.view,
                 tuple(it for it in options.curves.split(',') if it), options.dark,
                 options.clouds, getattr(options, 'beside', False))


def execute_film(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the film and, beside it, a table with the numbers of each frame; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a program is missing or fails.
        OSError: a file cannot be written; no part of the film is left.
    """
    ending = os.path.splitext(options.output)[1].lower()
    if ending not in ENDINGS:
        raise ValueError(f'{options.output}: name a file that ends in {" or ".join(ENDINGS)}')
    if not 0.1 <= options.rate <= 120.0 or not 0.001 <= options.speed <= 1000.0:
        raise ValueError('write a --rate from 0.1 to 120 and a --speed from 0.001 to 1000')
    if ending == '.mp4' and (options.size[0] % 2 or options.size[1] % 2):
        raise ValueError('the sides of an mp4 have even numbers of pixels')
    count = write_film(options.output, chosen_spans(options, arguments), _style(options),
                       options.rate, options.speed, _Progress().show)
    say(f'{options.output}: {count} frames, {clock(count / options.rate)}; '
        f'{numbers_beside(options.output)} has the numbers of each frame')
    return 0


def execute_picture(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write one picture; return 0.

    Raises:
        BagError, ConfigurationError, ValueError, OSError: as for ``execute_film``.
    """
    if not options.output.lower().endswith('.png'):
        raise ValueError(f'{options.output}: name a file that ends in .png')
    at_s = clock_seconds(options.at)
    chosen = chosen_spans(options, arguments)
    number = next((row for row, span in enumerate(chosen.spans)
                   if span.begin_s <= at_s <= span.end_s), None)
    if number is None:
        raise ValueError('; '.join(
            f'{run.name} goes from {clock(span.begin_s)} to {clock(span.end_s)}'
            for run, span in zip(chosen.runs, chosen.spans)) + f', and {clock(at_s)} is outside')
    write_picture(options.output, chosen, _style(options), Frame(number, at_s))
    say(f'{options.output}: {chosen.runs[number].name} at {clock(at_s)}')
    return 0


class _Progress:
    """Reports from time to time the number of finished frames and the remaining time."""

    def __init__(self) -> None:
        self._begin_s = self._reported_s = time.monotonic()

    def show(self, done: int, count: int) -> None:
        now_s = time.monotonic()
        if done == 1:
            self._begin_s = now_s  # the work before the first frame does not count
        if now_s - self._reported_s < _PROGRESS_S or done in (1, count):
            return
        self._reported_s = now_s
        left_s = (now_s - self._begin_s) / (done - 1) * (count - done)
        say(f'{done} of {count} frames, {clock(left_s)[:-3]} left', file=sys.stderr)


def _views(text: str) -> Tuple[ViewAt, ...]:
    found: List[ViewAt] = []
    for word in text.split(','):
        view, has_time, at = word.partition('@')
        if view not in VIEWS or bool(has_time) != bool(at) or bool(at) != bool(found):
            raise argparse.ArgumentTypeError(
                f'"{word}": write one of {", ".join(VIEWS)}, and for further views VIEW@TIME or '
                'VIEW@MARK, such as cell,tools@0:07.4')
        found.append(ViewAt(view, at))
    return tuple(found)


def _size(text: str) -> Tuple[int, int]:
    found = re.fullmatch(r'(\d{2,5})x(\d{2,5})', text)
    size: Optional[Tuple[int, int]] = None if found is None else (
        int(found.group(1)), int(found.group(2)))
    if size is None or not all(_MIN_SIDE <= it <= _MAX_SIDE for it in size):
        raise argparse.ArgumentTypeError(
            f'write width and height from {_MIN_SIDE} to {_MAX_SIDE} pixels, such as 1280x720')
    return size
