# SPDX-License-Identifier: BSD-3-Clause
"""The commands of ``cell`` for bags: report, mark, reindex, cut, configuration, calibration."""
from __future__ import annotations

import argparse
import math
import os
import sys
from contextlib import suppress
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bagio.bag_cut import COMPRESSIONS, CutSpan, cut
from process_visualizer.bagio.bag_errors import BagError, BagUnindexed
from process_visualizer.bagio.marks import Mark, add_mark, marks_path, read_marks
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording, recording_parts
from process_visualizer.bagio.recording_calibration import (
    RecordedFrame,
    recorded_frames,
    saved_poses,
)
from process_visualizer.bagio.reindex import reindex
from process_visualizer.bagio.report import as_json, as_text, make_report
from process_visualizer.cell.confinement import confined
from process_visualizer.cell.element_reader import read_xml
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Cell, Pose
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.cell.trust import Origin, Provenance
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves, recorded_alarms
from process_visualizer.figures import clock_seconds, clock_text
from process_visualizer.robot.rotations import PoseDifference, pose_difference
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.shown_text import say


def add_bag_commands(commands: 'argparse._SubParsersAction[Any]') -> None:
    """Add the commands for bags to those of ``cell``; ``execute_bag_command`` runs them."""
    for name, (help_text, add_options, _) in _COMMANDS.items():
        command = commands.add_parser(name, help=help_text, description=help_text)
        command.set_defaults(bag_command=name)
        add_options(command)


def execute_bag_command(options: argparse.Namespace) -> int:
    """Run one of the commands for bags; return its exit code.

    Raises:
        BagError: a bag cannot be read, or a file beside it cannot be written.
        ValueError: a mark is outside the time span of its bag.
        OSError: a file of the configuration cannot be written.
    """
    try:
        return _COMMANDS[options.bag_command].run(options)
    except BagUnindexed as error:
        raise advised(error) from error


def advised(error: BagUnindexed) -> BagError:
    """Return the error with advice on what to do."""
    return BagError(error.file, f'{error.reason}: '
                    f'"rosrun process_visualizer cell reindex {error.file}"')


def _add_bags(command: argparse.ArgumentParser) -> None:
    command.set_defaults(repeated='bags')
    command.add_argument('bags', metavar='BAG', nargs='+',
                         help='the bag, or all parts of one recording')


def _add_report_options(command: argparse.ArgumentParser) -> None:
    _add_bags(command)
    command.add_argument('--json', action='store_true', help='output for programs')


def _report(options: argparse.Namespace) -> int:
    with Recording(options.bags) as recording:
        report = make_report(recording)
    say(as_json(report) if options.json else as_text(report))
    return 0 if report.is_good else 2


def _add_mark_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('bag', metavar='BAG')
    command.add_argument('position', metavar='SECONDS', type=float, help='from its beginning')
    command.add_argument('label', metavar='LABEL')


def _mark(options: argparse.Namespace) -> int:
    with Recording([options.bag]) as recording:
        begin_ns, end_ns = recording.begin_ns, recording.end_ns
    duration_s = (end_ns - begin_ns) / 1e9
    if not 0.0 <= options.position <= duration_s:
        raise ValueError(f'{options.bag} goes from 0 to {duration_s:.3f} s')
    path = add_mark(options.bag, Mark(begin_ns + round(options.position * 1e9), options.label))
    if path != marks_path(options.bag):
        say(f'note: the folder of the bag cannot be written; the mark is in {path}',
            file=sys.stderr)
    return 0


def _add_reindex_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('bag', metavar='FILE', help='NAME.bag or NAME.bag.active')


def _reindex(options: argparse.Namespace) -> int:
    done = reindex(options.bag)
    for gap in done.gaps:
        say(gap, file=sys.stderr)
    say(f'{done.path}: {done.message_count} messages')
    return 0


def _add_configuration_options(command: argparse.ArgumentParser) -> None:
    _add_bags(command)
    command.add_argument('--output', metavar='DIR', default='.', help='the folder')


