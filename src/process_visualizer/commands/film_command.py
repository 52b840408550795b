# SPDX-License-Identifier: BSD-3-Clause
"""The commands ``cell film`` and ``cell picture``: the page of a run, drawn moment by moment."""
from __future__ import annotations

import argparse
import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Dict, List, NamedTuple, Optional, Tuple

from process_visualizer.commands.chosen_spans import ChosenSpans, add_span_options, chosen_spans
from process_visualizer.commands.share_command import add_clouds_option, page_of
from process_visualizer.health.figures import clock_seconds
from process_visualizer.runs.comparison.wording import clock
from process_visualizer.shown_text import say
from process_visualizer.whole_file import whole_file, write_text

VIEWS = ('cell', 'tools', 'front', 'side', 'top')
_FILM = 'film'
_MIN_SIDE, _MAX_SIDE = 160, 4096
_MAX_FRAMES = 60_000
_PROGRESS_S = 2.0
_ENCODERS: Dict[str, Tuple[str, ...]] = {
    '.mp4': ('-c:v', 'libx264', '-pix_fmt', 'yuv420p', '-crf', '18', '-movflags', '+faststart',
             '-f', 'mp4'),
    '.gif': ('-filter_complex', 'split[one][other];[one]palettegen[colors];[other][colors]'
             'paletteuse', '-f', 'gif')}


def add_film_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell film``."""
    add_span_options(command, 'the film: FILE.mp4 or FILE.gif; a table with the numbers of '
                              'each frame is written beside it')
    command.add_argument('--rate', metavar='HZ', type=float, default=25.0,
                         help='frames in a second (default: 25)')
    command.add_argument('--speed', metavar='TIMES', type=float, default=1.0,
                         help='seconds of the recording per second of the film; 0.25 is slow '
                              'motion')
    _add_style_options(command)


def add_picture_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell picture``."""
    add_span_options(command, 'the picture: FILE.png')
    command.add_argument('--at', metavar='TIME', required=True,
                         help='of the recording, such as 0:07.4')
    _add_style_options(command)


def _add_style_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('--size', metavar='WxH', type=_size, default=(1280, 720),
                         help='in pixels (default: 1280x720)')
    command.add_argument('--view', choices=VIEWS, default='cell')
    command.add_argument('--curves', metavar='A,B', default='',
                         help='labels of the curves below; default: all that fit, those that '
                              'differed first')
    command.add_argument('--dark', action='store_true', help='light on dark')
    add_clouds_option(command)


class Frame(NamedTuple):
    """A moment of a film."""

    run: int
    time_s: float


def film_frames(chosen: ChosenSpans, rate_hz: float, speed: float) -> List[Frame]:
    """Return the moments of a film: of each run round(duration · rate / speed) frames."""
    return [Frame(number, span.begin_s + row * speed / rate_hz)
            for number, span in enumerate(chosen.spans)
            for row in range(max(round((span.end_s - span.begin_s) * rate_hz / speed), 1))]


