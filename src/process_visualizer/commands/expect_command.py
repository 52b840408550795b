# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell expect``: adds boxes for the objects that a depth sensor sees now."""
from __future__ import annotations

import argparse
import queue
import time
from typing import List, Mapping, Sequence, Tuple

import rospy

from process_visualizer.cell.errors import advice
from process_visualizer.cell.file_edit import PoseEditor, expected_element
from process_visualizer.cell.model import Cell, SoughtObjects
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.health.expected_objects import LOOK_S, expectation
from process_visualizer.health.near_objects import START_S, SeenObject, seen_objects
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.msg import DetectedObjects
from process_visualizer.ros_names import OBJECTS
from process_visualizer.shown_text import say


def add_expect_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell expect``."""
    command.add_argument('config', metavar='CONFIG', help='the configuration file')
    command.add_argument('sensor', metavar='SENSOR', help='a depth sensor that has <objects>')
    command.add_argument('--write', action='store_true',
                         help='add the boxes to the file; a backup is kept beside it')


def execute_expect(options: argparse.Namespace, arguments: Mapping[str, str]) -> int:
    """Print what would be expected, and write it if requested; return the exit code.

    Raises:
        ConfigurationError: the configuration has problems.
        ValueError: there is no such sensor, it reports nothing, or nothing can be written.
    """
    cell = XmlParser(arguments).parse(options.config)
    editor, sought = PoseEditor(cell), _sought(cell, options.sensor)
    found = expectation(_looks(_listen(options.sensor), cell.frame), sought, cell.frame)
    for line, box in zip(found.added_lines(), found.boxes):
        say(f'{line}\n  {expected_element(box, cell.frame)}')
    for line in found.left_out_lines():
        say(f'left out: {line}')
    if not found.added:
        say(f'{options.sensor} sees nothing that can be added')
    elif options.write:
        saved = editor.save_expected(options.sensor, found.boxes)
        assert saved is not None, 'there is a box'
        say(f'{saved.file}: {len(found.boxes)} added; backup: {saved.backup}. '
            f'Restart {options.sensor} to use it; in the launcher: Reload, Apply')
    else:
        say('dry run; --write adds it to the file')
    return 0


def _sought(cell: Cell, sensor: str) -> SoughtObjects:
    found = {it.name: it.objects for it in cell.devices if it.objects is not None}
    if not found:
        raise ValueError(f'{cell.file}: no depth sensor has <objects>')
    if sensor not in found:
        raise ValueError(f'{cell.file}: no depth sensor "{sensor}" has <objects>; '
                         + advice(sensor, found))
    return found[sensor]


def _looks(messages: Sequence[DetectedObjects], frame: str) -> List[Tuple[SeenObject, ...]]:
    """Return all objects of each message; ``frame`` is the global frame.

    Raises:
        ValueError: they are in another frame.
    """
    for it in messages:
        if it.header.frame_id != frame:
            raise ValueError(f'the objects are in the frame "{it.header.frame_id}", and the global '
                             f'frame of the configuration is "{frame}"; name the configuration '
                             'that runs')
    return [seen_objects(it) for it in messages]


def _listen(sensor: str) -> List[DetectedObjects]:
    """Return the messages that a sensor sends within some seconds.

    Raises:
        ValueError: there is no master, or no message arrives.
    """
    master = RosMaster()
    if not master.is_online():
        raise ValueError(f'there is no ROS master at {master.uri}; start the cell first')
    rospy.init_node('cell_expect', anonymous=True, disable_signals=True)
    messages: 'queue.Queue[DetectedObjects]' = queue.Queue()
    topic = f'/{sensor}/{OBJECTS}'
    subscriber = rospy.Subscriber(topic, DetectedObjects, messages.put)
    try:
        received = _received(messages)
    finally:
        subscriber.unregister()
    if not received:
        raise ValueError(f'{topic} has sent nothing for {START_S:.0f} s; start {sensor} first')
    return received


def _received(messages: 'queue.Queue[DetectedObjects]') -> List[DetectedObjects]:
    """Return the messages that arrive within a time after the first one; none: an empty list."""
    received: List[DetectedObjects] = []
    end_s = time.monotonic() + START_S
    try:
        while True:
            received.append(messages.get(timeout=max(end_s - time.monotonic(), 0.0)))
            if len(received) == 1:
                end_s = time.monotonic() + LOOK_S
    except queue.Empty:
        return received
