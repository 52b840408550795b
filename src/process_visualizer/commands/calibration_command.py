# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell calibration``: where devices were when a bag was recorded, and are now."""
from __future__ import annotations

import argparse
import os
from typing import Dict, List, Mapping, NamedTuple, Optional, Tuple

from process_visualizer.bags.bag_errors import BagError, BagUnindexed
from process_visualizer.bags.recorded_frames import RecordedFrame, recorded_frames
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.recording_calibration import saved_poses
from process_visualizer.cell.model import Cell, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.bag_commands import advised
from process_visualizer.motion.pose_difference import PoseDifference, pose_difference
from process_visualizer.shown_text import say

_SAME = PoseDifference(5e-6, 5e-6)
"""Files have six decimals."""
_DIFFERS = 2
_NUMBERS = 6


class _Base(NamedTuple):
    """A base frame: its parent, and where it was then, is for the bag, and is now."""

    name: str
    parent: str
    then: Optional[Pose]
    saved: Optional[Pose]
    now: Optional[Pose]

    @property
    def has_moved(self) -> bool:
        """Return whether it is elsewhere now than then."""
        if self.then is None or self.now is None:
            return False
        apart = pose_difference(self.then, self.now)
        return apart.distance_m > _SAME.distance_m or apart.angle_rad > _SAME.angle_rad


def add_calibration_options(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument('bag', metavar='BAG')
    command.add_argument('config', metavar='CONFIG', nargs='?',
                         help='the configuration (default: the file that the bag was recorded '
                              'with, if it is still there)')


def execute_calibration(options: argparse.Namespace, arguments: Mapping[str, str]) -> int:
    """Print the poses; return 2 if a device is elsewhere now than then, 0 if none is.

    Raises:
        BagError: the bag, or the file beside it, cannot be read, or it holds no frames.
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
    """Frames, poses beside the bag, and the configuration's file, if it is there, with arguments.

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
    """The base frames of the configuration, or without one all that were recorded or saved."""
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
