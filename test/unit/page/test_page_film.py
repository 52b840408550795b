# SPDX-License-Identifier: BSD-3-Clause
"""The frames of a film, and refusals before anything is drawn."""
from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest
from cycle_bags import write_bag

from process_visualizer.commands.command_line import main
from process_visualizer.film.film import (
    Frame,
    ViewAt,
    beside_good,
    camera_moves,
    film_frames,
    view_times,
)
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.shared_page import ChosenSpans
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import RunEvent


@pytest.mark.parametrize(('span', 'rate_hz', 'speed', 'count'), [
    (PageSpan(2.0, 3.2), 10.0, 1.0, 12), (PageSpan(2.0, 3.2), 10.0, 0.25, 48),
    (PageSpan(0.0, 17.68), 25.0, 1.0, 442), (PageSpan(1.0, 1.001), 25.0, 1.0, 1)])
def test_frames_are_evenly_spaced(span: PageSpan, rate_hz: float, speed: float,
                                  count: int) -> None:
    frames = film_frames(ChosenSpans(None, [], [span, span]), rate_hz, speed)
    assert [it.run for it in frames] == [0] * count + [1] * count
    assert [it.time_s for it in frames[:count]] == pytest.approx(
        [span.begin_s + row * speed / rate_hz for row in range(count)])


def test_years_are_too_many_frames() -> None:
    with pytest.raises(ValueError, match='25000000000 frames are more than 60000'):
        film_frames(ChosenSpans(None, [], [PageSpan(0.0, 1e9)]), 25.0, 1.0)


def test_of_the_good_run_that_part_is_beside_which_belongs_to_the_run(tmp_path: Path) -> None:
    run, reference = ChosenRuns().runs([write_bag(tmp_path, cycles=2)])
    chosen = ChosenSpans(None, [run], [PageSpan(2.0, 3.2)], GoodRuns(reference, []))
    both, shots = beside_good(chosen, film_frames(chosen, 10.0, 1.0))
    assert [it.name for it in both.runs] == ['a.bag#1', 'a.bag#2']
    assert [[it.run for it in shot] for shot in shots] == [[1, 0]] * 12
    assert both.spans[0] == PageSpan(2.0, 3.2)
    assert both.spans[1] == pytest.approx((14.0, 15.1), abs=0.1)
    with pytest.raises(ValueError, match='beside a.bag#1: name a good run with --reference'):
        beside_good(chosen._replace(good=None), [])


def test_the_camera_moves_to_further_views_slowly_at_first_and_at_last(tmp_path: Path) -> None:
    run, = ChosenRuns().runs([f'{write_bag(tmp_path, cycles=2)}#1'])
    chosen = ChosenSpans(None, [run], [PageSpan(0.0, 10.0)])
    shots = [(Frame(0, float(second)),) for second in range(9)]
    moves = [it for it, in camera_moves(
        chosen, [ViewAt('cell'), ViewAt('tools', '0:03'), ViewAt('top', '5')], shots, 4.0)]
    assert [it.end for it in moves] == [('cell', 0.0)] * 3 + [('tools', 3.0)] * 2 + [
        ('top', 5.0)] * 4
    assert [it.begin for it in moves[3:]] == [('cell', 0.0)] * 2 + [('tools', 3.0)] * 4
    assert [it.share for it in moves[5:]] == [0.0, 0.15625, 0.5, 0.84375]


def test_views_begin_at_marks(tmp_path: Path) -> None:
    run, = ChosenRuns().runs([f'{write_bag(tmp_path, cycles=2)}#1'])
    run = run._replace(begin_s=2.0, events=(RunEvent('needle', 3.0), RunEvent('seam', 4.0)))
    assert view_times(run, [ViewAt('cell'), ViewAt('top', 'seam'), ViewAt('tools', 'needle')]) == [
        (-math.inf, 'cell'), (5.0, 'tools'), (6.0, 'top')]
    with pytest.raises(ValueError, match=r'no mark or event "nadel" \(it has: needle, seam\)'):
        view_times(run, [ViewAt('cell'), ViewAt('top', 'nadel')])


@pytest.mark.parametrize(('words', 'problem'), [
    (['film', '-o', 'a.avi'], 'name a file that ends in .mp4 or .gif'),
    (['film', '-o', 'a.mp4', '--rate', 'nan'], 'write a --rate from 0.1 to 120'),
    (['film', '-o', 'a.mp4', '--speed', '0'], 'a --speed from 0.001'),
    (['film', '-o', 'a.mp4', '--size', '321x240'], 'even numbers of pixels'),
    (['picture', '-o', 'a.gif', '--at', '1'], 'name a file that ends in .png'),
    (['picture', '-o', 'a.png', '--at', 'soon'], '"soon" is not a time')])
def test_what_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], words: List[str],
                         problem: str) -> None:
    words = [str(tmp_path / it) if it.startswith('a.') else it for it in words]
    assert main([words[0], write_bag(tmp_path), *words[1:]]) == 1
    assert problem in capsys.readouterr().err
    assert sorted(it.name for it in tmp_path.iterdir()) == ['a.bag', 'cell.xml']


def test_a_missing_program_is_named_and_nothing_is_left(tmp_path: Path) -> None:
    bag, empty = write_bag(tmp_path), tmp_path / 'bin'
    empty.mkdir()
    for command, name, program in (('film', 'a.mp4', 'ffmpeg is needed to make the film'),
                                   ('picture', 'a.png', 'Chromium draws the pictures')):
        words = [command, bag, '-o', str(tmp_path / name),
                 *(['--at', '2'] if command == 'picture' else [])]
        done = subprocess.run(
            [sys.executable, '-c', 'import sys; from process_visualizer.commands.command_line '
             f'import main; sys.exit(main({words!r}))'], env={**os.environ, 'PATH': str(empty)},
            stderr=subprocess.PIPE, text=True, check=False)
        assert done.returncode == 1
        assert program in done.stderr and 'Traceback' not in done.stderr
    assert sorted(it.name for it in tmp_path.iterdir()) == ['a.bag', 'bin', 'cell.xml']
