# SPDX-License-Identifier: BSD-3-Clause
"""Films and pictures of runs: their page, drawn frame by frame."""
from __future__ import annotations

import csv
import io
import json
import math
import os
import shutil
import subprocess
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Callable, Dict, List, NamedTuple, Sequence, TextIO, Tuple

import numpy as np

from process_visualizer.figures import clock_seconds
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.shared_page import ChosenSpans, page_of
from process_visualizer.runs.run import Run
from process_visualizer.whole_file import whole_file, write_text

VIEWS = ('cell', 'tools', 'front', 'side', 'top')
_FILM = 'film'
_MOVE_S = 1.5
"""Duration in a film of a camera move from one view to the next."""
_MAX_FRAMES = 60_000
_MAX_ERROR_BYTES = 2000  # of the output of ffmpeg
_ENCODERS: Dict[str, Tuple[str, ...]] = {
    '.mp4': ('-filter_complex', 'tile={0}x1', '-c:v', 'libx264', '-pix_fmt', 'yuv420p', '-crf',
             '18', '-movflags', '+faststart', '-f', 'mp4'),
    '.gif': ('-filter_complex', 'tile={0}x1,split[one][other];[one]palettegen[colors];'
             '[other][colors]paletteuse', '-f', 'gif')}
"""Arguments of ffmpeg; {0}: number of pictures side by side."""
ENDINGS = tuple(_ENCODERS)
"""Endings of the files of films."""


class ViewAt(NamedTuple):
    """One of VIEWS, to which the camera moves at a time in the recording, or at a mark.

    ``at``: a time such as 0:07.4, or the label of a mark or event; empty: from the start.
    """

    view: str
    at: str = ''


class Style(NamedTuple):
    """The style of a film: width and height [pixels], views, labels of the curves below.

    Without ``curves``, as many curves as fit are shown, those with departures first. ``is_beside``:
    the good run is shown to the left of each run, at the same moment of the process.
    """

    size: Tuple[int, int] = (1280, 720)
    views: Tuple[ViewAt, ...] = (ViewAt(VIEWS[0]),)
    curves: Tuple[str, ...] = ()
    is_dark: bool = False
    with_clouds: bool = False
    is_beside: bool = False


class Frame(NamedTuple):
    """A moment in a run."""

    run: int
    time_s: float


OnFrame = Callable[[int, int], None]
"""Callback with the number of finished frames and of all frames; may raise to end the film."""


def film_frames(chosen: ChosenSpans, rate_hz: float, speed: float) -> List[Frame]:
    """Return the frames of a film: round(duration · rate / speed) for each run.

    Raises:
        ValueError: there are too many frames.
    """
    counts = [max(round((it.end_s - it.begin_s) * rate_hz / speed), 1) for it in chosen.spans]
    if sum(counts) > _MAX_FRAMES:
        raise ValueError(f'{sum(counts)} frames are more than {_MAX_FRAMES}; name a part with '
                         '--from and --to, or a lower --rate')
    return [Frame(number, span.begin_s + row * speed / rate_hz)
            for number, (span, count) in enumerate(zip(chosen.spans, counts))
            for row in range(count)]


_Shots = Sequence[Tuple[Frame, ...]]
"""For each frame of a film, the frames side by side; the run's own frame is the last."""


def beside_good(chosen: ChosenSpans, frames: Sequence[Frame]) -> Tuple[ChosenSpans, _Shots]:
    """Return runs with their good runs, and each frame preceded by the frame of the good run.

    Both frames are at the same moment of the process.

    Raises:
        ValueError: a run has no good run.
    """
    judged = [chosen.judged(it) for it in chosen.runs]
    runs, spans = list(chosen.runs), list(chosen.spans)
    good: List[int] = []
    for one in judged:
        if one.comparison is None or one.good is None:
            raise ValueError(f'nothing can be shown beside {one.run.name}: name a good run with '
                             '--reference')
        reference = one.good.reference
        known = [row for row in range(len(judged), len(runs)) if runs[row] is reference]
        if not known:
            runs.append(reference)
            spans.append(PageSpan(reference.begin_s, reference.begin_s + reference.duration_s))
        good.append(known[0] if known else len(runs) - 1)
    shots = []
    for frame in frames:
        run, comparison, number = runs[frame.run], judged[frame.run].comparison, good[frame.run]
        assert comparison is not None
        time_s = spans[number].begin_s + float(comparison.alignment.time_map.to_reference(
            np.array([frame.time_s - run.begin_s]))[0])
        time_s = min(max(round(time_s, 6), spans[number].begin_s), spans[number].end_s)
        shots.append((Frame(number, time_s), frame))  # rounded as in the table
    for number in range(len(judged), len(runs)):  # only the parts beside a run are shown
        times_s = [beside.time_s for beside, _ in shots if beside.run == number]
        spans[number] = PageSpan(min(times_s), max(times_s))
    return chosen._replace(runs=runs, spans=spans, known=(*chosen.known, *judged)), shots


