# SPDX-License-Identifier: BSD-3-Clause
"""Everything that the program does with a bag."""
from __future__ import annotations

import contextlib
import tempfile
import warnings
from pathlib import Path
from typing import List, Tuple

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.marks import read_marks
from process_visualizer.bagio.message_layout import with_stamps_moved
from process_visualizer.bagio.recorder_topics import recorded_configuration
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import reindex
from process_visualizer.bagio.report import as_json, as_text, make_report
from process_visualizer.cell.model import Device
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.curves.curves import read_curves
from process_visualizer.curves.position_values import PositionValues
from process_visualizer.curves.topic_messages import topic_messages
from process_visualizer.playback.message_loader import MessageLoader
from process_visualizer.playback.playback_event import EventMaker


def read_all(path: Path, its_devices: Tuple[Device, ...]) -> List[str]:
    """Do everything with a bag; return the project's own errors.

    Raises:
    Exception: any other error, which is what the tests look for.
    """
    errors = []
    for read in (_read_messages, _read_events, _report, _catalog,
                 lambda it: read_curves([it], its_devices, 50),
                 lambda it: _position_values(it, its_devices), _reindex):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('error')
                read(str(path))
        except BagError as error:
            assert str(error).startswith(str(path.parent)), error
            errors.append(str(error))
    return errors


def _read_messages(path: str) -> None:
    with Recording([path]) as recording:
        loader = MessageLoader(recording)
        for position in range(len(recording.index)):
            message = loader.load(position)
            if message is not None:
                with_stamps_moved(message.data, message.stamp_offsets, lambda stamp_ns: 1)
        topic_messages(recording, range(len(recording.index.connections)), recording.begin_ns,
                       recording.end_ns, 1 << 30)
        assert all(path in problem or problem.startswith(loader_topics(recording))
                   for problem in loader.problems)


def loader_topics(recording: Recording) -> Tuple[str, ...]:
    return tuple(it.topic for it in recording.index.connections)


def _read_events(path: str) -> None:
    with Recording([path]) as recording:
        index = recording.index
        events = EventMaker(index, MessageLoader(recording), recording.begin_ns)
        for position in range(0, len(index), max(1, len(index) // 20)):
            for event in (events.forward(position), events.backward(position),
                          events.scene(position), events.scene(position + 1, True)):
                assert event.size > 0


def _report(path: str) -> None:
    with Recording([path]) as recording:
        report = make_report(recording)
        assert as_text(report).encode()
        assert as_json(report).encode()
        read_marks(recording)
        configuration = recorded_configuration(recording)
    if configuration is not None:
        # file systems do not accept every name
        with tempfile.TemporaryDirectory() as folder, contextlib.suppress(OSError):
            write_configuration(configuration, folder)


def _position_values(path: str, its_devices: Tuple[Device, ...]) -> None:
    values = PositionValues([path], its_devices)
    try:
        for position_s in (0.0, 1.0, 1.05, 3.0):
            values.at(position_s)
    finally:
        values.close()


def _catalog(path: str) -> None:
    catalog = read_catalog([path])
    assert all(path in problem for problem in catalog.problems)


def _reindex(path: str) -> None:
    copy = reindex(path)
    with Recording([copy.path]) as recording:
        assert not recording.gaps
        assert len(recording.index) + recording.index.left_out == copy.message_count
    _read_messages(copy.path)
