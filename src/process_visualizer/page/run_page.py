# SPDX-License-Identifier: BSD-3-Clause
"""A run as data of a page: all that the browser draws, computed by the program's own functions."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.curves import colored
from process_visualizer.curves.position_values import key_of
from process_visualizer.curves.samples import found_series, read_samples
from process_visualizer.curves.source_locators import joint_matching
from process_visualizer.page.clouds import cloud_entries
from process_visualizer.page.lanes import alarm_entries, curves_of, grid_over, lane_entries
from process_visualizer.page.link_meshes import LinkMeshes, thinned
from process_visualizer.page.numbers import (
    SourceSamples,
    arrow_entries,
    ghost_arrow_entries,
    held,
    is_whole,
    number_entry,
)
from process_visualizer.page.objects import object_track
from process_visualizer.page.packed import Packed
from process_visualizer.page.recorded_frames import add_recorded_frames
from process_visualizer.page.robots import (
    FramePlaces,
    PageSpan,
    Place,
    RowsOfJoints,
    base_place,
    carried,
    deviation_entry,
    fine_rows,
    held_rows,
    joints_without_data,
    link_places,
    shown_spans,
    standing_on,
    upwards,
)
from process_visualizer.robot.description import ModelError, RobotDescription, describe_device
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.visuals import link_visuals
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost import (
    GhostArm,
    arms,
    ghost_arrows,
    ghost_tracks,
    run_arrows,
)
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import timeline_bands
from process_visualizer.runs.comparison.wording import (
    amount,
    began,
    moment,
    nearest_text,
    unjudged_texts,
    verdict,
)
from process_visualizer.runs.recorded.robot_series import joint_series
from process_visualizer.runs.recorded.run_reader import as_received
from process_visualizer.runs.run import Run

MAX_ROWS = 12
"""Maximum number of departures in the table of a run."""


def run_words(run: Run, comparison: Optional[Comparison], notes: Sequence[str],
              span: PageSpan) -> Dict[str, Any]:
    """Return the texts of a run for the page; times are those of the recording."""
    words: Dict[str, Any] = {'name': run.name, 'begin': span.begin_s, 'end': span.end_s,
                             'state': 'plain', 'verdict': 'not compared with good runs',
                             'nearest': '', 'notes': list(notes), 'departures': [],
                             'moments': _moments(run, span)}
    if comparison is None:
        return words
    found = comparison.departures
    state = 'plain' if comparison.why_not else 'poor' if found else 'good'
    return {**words, 'state': state, 'verdict': verdict(comparison),
            'nearest': nearest_text(comparison),
            'notes': [*comparison.notes, *unjudged_texts(comparison), *notes],
            'departures': [_departure(comparison, row) for row in range(len(found[:MAX_ROWS]))],
            'more': max(len(found) - MAX_ROWS, 0)}


def _departure(comparison: Comparison, row: int) -> Dict[str, Any]:
    it, begin_s = comparison.departures[row], comparison.run.begin_s
    return {'what': it.signal.name, 'device': it.signal.device, 'label': it.signal.label,
            'began': began(comparison, it),
            'began_s': begin_s + comparison.run_s(it.onset_s),
            'worst': moment(comparison, it.worst_s),
            'worst_s': begin_s + comparison.run_s(it.worst_s), 'amount': amount(it)}


def _moments(run: Run, span: PageSpan) -> List[Dict[str, Any]]:
    """Return the events of the process and the marks in a span."""
    return [{'label': it.name, 'at': at_s} for it in run.events
            for at_s in [run.begin_s + it.time_s] if span.begin_s <= at_s <= span.end_s]


_NORMAL_STEPS = 127


class Judged(NamedTuple):
    """A run, its comparison, and the good runs that it was compared with."""

    run: Run
    comparison: Optional[Comparison] = None
    good: Optional[GoodRuns] = None

    @property
    def badness(self) -> Tuple[bool, float]:
        """Return a key to sort runs: greatest for a failed comparison, then for the worst run."""
        it = self.comparison
        return (False, -1.0) if it is None else (bool(it.why_not), it.badness)


class PageCell:
    """The models of a cell, which all runs of a page share."""

    def __init__(self, cell: Cell, packed: Packed) -> None:
        """Load models and meshes; ``notes`` names those that cannot be loaded."""
        self.cell, self._packed = cell, packed
        self.notes: List[str] = []
        self.models: Dict[str, RobotDescription] = {}
        for device in cell.devices:
            try:
                description = describe_device(device, cell.frame)
            except (ModelError, OSError) as error:
                self.notes.append(f'not shown: the model of {device.name}: {error}')
                continue
            if description is not None:
                self.models[device.name] = description
        self.arms = {it.device.name: it for it in arms(cell, self.models)}
        self.meshes, self.parts = self._meshes()

    def _meshes(self) -> Tuple[List[Dict[str, Any]], List[Dict[str, Any]]]:
        """Return the meshes, equal ones only once, and the mesh of each link of each device."""
        reader, found = LinkMeshes(), []
        for name, model in self.models.items():
            found += [(name, it) for it in reader.of(link_visuals(model.text))]
        self.notes += reader.notes
        whole = [it.mesh for _, it in found]
        slim = thinned(whole)
        before, behind = (sum(len(it.triangles) for it in meshes) for meshes in (whole, slim))
        if behind < before:
            self.notes.append(f'meshes are thinned for the browser: {behind} of {before} triangles')
        meshes: List[Dict[str, Any]] = []
        numbers: Dict[str, int] = {}
        parts = []
        for (name, link), mesh in zip(found, slim):
            entry = {'positions': self._packed.scaled(mesh.positions),
                     'normals': self._packed.plain(np.rint(
                         _NORMAL_STEPS * np.clip(mesh.normals, -1.0, 1.0)).astype(np.int8)),
                     'colors': self._packed.plain(mesh.colors.astype(np.uint8)),
                     'triangles': self._packed.plain(mesh.triangles.astype(
                         np.uint16 if len(mesh.positions) < 65_536 else np.uint32))}
            number = numbers.setdefault(repr(entry), len(meshes))
            if number == len(meshes):
                meshes.append(entry)
            parts.append({'device': name, 'link': link.link, 'mesh': number})
        return meshes, parts


def run_entry(shared: PageCell, recording: Recording, judged: Judged, span: PageSpan,
              packed: Packed, with_clouds: bool = False,
              with_frames: bool = False) -> Dict[str, Any]:
    """Return the data of a run.

    Args:
        shared: the models that the runs of a page share.
        recording: the run's recording.
        judged: the run.
        span: the shown part of the recording.
        packed: collects the columns.
        with_clouds: include the clouds of depth sensors.
        with_frames: include every known frame, even if nothing on the page refers to it.
    """
    cell, run = shared.cell, judged.run
    duration_s = (recording.end_ns - recording.begin_ns) / 1e9
    notes = list(shared.notes)
    if not shared.parts and not notes:
        notes.append('the configuration has no model of a robot or machine; the picture has none')
    read = _read(shared, recording)
    places = FramePlaces(packed, span)
    places.add(cell.frame, Placement())
    for device in cell.devices:
        if device.base is not None:
            places.add(device.base.frame, base_place(device))
    arrows = run_arrows(cell, as_received(recording, cell, [it.samples for it in read.numbers]),
                        shared.models)
    add_recorded_frames(places, recording, [
        *(it.root for it in shared.arms.values()),
        *(frame for it in arrows for frame in (it.frame, it.foot_frame)),
        *(it.roi.frame for it in cell.devices if it.roi is not None and with_clouds)])
    for name, arm in shared.arms.items():
        if places.find(arm.root) is None and arm.device.base is None:
            notes.append(f'{name}: the recording does not say where its frame {arm.root} is; '
                         f'shown at {cell.frame}')
        joints = read.joints.get(name, {})
        unknown = joints_without_data(arm.kinematics, joints)
        if unknown:
            notes.append(f'{name}: no positions of {", ".join(unknown[:4])}'
                         f'{" …" if len(unknown) > 4 else ""} were recorded; shown at 0')
        _add_arm(places, arm, held_rows(joints, span), _base(places, arm))
    clouds, missing = cloud_entries(cell, recording, places, packed, span) \
        if with_clouds else ([], [])
    notes += missing
    by_name = {it.name: it for it in cell.devices}
    samples = read.numbers
    entries = [number_entry(by_name[it.samples.source.device], it, packed, span)
               for it in samples if len(it.samples.times_s)]
    sources = [it.samples.source for it in samples]
    notes += [f'{it.source.device} {it.source.channel_label}: no number was recorded, at most NaN '
              'or infinity' for it in (row.samples for row in samples)
              if not np.isfinite(it.values).any()]
    grid = grid_over(duration_s, span)
    curves = curves_of([it.samples for it in samples], grid)
    labels = {key_of(it.device, it.label, it.topic): it.channel_label for it in sources}
    bands = {} if judged.comparison is None or judged.good is None else timeline_bands(
        [judged.comparison], grid.duration_s, grid.columns)
    entry = {
        **run_words(run, judged.comparison, notes, span), 'duration': duration_s,
        'recorded': recording.begin_ns / 1e9, 'numbers': entries,
        'lanes': lane_entries(curves, labels, bands, grid, packed),
        'alarms': alarm_entries(cell.devices, curves, span),
        'parts': [{**part, 'place': places.number(str(part['link']))} for part in shared.parts],
        'arrows': arrow_entries(cell, arrows, sources, places, packed, span),
        'tools': {name: {'place': number, 'up': upwards(base_place(arm.device))}
                  for name, arm in shared.arms.items() if name in read.joints
                  for number in [places.number(arm.tool)] if number is not None},
        'clouds': clouds, 'objects': object_track(cell.devices, recording, places, packed, span),
        'ghost': _ghost(shared, judged, places, packed, span)}
    if with_frames:
        entry['frames'] = {frame: places.number(frame) for frame in places.names}
    entry['places'] = places.entries
    return entry


def _base(places: FramePlaces, arm: GhostArm) -> Place:
    """Return the pose of a robot's base: as configured, otherwise as recorded."""
    found = places.find(arm.root)
    return base_place(arm.device) if arm.device.base is not None or found is None else found