def _configuration(options: argparse.Namespace) -> int:
    with Recording(options.bags) as recording:
        configuration, damage = recorded_configuration(recording), recording.damage
    if configuration is None:
        for gap in damage:
            say(gap, file=sys.stderr)
        say(f'cell: {options.bags[0]} holds no configuration', file=sys.stderr)
        return 1
    words = [f'{name}:={value}' for name, value in configuration.arguments.items()]
    path = write_configuration(configuration, options.output)
    say(' '.join([path, *words]))
    _warn_of_active_elements(path, options.output, configuration.arguments)
    return 0


def _warn_of_active_elements(path: str, folder: str, given: Mapping[str, str]) -> None:
    """Report elements that are ignored in the bag but take effect once the file is opened.

    A file that cannot be read is not an error here: it is written unchanged.
    """
    try:
        found = confined(read_xml(path), Provenance(Origin.BAG, folder), given).ignored
    except ConfigurationError:
        return
    for it in found:
        say(f'note: {it.location}: <{it.element}> runs or reads something when this file is '
            'opened; read it first', file=sys.stderr)


class _Command(NamedTuple):
    help_text: str
    add_options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


_COMMANDS: Dict[str, _Command] = {
    'report': _Command('report what is in a bag and whether it is complete; exit code 2 if it is '
                       'empty or something is known to be missing',
                       _add_report_options, _report),
    'mark': _Command('label a moment of a finished bag, in a file beside it',
                     _add_mark_options, _mark),
    'reindex': _Command('make a bag from the file that a killed recorder left, as a copy beside it',
                        _add_reindex_options, _reindex),
    'configuration': _Command('write the configuration that a bag was recorded with',
                              _add_configuration_options, _configuration),
}


# The command ``cell calibration``: compares recorded and current poses of the devices.

_SAME = PoseDifference(5e-6, 5e-6)
"""Differences up to this are rounding: files have six decimals."""
_DIFFERS = 2
_NUMBERS = 6


class _Base(NamedTuple):
    """A base frame: its parent, and its poses when recorded, saved for the bag, and now."""

    name: str
    parent: str
    then: Optional[Pose]
    saved: Optional[Pose]
    now: Optional[Pose]

    @property
    def has_moved(self) -> bool:
        """Return whether its current pose differs from the recorded one."""
        if self.then is None or self.now is None:
            return False
        apart = pose_difference(self.then, self.now)
        return apart.distance_m > _SAME.distance_m or apart.angle_rad > _SAME.angle_rad


