# SPDX-License-Identifier: BSD-3-Clause
"""``cell film`` and ``cell picture``: each frame is the page at its moment, drawn by Chromium."""
from __future__ import annotations

import csv
import re
import struct
import subprocess
from pathlib import Path
from typing import Dict, List

import pytest
from cycle_bags import write_bag
from sewing_runs import write_sewing_run

from process_visualizer.bagio.recording import Recording
from process_visualizer.commands.command_line import main
from process_visualizer.curves.position_values import PositionValues
from process_visualizer.runs.recorded.chosen_runs import recorded_cell

FILM = ('--from', '2', '--to', '3.2', '--rate', '10', '--size', '320x240')


def filmed(folder: Path, name: str, *words: str) -> Path:
    bag = str(folder / 'a.bag')
    if not Path(bag).exists():
        write_bag(folder, cycles=2)
    assert main(['film', f'{bag}#1', '--reference', f'{bag}#2', *FILM, *words, '-o',
                 str(folder / name)]) == 0
    return folder / name


def table_of(film: Path) -> List[Dict[str, str]]:
    """The rows of the table beside a film."""
    with film.with_suffix('.csv').open(encoding='utf-8', newline='') as file:
        return list(csv.DictReader(file))


def check_numbers(bag: str, rows: List[Dict[str, str]]) -> None:
    """Check that the numbers of each frame are those at its time."""
    with Recording([bag]) as recording, recorded_cell(recording) as cell:
        values = PositionValues([bag], cell.devices)
        try:
            for row in rows:
                known = values.at(float(row['time [s]']))
                for name, key, half in (('speed', ('arm', 'v', '/tcf'), 1.1e-3),
                                        ('force', ('arm', 'F', '/ft'), 0.051)):
                    shown = float(row[f'arm tool {name}'].split()[1])
                    assert shown == pytest.approx(known[key], abs=half)
        finally:
            values.close()


def probed(film: Path) -> Dict[str, str]:
    text = subprocess.run(
        ['ffprobe', '-v', 'error', '-count_frames', '-show_entries',
         'stream=codec_name,pix_fmt,nb_read_frames,avg_frame_rate,width,height', '-of',
         'default=noprint_wrappers=1', str(film)], stdout=subprocess.PIPE, text=True,
        check=True).stdout
    return dict(line.split('=', 1) for line in text.splitlines())


def pictures(film: Path) -> List[str]:
    """Return a hash of each frame."""
    text = subprocess.run(['ffmpeg', '-v', 'error', '-i', str(film), '-f', 'framemd5', '-'],
                          stdout=subprocess.PIPE, text=True, check=True).stdout
    return [line.rpartition(',')[2].strip() for line in text.splitlines() if line[:1] != '#']


def test_a_film_has_each_frame_once_and_is_the_same_every_time(tmp_path: Path) -> None:
    film = filmed(tmp_path, 'one.mp4')
    found = probed(film)
    assert (found['codec_name'], found['pix_fmt']) == ('h264', 'yuv420p')
    assert (found['nb_read_frames'], found['avg_frame_rate']) == ('12', '10/1')
    assert (found['width'], found['height']) == ('320', '240')
    frames = pictures(film)
    assert len(set(frames)) == 12  # only the moving line differs
    assert frames == pictures(filmed(tmp_path, 'two.mp4'))
    assert sorted(it.name for it in tmp_path.iterdir()) == [
        'a.bag', 'cell.xml', 'one.csv', 'one.mp4', 'two.csv', 'two.mp4']


def test_the_camera_is_at_another_view_after_its_time(tmp_path: Path) -> None:
    def drawn(at: str, view: str) -> bytes:
        assert main(['picture', write_bag(tmp_path), '--at', at, '--view', view, '--size',
                     '320x240', '-o', str(tmp_path / 'a.png')]) == 0
        return (tmp_path / 'a.png').read_bytes()

    way = [drawn(at, 'cell,top@2') for at in ('1.9', '2.6', '3.6')]
    assert way[0] == drawn('1.9', 'cell')
    assert way[1] not in (drawn('2.6', 'cell'), drawn('2.6', 'top'))
    assert way[2] == drawn('3.6', 'top')


def test_the_table_has_the_numbers_of_each_frame(tmp_path: Path) -> None:
    film = filmed(tmp_path, 'slow.gif', '--speed', '0.5')
    rows = table_of(film)
    assert [row['time [s]'] for row in rows[:3]] == ['2.000000', '2.050000', '2.100000']
    assert len(rows) == 24 == len(pictures(film))
    check_numbers(str(tmp_path / 'a.bag'), rows)
    assert all(re.fullmatch(r'Δ (–|\d+\.\d mm from the good run)', row.get('arm deviation', 'Δ –'))
               for row in rows)


def test_runs_follow_each_other_as_they_were_named(tmp_path: Path) -> None:
    """The worst run does not come first, unlike in a page."""
    bag, film = write_bag(tmp_path, cycles=3, poor=1), tmp_path / 'runs.gif'
    assert main(['film', f'{bag}#1', f'{bag}#2', '--reference', f'{bag}#3', '--rate', '0.52',
                 '--size', '320x240', '-o', str(film)]) == 0
    rows = table_of(film)
    assert [row['run'] for row in rows] == ['a.bag#1'] * 5 + ['a.bag#2'] * 6
    check_numbers(bag, rows)


def test_the_good_run_is_beside_at_the_same_moment_of_the_process(tmp_path: Path) -> None:
    film = filmed(tmp_path, 'both.mp4', '--beside')
    found = probed(film)
    assert (found['nb_read_frames'], found['width'], found['height']) == ('12', '320', '240')
    assert found['avg_frame_rate'] == '10/1'
    rows, bag = table_of(film), str(tmp_path / 'a.bag')
    check_numbers(bag, rows)
    check_numbers(bag, [{name[5:]: text for name, text in row.items()
                         if name.startswith('good ')} for row in rows])
    for row in rows:  # the second cycle begins twelve seconds later
        assert float(row['good time [s]']) - float(row['time [s]']) == pytest.approx(12.0, abs=0.1)


def test_each_number_has_a_column(tmp_path: Path) -> None:
    """The machine has three numbers."""
    film = tmp_path / 'seam.gif'
    assert main(['film', write_sewing_run(tmp_path, 'a.bag'), '--from', '6', '--to', '6.2',
                 '--rate', '5', '--size', '320x240', '-o', str(film)]) == 0
    row = table_of(film)[0]
    assert {it for it in row if it.startswith('sewing_machine ')} == {
        f'sewing_machine {it}' for it in ('feed', 'upper edge', 'lower edge')}


def test_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, picture = write_bag(tmp_path), tmp_path / 'p.png'
    words = ['picture', f'{bag}#1', '--size', '320x240', '-o', str(picture), '--at']
    assert main([*words, '0:03']) == 0
    assert struct.unpack('>II', picture.read_bytes()[16:24]) == (320, 240)
    picture.unlink()
    assert main([*words, '0:30']) == 1
    assert 'and 0:30.00 is outside' in capsys.readouterr().err
    assert not picture.exists()
