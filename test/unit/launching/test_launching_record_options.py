# SPDX-License-Identifier: BSD-3-Clause
"""The command line of ``cell record``: the options of `rosbag record`, and its own."""
from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from process_visualizer.commands.record_command import (
    RecordOptions,
    add_record_options,
    queue_parameter,
    record_options,
)


def read(*words: str) -> RecordOptions:
    parser = argparse.ArgumentParser()
    add_record_options(parser)
    return record_options(parser.parse_args(words))


def test_configuration_and_topics_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / 'cell').write_text('<visualizer/>')
    assert read('a.xml').config == 'a.xml'
    assert read(str(tmp_path / 'cell')).config == str(tmp_path / 'cell')
    both = read('/b', 'a.xml', 'c')
    assert (both.config, both.recording.topics) == ('a.xml', ('/b', 'c'))


def test_topics_by_patterns() -> None:
    assert read('-a').recording.patterns == ('.*',)
    assert read('-e', '/a.*', '-x', '/ab').recording.patterns == ('/a.*',)
    assert read('-e', '/a.*', '-x', '/ab').recording.excluded == ('/ab',)
    assert read('-e', '/a.*').recording.topics == ()


@pytest.mark.parametrize('words, folder, prefix, name', [
    (['-O', 'x.bag'], '.', '', 'x.bag'), (['-O', '/f/x'], '/f', '', 'x'),
    (['-o', 'g/x'], 'g', 'x', ''), (['--name', 'x', '--folder', '/f'], '/f', '', 'x'),
    (['-O', 'g/x', '--folder', '/f'], '/f/g', '', 'x'), (['--prefix', 'x'], '.', 'x', '')])
def test_the_name_may_have_a_folder(words: 'list[str]', folder: str, prefix: str, name: str,
                                    tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    options = read('-a', *words).recording
    assert options.folder == str((tmp_path / folder).resolve())
    assert (options.prefix, options.name) == (prefix, name)


def test_end_and_size() -> None:
    assert (read('-a').duration_s, read('-a').size_bytes) == (0.0, 0)
    ends = read('-a', '--duration', '5m', '--size', '3')
    assert (ends.duration_s, ends.size_bytes) == (300.0, 3 << 20)
    assert (ends.recording.split_bytes, ends.recording.split_duration_s) == (0, 0.0)
    for words in (['--split', '--duration', '2h', '--size', '3'],
                  ['--split-mb', '3', '--split-s', '7200']):
        parts = read('-a', *words)
        assert (parts.duration_s, parts.size_bytes) == (0.0, 0)
        assert parts.recording.split_bytes == 3 << 20
        assert parts.recording.split_duration_s == 7200.0


def test_compression_and_memory() -> None:
    assert read('-a', '--lz4').recording.compression == 'lz4'
    assert read('-a').queue_mb is None and read('-a', '-b', '100').queue_mb == 100
    assert queue_parameter(100) == '_queue_megabytes:=100'
    assert queue_parameter(0) == queue_parameter(10 ** 9) == '_queue_megabytes:=1000000'


@pytest.mark.parametrize('words, message', [
    ([], 'nothing to record'), (['a.xml', 'b.xml'], 'one configuration'),
    (['/a', '--devices', 'b'], '--devices needs'), (['/a', '-x', '/b'], '-x leaves out'),
    (['-a', '--split'], '--split needs')])
def test_what_does_not_go_together(words: 'list[str]', message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read(*words)


@pytest.mark.parametrize('words, message', [
    (['-j'], '--lz4 compresses'), (['--bz2'], '--lz4 compresses'),
    (['--max-splits', '3'], 'nothing that was recorded is deleted'),
    (['-l', '7'], '--duration or --size'), (['--limit=7'], '--duration or --size'),
    (['--chunksize=7'], 'a chunk has 1 MB'), (['--udp'], 'would go unnoticed'),
    (['-p'], 'the topic ~state'), (['--duration', 'x'], 'is not a number'),
    (['--duration', '0'], 'greater than 0'), (['--size', '-1'], 'not a whole number'),
    (['-b', '0.5'], 'not a whole number')])
def test_what_there_is_not_is_said(words: 'list[str]', message: str,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        read('-a', *words)
    assert message in capsys.readouterr().err