def execute_film(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the film, and beside it a table with the numbers of each frame; return 0.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: an option is out of range, or a program is missing or fails.
        OSError: a file cannot be written; nothing of the film is left then.
    """
    ending = os.path.splitext(options.output)[1].lower()
    if ending not in _ENCODERS:
        raise ValueError(f'{options.output}: name a file that ends in {" or ".join(_ENCODERS)}')
    if not 0.1 <= options.rate <= 120.0 or not 0.001 <= options.speed <= 1000.0:
        raise ValueError('write a --rate from 0.1 to 120 and a --speed from 0.001 to 1000')
    if ending == '.mp4' and (options.size[0] % 2 or options.size[1] % 2):
        raise ValueError('the sides of an mp4 have even numbers of pixels')
    encoder = shutil.which('ffmpeg')
    if encoder is None:
        raise ValueError('ffmpeg makes the film, and is missing; install it (Debian: "apt install '
                         'ffmpeg")')
    chosen = chosen_spans(options, arguments)
    frames = film_frames(chosen, options.rate, options.speed)
    if len(frames) > _MAX_FRAMES:
        raise ValueError(f'{len(frames)} frames are more than {_MAX_FRAMES}; name a part with '
                         '--from and --to, or a lower --rate')
    table = io.StringIO()
    with whole_file(options.output) as unfinished, ExitStack() as stack:
        process = stack.enter_context(_encoder(encoder, options.rate, ending, unfinished))
        try:
            _draw(options, chosen, frames, _pipe(process), table)
        except BrokenPipeError:
            raise ValueError(f'ffmpeg has ended: {_said(process)}') from None
        except BaseException:
            process.kill()
            raise
        _pipe(process).close()
        problem = _said(process)
        if process.wait() != 0:
            raise ValueError(f'ffmpeg cannot make the film: {problem}')
    numbers = f'{os.path.splitext(options.output)[0]}.csv'
    write_text(numbers, table.getvalue())
    say(f'{options.output}: {len(frames)} frames, {clock(len(frames) / options.rate)}; '
        f'{numbers} has the numbers of each frame')
    return 0


def execute_picture(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write one picture; return 0.

    Raises:
        BagError, ConfigurationError, ValueError, OSError: as ``execute_film``.
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
    with whole_file(options.output) as unfinished, open(unfinished, 'wb') as file:
        _draw(options, chosen, [Frame(number, at_s)], file, io.StringIO())
    say(f'{options.output}: {chosen.runs[number].name} at {clock(at_s)}')
    return 0


def _draw(options: argparse.Namespace, chosen: ChosenSpans, frames: List[Frame],
          pictures: IO[bytes], table: IO[str]) -> None:
    """Write the picture of each frame, and its row of the table."""
    # Other commands begin 50 ms earlier without it.
    from process_visualizer.commands.headless_browser import BrowserError, HeadlessBrowser
    progress = _Progress(len(frames))
    rows: List[Dict[str, str]] = []
    try:
        with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
            page = Path(folder) / 'page.html'
            write_text(str(page), page_of(chosen, options.clouds))
            with HeadlessBrowser(page, options.size, _FILM) as browser:
                style = {'view': options.view, 'dark': options.dark,
                         'curves': [it for it in options.curves.split(',') if it]}
                browser.evaluate(f'page.film({json.dumps(style)})')
                for number, frame in enumerate(frames):
                    said = browser.evaluate(
                        f'page.filmFrame({frame.run}, {json.dumps(frame.time_s)})')
                    pictures.write(browser.picture())
                    rows.append({
                        'frame': str(number), 'run': chosen.runs[frame.run].name,
                        'time [s]': f'{frame.time_s:.6f}',
                        **{f'{device} {what}': text for device, what, text in said}})
                    progress.show(number + 1)
    except BrowserError as error:
        raise ValueError(str(error)) from error
    writer = csv.DictWriter(table, list(dict.fromkeys(name for row in rows for name in row)))
    writer.writeheader()
    writer.writerows(rows)


def _encoder(program: str, rate_hz: float, ending: str, path: str) -> 'subprocess.Popen[bytes]':
    return subprocess.Popen(
        [program, '-y', '-hide_banner', '-loglevel', 'error', '-f', 'image2pipe', '-framerate',
         f'{rate_hz:g}', '-c:v', 'png', '-i', '-', *_ENCODERS[ending], path],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def _pipe(process: 'subprocess.Popen[bytes]') -> IO[bytes]:
    assert process.stdin is not None
    return process.stdin


def _said(process: 'subprocess.Popen[bytes]') -> str:
    assert process.stderr is not None
    return process.stderr.read().decode('utf-8', 'replace').strip().replace('\n', '; ')


class _Progress:
    """Says now and then how many frames are done, and how long the others will take."""

    def __init__(self, count: int) -> None:
        self._count, self._begin_s = count, time.monotonic()
        self._said_s = self._begin_s

    def show(self, done: int) -> None:
        now_s = time.monotonic()
        if now_s - self._said_s < _PROGRESS_S or done == self._count:
            return
        self._said_s = now_s
        left_s = (now_s - self._begin_s) / done * (self._count - done)
        say(f'{done} of {self._count} frames, {clock(left_s)[:-3]} left', file=sys.stderr)


def _size(text: str) -> Tuple[int, int]:
    found = re.fullmatch(r'(\d{2,5})x(\d{2,5})', text)
    size: Optional[Tuple[int, int]] = None if found is None else (
        int(found.group(1)), int(found.group(2)))
    if size is None or not all(_MIN_SIDE <= it <= _MAX_SIDE for it in size):
        raise argparse.ArgumentTypeError(
            f'write width and height from {_MIN_SIDE} to {_MAX_SIDE} pixels, such as 1280x720')
    return size