def add_calibration_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell calibration``."""
    command.add_argument('bag', metavar='BAG')
    command.add_argument('config', metavar='CONFIG', nargs='?',
                         help='the configuration (default: the file that the bag was recorded '
                              'with, if it is still there)')


def execute_calibration(options: argparse.Namespace, arguments: Mapping[str, str]) -> int:
    """Print the poses; return 2 if a device has moved since the recording, otherwise 0.

    Raises:
        BagError: the bag or the file beside it cannot be read, or neither holds poses.
        ConfigurationError: the configuration cannot be used.
    """
    then, saved, config, known = _recorded(options.bag)
    if options.config is not None:
        config, known = options.config, {}
    cell = None if not config else XmlParser({**known, **arguments}).parse(config)
    bases = _bases(then, saved, cell)
    say('\n'.join([_title(options.bag, config), *(_text(it) for it in bases)]))
    return _DIFFERS if any(it.has_moved for it in bases) else 0


def _recorded(bag: str) -> Tuple[Dict[str, RecordedFrame], Dict[str, Pose], str, Dict[str, str]]:
    """Return recorded frames, saved poses, and the configuration's file (if any) and arguments.

    Raises:
        BagError: see execute_calibration.
    """
    try:
        with Recording([bag]) as recording:
            then, stored = recorded_frames(recording), recorded_configuration(recording)
    except BagUnindexed as error:
        raise advised(error) from error
    saved = saved_poses(bag)
    if not then and not saved:
        raise BagError(bag, 'it does not say where the base frames were: it was not recorded by '
                       'the recorder of a running cell')
    if stored is None or not os.path.isfile(stored.file):
        return then, saved, '', {}
    return then, saved, stored.file, dict(stored.arguments)


def _bases(then: Mapping[str, RecordedFrame], saved: Mapping[str, Pose], cell: Optional[Cell]
           ) -> List[_Base]:
    """Return the base frames of the configuration; without one, all recorded or saved ones."""
    if cell is None:
        return [_Base(frame, then[frame].parent if frame in then else '',
                      then[frame].pose if frame in then else None, saved.get(frame), None)
                for frame in dict.fromkeys([*then, *saved])]
    found = []
    for device in cell.devices:
        if device.base is not None:
            frame, was = device.base.frame, then.get(device.base.frame)
            is_same_parent = was is not None and was.parent == cell.frame
            found.append(_Base(f'{device.name}: {frame}', cell.frame,
                               was.pose if was is not None and is_same_parent else None,
                               saved.get(frame), device.base.pose))
    return found


def _title(bag: str, config: str) -> str:
    now = f'now: {config}' if config else 'no configuration to compare with: name one'
    return f'then: {bag}; {now}; x y z in m, yaw pitch roll in rad'


def _text(base: _Base) -> str:
    lines = [f'{base.name} in {base.parent}' if base.parent else base.name,
             f'  then   {"not recorded" if base.then is None else _numbers(base.then)}']
    if base.saved is not None:
        lines.append(f'  saved  {_numbers(base.saved)}{_apart(base.then, base.saved)}')
    if base.now is not None:
        lines.append(f'  now    {_numbers(base.now)}{_apart(base.then, base.now)}')
    return '\n'.join(lines)


def _numbers(pose: Pose) -> str:
    rounded = (round(number, _NUMBERS) + 0.0 for number in (*pose.xyz, *pose.ypr))  # no -0.0
    return ' '.join(f'{number:9.{_NUMBERS}f}' for number in rounded)


def _apart(one: Optional[Pose], other: Pose) -> str:
    return '' if one is None else f'  {pose_difference(one, other)} from then'


_RUN_MARGIN_S, _MOMENT_MARGIN_S = 1.0, 5.0


class _Moment(NamedTuple):
    """A mark or alarm of a recording [s from its beginning]."""

    begin_s: float
    end_s: float
    text: str


def add_cut_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell cut``."""
    command.add_argument('run', metavar='RUN',
                         help='a recording, or one run of it: BAG or BAG#NUMBER')
    command.add_argument('-o', '--output', metavar='FILE', required=True, help='the new bag')
    command.add_argument('--from', dest='begin', metavar='TIME', type=_time,
                         help='from the beginning of the recording, such as 0:05')
    command.add_argument('--to', dest='end', metavar='TIME', type=_time)
    command.add_argument('--around', metavar='WHAT',
                         help='a moment: a time, or words of a mark or of an alarm')
    command.add_argument('--margin', metavar='SECONDS', type=_time,
                         help=f'more before and after (of a run {_RUN_MARGIN_S:g} s, around a '
                              f'moment {_MOMENT_MARGIN_S:g} s)')
    command.add_argument('--topics', metavar='A,B',
                         help='only these, and what the recorder adds about the cell')
    command.add_argument('--compression', choices=COMPRESSIONS, default='none')
    command.add_argument('--config', metavar='FILE',
                         help='a configuration; default: the one in the recording')