def _add_arm(places: FramePlaces, arm: GhostArm, rows: RowsOfJoints, base: Place) -> None:
    """Add the links of a model, and the frames of the configuration that are fixed to them."""
    found = link_places(arm.kinematics, *standing_on(base, rows))
    for link, place in found.items():
        places.add(link, place)
    for frame in (arm.tool, '' if arm.device.force is None else arm.device.force.frame):
        fixed = arm.fixed(frame) if frame else None
        if fixed is not None and fixed[0] in found:
            places.add(frame, carried(found[fixed[0]], fixed[1]))


class _Read(NamedTuple):
    """Contents of a recording: numbers, and by robot and joint the times [s] and positions (n,)."""

    numbers: List[SourceSamples]
    joints: Dict[str, Dict[str, Tuple[np.ndarray, np.ndarray]]]


def _read(shared: PageCell, recording: Recording) -> _Read:
    """Read all series in one pass; messages count from their time of receipt, as in RViz."""
    cell = shared.cell
    series = colored(found_series(recording, curve_sources(cell.devices), cell.devices))
    of_joints = [(arm.device, joint, it) for name, arm in shared.arms.items()
                 for joint, it in joint_series(recording, arm.device, shared.models[name]).items()]
    samples = read_samples(recording, [*series, *(it for _, _, it in of_joints)])
    joints: Dict[str, Dict[str, Tuple[np.ndarray, np.ndarray]]] = {}
    for (device, joint, _), found in zip(of_joints, samples[len(series):]):
        times_s, values = held(found)
        known = np.isfinite(values)
        if known.any():
            offset = joint_matching(device, shared.models[device.name]).offset(joint)
            joints.setdefault(device.name, {})[joint] = times_s[known], values[known] + offset
    return _Read([SourceSamples(found, is_whole(recording, it))
                  for it, found in zip(series, samples)], joints)