class CameraMove(NamedTuple):
    """The camera of a frame: a share of the way from one view to another.

    A view includes a time [s] of the run, because it depends on the positions of moving tools.
    """

    begin: Tuple[str, float]
    end: Tuple[str, float]
    share: float


def view_times(run: Run, views: Sequence[ViewAt]) -> List[Tuple[float, str]]:
    """Return the views of a run and the times [s] of the recording from which they hold, sorted.

    Raises:
        ValueError: the run has no such mark.
    """
    timed = []
    for view, at in views:
        try:
            time_s = clock_seconds(at) if at else -math.inf
        except ValueError:
            times_s = [run.begin_s + event.time_s for event in run.events if event.name == at]
            if not times_s:
                known = ', '.join(dict.fromkeys(event.name for event in run.events)) or 'none'
                raise ValueError(
                    f'{view}@{at}: {run.name} has no mark or event "{at}" (it has: {known}); '
                    'write one of these, or a time such as 0:07.4') from None
            timed += [(time_s, view) for time_s in times_s]
            continue
        timed.append((time_s, view))
    return sorted(timed, key=lambda pair: pair[0])


def camera_moves(chosen: ChosenSpans, views: Sequence[ViewAt], shots: _Shots,
                 move_s: float) -> List[Tuple[CameraMove, ...]]:
    """Return the camera of each frame; moves start and end slowly.

    The cameras of frames side by side move together, at the times of the run.

    Args:
        chosen: the runs.
        views: views of the camera and their start times; the first view also holds earlier.
        shots: the frames.
        move_s: duration of a move in recording time [s].

    Raises:
        ValueError: a run has no such mark.
    """
    times = {number: view_times(chosen.runs[number], views)
             for number in dict.fromkeys(shot[-1].run for shot in shots)}
    first: Dict[Tuple[int, int], Tuple[Frame, ...]] = {}  # first shots of views of runs
    moves = []
    for shot in shots:
        run, time_s = shot[-1]
        number = max(sum(it <= time_s for it, _ in times[run]) - 1, 0)
        begun = first.setdefault((run, number), shot)
        before = first.get((run, number - 1), begun)
        names = [times[run][max(number - 1, 0)][1], times[run][number][1]]
        part = min(max((time_s - times[run][number][0]) / move_s, 0.0), 1.0) if number else 1.0
        share = part * part * (3.0 - 2.0 * part)
        moves.append(tuple(CameraMove((names[0], one.time_s), (names[1], other.time_s), share)
                           for one, other in zip(before, begun)))
    return moves


def numbers_beside(path: str) -> str:
    """Return the name of the table with the numbers of a film's frames."""
    return f'{os.path.splitext(path)[0]}.csv'