def execute_cut(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Write the bag; return 0, or 2 if messages of the span cannot be read.

    Raises:
        BagError: a file cannot be read or written.
        ValueError: the options do not specify one span, or the recording does not contain it.
    """
    chosen = ChosenRuns() if options.config is None else \
        ChosenRuns(XmlParser(arguments).parse(options.config))
    paths, begin_s, end_s = _span_s(options, chosen)
    topics = None if options.topics is None else [it for it in options.topics.split(',') if it]
    with Recording(paths) as recording:
        duration_s = (recording.end_ns - recording.begin_ns) / 1e9
        begin_s, end_s = max(begin_s, 0.0), min(end_s, duration_s)
        if begin_s > end_s:
            raise ValueError(f'{paths[0]} goes from {clock_text(0.0, 1)} to '
                             f'{clock_text(duration_s, 1)}')
        begin_ns, end_ns = (recording.begin_ns + round(it * 1e9) for it in (begin_s, end_s))
        done = cut(
            recording, CutSpan(begin_ns, end_ns), options.output, topics, options.compression
        )
    say(f'{options.output}: {clock_text(begin_s, 1)} to {clock_text(end_s, 1)}, '
        f'{done.message_count} messages of {len(done.topics)} topics'
        + (f', and {done.held_count} that held before' if done.held_count else ''))
    if done.lost_count:
        say(f'cell: {done.lost_count} messages of this span cannot be read; '
            f'see "cell report {paths[0]}"', file=sys.stderr)
    return 2 if done.lost_count else 0


def _time(text: str) -> float:
    try:
        return clock_seconds(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _span_s(options: argparse.Namespace,
            chosen: ChosenRuns) -> Tuple[Tuple[str, ...], float, float]:
    """Return the files of the recording, and the chosen span [s from its beginning]."""
    is_run = '#' in options.run and not os.path.exists(options.run)
    is_span = options.begin is not None or options.end is not None
    if is_run + is_span + (options.around is not None) != 1:
        raise ValueError('name one span: a run (BAG#NUMBER), --from and --to, or --around')
    if is_run:
        runs = chosen.runs([options.run])
        margin_s = _RUN_MARGIN_S if options.margin is None else options.margin
        return (runs[0].recording, min(it.begin_s for it in runs) - margin_s,
                max(it.begin_s + it.duration_s for it in runs) + margin_s)
    paths = recording_parts(options.run)
    if is_span:
        margin_s = options.margin or 0.0
        return (paths, (options.begin or 0.0) - margin_s,
                (math.inf if options.end is None else options.end) + margin_s)
    moment = _moment(paths, options.around, chosen)
    margin_s = _MOMENT_MARGIN_S if options.margin is None else options.margin
    return paths, moment.begin_s - margin_s, moment.end_s + margin_s


def _moment(paths: Tuple[str, ...], words: str, chosen: ChosenRuns) -> _Moment:
    """Return the moment given as a time, or else the mark, or else the alarm with these words.

    Raises:
        ValueError: nothing matches, or more than one mark or alarm does.
    """
    with suppress(ValueError):
        return _Moment(clock_seconds(words), clock_seconds(words), words)
    with Recording(paths) as recording:
        times_s = [((it.time_ns - recording.begin_ns) / 1e9, it.label)
                   for it in read_marks(recording)]
    marks = [_Moment(time_s, time_s, label) for time_s, label in times_s]
    known, matching = marks, _with_words(words, marks)
    if not matching:
        known = marks + _alarms(paths, chosen)
        matching = _with_words(words, known)
    if len(matching) == 1:
        return matching[0]
    count = 'several marks or alarms' if matching else 'no mark or alarm'
    raise ValueError('\n'.join([
        f'{paths[0]} has {count} with "{words}"; give more words, or the time',
        *(f'  {clock_text(it.begin_s, 1)}  {it.text}' for it in sorted(matching or known))]))


def _with_words(words: str, moments: Sequence[_Moment]) -> List[_Moment]:
    return [it for it in moments if words.casefold() in it.text.casefold()]


def _alarms(paths: Tuple[str, ...], chosen: ChosenRuns) -> List[_Moment]:
    with chosen.cell_of_recording(paths) as cell:
        found = recorded_alarms(cell.devices, read_curves(paths, cell.devices))
    return [_Moment(it.begin_s, it.end_s, f'{it.device}: {it.text}') for it in found]