def _ghost(shared: PageCell, judged: Judged, places: FramePlaces, packed: Packed,
           span: PageSpan) -> Optional[Dict[str, Any]]:
    """Return the reference run, aligned with the run; None without a verdict."""
    comparison, good = judged.comparison, judged.good
    if comparison is None or good is None or comparison.why_not:
        return None
    cell, models = shared.cell, shared.models
    robots, deviations = [], []
    frames = FramePlaces(packed, span)
    frames.entries = places.entries
    for track in ghost_tracks(cell, good.reference, [comparison], models):
        arm = shared.arms[track.device]
        _add_arm(frames, arm, fine_rows(track.there), _base(places, arm))
        robots.append({'device': track.device, 'shown': shown_spans(track.there)})
        base = _base(places, arm)
        found = deviation_entry(track, arm.kinematics, base, packed, span) \
            if isinstance(base, Placement) else None
        if found is not None:
            deviations.append({'device': track.device, **found})
    for device in cell.devices:
        if device.base is not None:
            frames.add(device.base.frame, base_place(device))
    moving = {str(it['device']) for it in robots}
    return {'name': good.reference.name, 'robots': robots, 'deviations': deviations,
            'parts': [{**part, 'place': frames.number(str(part['link']))}
                      for part in shared.parts if part['device'] in moving],
            'arrows': ghost_arrow_entries(
                cell, ghost_arrows(cell, good.reference, [comparison], models), frames, packed,
                span)}