def write_film(path: str, chosen: ChosenSpans, style: Style, rate_hz: float = 25.0,
               speed: float = 1.0, on_frame: OnFrame = lambda _done, _all: None) -> int:
    """Write the film, and beside it a table with the numbers of each frame; return their count.

    No partial file is left if this fails or ``on_frame`` raises.

    Args:
        path: ends in one of ENDINGS.
        chosen: the runs.
        style: the style.
        rate_hz: frames per second of the film.
        speed: seconds of the recording per second of the film.
        on_frame: called after each frame.

    Raises:
        BagError, ConfigurationError: a recording or its configuration cannot be read.
        ValueError: there are too many frames, or a program is missing or fails.
        OSError: a file cannot be written.
    """
    ending = os.path.splitext(path)[1].lower()
    encoder = shutil.which('ffmpeg')
    if encoder is None:
        raise ValueError('ffmpeg is needed to make the film, and is not installed (Debian: "apt '
                         'install ffmpeg")')
    frames = film_frames(chosen, rate_hz, speed)
    shots: _Shots = [(it,) for it in frames]
    if style.is_beside:
        chosen, shots = beside_good(chosen, frames)
    table = io.StringIO()
    with whole_file(path) as unfinished, ExitStack() as stack:
        stderr_file = stack.enter_context(tempfile.TemporaryFile())  # a pipe would need a reader
        process = stack.enter_context(_encoder(encoder, rate_hz, ending, unfinished,
                                               len(shots[0]), stderr_file))
        try:
            _draw(chosen, style, shots, _pipe(process), table, on_frame, _MOVE_S * speed)
        except BrokenPipeError:
            process.wait()
            raise ValueError(f'ffmpeg has ended: {_error_text(stderr_file)}') from None
        except BaseException:
            process.kill()
            raise
        _pipe(process).close()
        if process.wait() != 0:
            raise ValueError(f'ffmpeg cannot make the film: {_error_text(stderr_file)}')
    write_text(numbers_beside(path), table.getvalue())
    return len(frames)


def write_picture(path: str, chosen: ChosenSpans, style: Style, frame: Frame) -> None:
    """Write a picture of one moment as PNG.

    Raises:
        BagError, ConfigurationError, ValueError, OSError: as ``write_film``.
    """
    with whole_file(path) as unfinished, open(unfinished, 'wb') as file:
        _draw(chosen, style, [(frame,)], file, io.StringIO(), lambda _done, _all: None)


def _draw(chosen: ChosenSpans, style: Style, shots: _Shots, pictures: IO[bytes],
          table: TextIO, on_frame: OnFrame, move_s: float = _MOVE_S) -> None:
    """Write the picture of each frame, and its row in the table."""
    # Imported late: other commands start 50 ms faster.
    from process_visualizer.film.headless_browser import BrowserError, HeadlessBrowser
    rows: List[Dict[str, str]] = []
    moves = camera_moves(chosen, style.views, shots, move_s)
    try:
        with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
            page = Path(folder) / 'page.html'
            write_text(str(page), page_of(chosen, style.with_clouds, worst_first=False))
            size = style.size[0] // len(shots[0]), style.size[1]
            with HeadlessBrowser(page, size, _FILM) as browser:
                look = {'dark': style.is_dark, 'curves': list(style.curves)}
                browser.evaluate(f'page.film({json.dumps(look)})')
                for number, (frames, cameras) in enumerate(zip(shots, moves)):
                    row = {'frame': str(number)}
                    for frame, camera in zip(frames, cameras):
                        said = browser.evaluate(
                            f'page.filmFrame({frame.run}, {json.dumps(frame.time_s)}, '
                            f'{json.dumps(camera)})')
                        pictures.write(browser.picture())
                        whose = '' if frame is frames[-1] else 'good '
                        row.update({f'{whose}run': chosen.runs[frame.run].name,
                                    f'{whose}time [s]': f'{frame.time_s:.6f}',
                                    **{f'{whose}{device} {what}': text
                                       for device, what, text in said}})
                    rows.append(row)
                    on_frame(number + 1, len(shots))
    except BrowserError as error:
        raise ValueError(str(error)) from error
    writer = csv.DictWriter(table, list(dict.fromkeys(name for row in rows for name in row)))
    writer.writeheader()
    writer.writerows(rows)


def _encoder(program: str, rate_hz: float, ending: str, path: str, beside: int,
             said: IO[bytes]) -> 'subprocess.Popen[bytes]':
    return subprocess.Popen(
        [program, '-y', '-hide_banner', '-loglevel', 'error', '-f', 'image2pipe', '-framerate',
         f'{beside * rate_hz:g}', '-c:v', 'png', '-i', '-',
         *(it.format(beside) for it in _ENCODERS[ending]), path],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said)


def _pipe(process: 'subprocess.Popen[bytes]') -> IO[bytes]:
    assert process.stdin is not None
    return process.stdin


def _error_text(stderr_file: IO[bytes]) -> str:
    stderr_file.seek(0)
    return stderr_file.read(_MAX_ERROR_BYTES).decode('utf-8', 'replace').strip().replace('\n', '; ')
