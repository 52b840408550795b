# SPDX-License-Identifier: BSD-3-Clause
"""Frames whose poses are recorded: fixed frames, and those moved by /tf."""
from __future__ import annotations

from typing import Collection, Dict, List, NamedTuple, Set, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.number_places import (
    TransformFrames,
    TransformLocator,
    transforms_in,
)
from process_visualizer.bagio.recorder_topics import STATIC_FRAMES
from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import Series, part_numbers, read_samples
from process_visualizer.curves.source_locators import SourceLocators
from process_visualizer.page.robots import FramePlaces, Moving, carried, moved_along
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.placements import Placements
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TYPES


class _Sent(NamedTuple):
    """A moving frame: its parent, and the connections that send it."""

    parent: str
    connections: Tuple[int, ...]


def add_recorded_frames(places: FramePlaces, recording: Recording, wanted: Collection[str]) -> None:
    """Add the recording's fixed frames, and the moving frames that lead to the wanted ones.

    Frames that are known already are kept. Moving frames are read completely, so only the needed
    ones are read.
    """
    fixed = _fixed(recording)
    sent = _moving(recording)
    needed: Set[str] = set()
    for frame in wanted:
        seen: Set[str] = set()
        while places.find(frame) is None and frame not in seen and (
                frame in sent or frame in fixed):
            seen.add(frame)
            if frame in sent:
                needed.add(frame)
            frame = sent[frame].parent if frame in sent else fixed[frame][0]
    inner = {frame: (sent[frame].parent, place)
             for frame, place in _read(recording, {it: sent[it] for it in needed}).items()}
    for _ in range(len(fixed) + len(inner)):  # a chain is no longer than the number of frames
        before = places.count
        for frame, (parent, place) in fixed.items():
            outer = places.find(parent)
            if outer is not None and frame not in inner:
                places.add(frame, carried(outer, place))
        for frame, (parent, moving) in inner.items():
            outer = places.find(parent)
            if outer is not None:
                places.add(frame, moved_along(outer, moving))
        if places.count == before:
            break


def _fixed(recording: Recording) -> Dict[str, Tuple[str, Placement]]:
    """Return parent and pose of the frames on /tf_static, and of those stored by a recorder."""
    index = recording.index
    found: Dict[str, Tuple[str, Placement]] = {}
    connections = (*index.connections_of(STATIC_FRAMES), *index.connections_of(STATIC_TF_TOPIC))
    for position in index.positions_of(connections).tolist():
        try:
            data = recording.message(position)
        except BagDamaged:
            continue  # the recording reports the damage
        for it in transforms_in(data):
            x, y, z, *turn = np.frombuffer(data, '<f8', 7, it.pose).tolist()
            if np.isfinite((x, y, z, *turn)).all():
                found[it.child] = it.parent, Placement((x, y, z), tuple(turn))
    return found


def _moving(recording: Recording) -> Dict[str, _Sent]:
    """Return all frames that were ever sent on /tf."""
    found: Dict[str, _Sent] = {}
    static = recording.index.connections_of(STATIC_TF_TOPIC)
    for number, pairs in sent_pairs(recording).items():
        for parent, child in pairs if number not in static else ():
            known = found.get(child, _Sent(parent, ()))
            if known.parent == parent:
                found[child] = _Sent(parent, (*known.connections, number))
    return found


def sent_pairs(recording: Recording) -> Dict[int, List[Tuple[str, str]]]:
    """Return parent and child of all recorded transforms, by connection.

    Each message is checked, but only one of each layout is parsed.
    """
    found = {number: TransformFrames() for number, it in enumerate(recording.index.connections)
             if it.type in TF_TYPES}
    if found:
        part_numbers(recording, found)
    return {number: list(it.pairs) for number, it in found.items()}


def _read(recording: Recording, sent: Dict[str, _Sent]) -> Dict[str, Moving]:
    """Return the poses of frames in their parents, each from its time of receipt, as in RViz."""
    series: List[Series] = []
    for frame, it in sent.items():
        source = CurveSource('', frame, '', (0.0, 0.0, 0.0), Quantity.NUMBER, '')
        series.append(Series(source, SourceLocators((
            {number: TransformLocator(it.parent, frame) for number in it.connections},))))
    found: Dict[str, Moving] = {}
    for samples in read_samples(recording, series):
        rows = np.isfinite(samples.values).all(axis=1) & (samples.values[:, 3:].any(axis=1))
        times_s, values = samples.times_s[rows], samples.values[rows]
        times_s, first = np.unique(times_s, return_index=True)
        if len(times_s):
            found[samples.source.label] = Moving(
                times_s, Placements(values[first, :3], values[first, 3:]))
    return found
