# SPDX-License-Identifier: BSD-3-Clause
"""The file of a page: its content, omissions, and refusals."""
from __future__ import annotations

import os
import re
from base64 import b64encode
from hashlib import sha256
from html import unescape
from pathlib import Path

import pytest
from cycle_bags import write_bag
from page_reader import PageReader

from process_visualizer.bagio.marks import Mark, add_mark
from process_visualizer.commands.command_line import main
from process_visualizer.whole_file import write_text

HOSTILE = '</script><script>alert(1)</script><img src=x onerror=alert(2)>'


def shared(folder: Path, *words: str) -> str:
    page = folder / 'page.html'
    assert main(['share', *words, '-o', str(page)]) == 0
    return page.read_text(encoding='utf-8')


def test_what_a_recording_says_is_text(tmp_path: Path) -> None:
    bag = write_bag(tmp_path)
    add_mark(bag, Mark(1_600_000_003_000_000_000, HOSTILE))
    html = shared(tmp_path, f'{bag}#1')
    assert html.count('<script') == 3
    assert '<img' not in html
    assert HOSTILE in [it['label'] for it in PageReader(html).data['runs'][0]['moments']]


def test_only_the_script_of_the_page_may_run_and_nothing_is_fetched(tmp_path: Path) -> None:
    html = shared(tmp_path, f'{write_bag(tmp_path)}#1')
    found = re.search(r'Security-Policy" content="([^"]+)"', html)
    assert found is not None
    policy = unescape(found.group(1))
    script = re.findall(r'<script>(.*?)</script>', html, re.DOTALL)
    assert f"'sha256-{b64encode(sha256(script[0].encode()).digest()).decode()}'" in policy
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert 'connect-src' not in policy
    assert not re.search(r'(?:src|href)="(?:https?:)?//', html)


def test_a_part_is_shown(tmp_path: Path) -> None:
    run = PageReader(shared(tmp_path, f'{write_bag(tmp_path)}#2', '--from', '0:12.5', '--to',
                            '15')).data['runs'][0]
    assert (run['begin'], run['end']) == (12.5, 15.0)
    assert run['lanes'][0]['begin'] == pytest.approx(12.5, abs=0.01)


def test_a_part_of_a_recording_may_reach_over_several_runs(tmp_path: Path) -> None:
    """Without good runs it is one; with them each run that it overlaps is judged."""
    bag = write_bag(tmp_path, cycles=3)
    part = '--from', '0:15', '--to', '0:25'
    one, = PageReader(shared(tmp_path, bag, *part)).data['runs']
    assert (one['begin'], one['end']) == (15.0, 25.0)
    several = PageReader(shared(tmp_path, bag, *part, '--reference', f'{bag}#1')).data['runs']
    assert [(it['name'], it['state']) for it in several] == [
        ('a.bag#2', 'good'), ('a.bag#3', 'good')]
    assert (several[0]['begin'], several[1]['end']) == (15.0, 25.0)
    only, = PageReader(shared(tmp_path, bag, '--from', '0:24', '--to', '0:25')).data['runs']
    assert (only['name'], only['begin']) == ('a.bag#3', 24.0)


def test_several_runs_are_on_one_page(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, cycles=3, poor=1)
    html = shared(tmp_path, bag, '--reference', f'{bag}#1', f'{bag}#3')
    assert '<h1>1 of 3 runs out of range</h1>' in html
    assert [it['state'] for it in PageReader(html).data['runs']] == ['poor', 'good', 'good']


def test_the_report_of_a_comparison_is_the_same_page(tmp_path: Path) -> None:
    bag, page = write_bag(tmp_path, cycles=3, poor=1), tmp_path / 'report.html'
    assert main(['compare', bag, '--reference', f'{bag}#1', f'{bag}#3', '--report',
                 str(page)]) == 2
    report = PageReader(page.read_text(encoding='utf-8'))
    assert report.data['runs'] == PageReader(shared(
        tmp_path, bag, '--reference', f'{bag}#1', f'{bag}#3')).data['runs']
    assert 'nearest to leaving, or farthest out' in page.read_text(encoding='utf-8')


def test_the_table_of_a_recording_whose_name_is_no_text_is_written(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, b'\xff.bag'.decode('utf-8', 'surrogateescape'), cycles=3)
    assert main(['compare', f'{bag}#2', '--reference', f'{bag}#1', f'{bag}#3', '--csv',
                 str(tmp_path / 'table.csv')]) == 0
    assert '\\udcff.bag#2' in (tmp_path / 'table.csv').read_text(encoding='utf-8')


def test_runs_for_which_there_is_no_room_are_listed_behind_the_others(tmp_path: Path) -> None:
    bag, page = write_bag(tmp_path, cycles=3, poor=1), tmp_path / 'report.html'
    assert main(['compare', *[f'{bag}#1'] * 100, f'{bag}#2', '--reference', f'{bag}#1',
                 f'{bag}#3', '--report', str(page)]) == 2
    html = page.read_text(encoding='utf-8')
    runs = PageReader(html).data['runs']
    assert [it['state'] for it in runs[:2]] == ['poor', 'good'] and len(runs) < 101
    assert f'The page has room for {len(runs)} of these runs' in html
    assert html.count('<tr><td>') >= 101 and '<h1>1 of 101 runs out of range</h1>' in html


def test_a_recording_without_a_whole_run_is_shown_as_it_is(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    html = shared(tmp_path, write_bag(tmp_path, part_of_s=(0.0, 4.0)))
    assert 'all of it is shown' in capsys.readouterr().err
    assert PageReader(html).data['runs'][0]['verdict'] == 'not compared with good runs'


@pytest.mark.parametrize(('words', 'problem'), [
    (['--from', 'soon'], '"soon" is not a time; write seconds'),
    (['--from', '0:30'], 'a.bag#1 goes from 0:00.00 to 0:10.00'),
    (['--from', '5', '--to', '4'], 'not from 0:05.00 to 0:04.00')])
def test_a_part_that_there_is_not(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                  words: 'list[str]', problem: str) -> None:
    page = tmp_path / 'page.html'
    assert main(['share', f'{write_bag(tmp_path)}#1', *words, '-o', str(page)]) == 1
    assert problem in capsys.readouterr().err
    assert not page.exists()


def test_a_folder_that_there_is_not_is_said_before_the_work(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['share', 'no.bag', '-o', str(tmp_path / 'no' / 'page.html')]) == 1
    assert 'there is no folder' in capsys.readouterr().err


def test_more_than_a_page_can_show_asks_for_a_part(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_bag(tmp_path)
    assert main(['share', *[f'{bag}#1'] * 120, '-o', str(tmp_path / 'page.html')]) == 1
    assert 'name a part of at most 15:00.00' in capsys.readouterr().err


def test_a_device_is_written_to_and_a_link_stays(tmp_path: Path) -> None:
    pipe, link, path = (tmp_path / name for name in ('pipe', 'link', 'page.html'))
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_text(str(pipe), 'page')
    assert os.read(reader, 10) == b'page'
    os.close(reader)
    assert pipe.is_fifo()
    path.write_text('before', encoding='utf-8')
    link.symlink_to(path)
    write_text(str(link), 'page')
    assert link.is_symlink() and path.read_text(encoding='utf-8') == 'page'


def test_a_file_is_written_as_a_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / 'page.html'
    path.write_text('before', encoding='utf-8')
    with pytest.raises(TypeError):
        write_text(str(path), None)  # type: ignore[arg-type]
    assert path.read_text(encoding='utf-8') == 'before'
    assert [it.name for it in tmp_path.iterdir()] == ['page.html']
