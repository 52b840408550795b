# SPDX-License-Identifier: BSD-3-Clause
"""Locators of the numbers of a process variable in the messages of a recording."""
from __future__ import annotations

from typing import Callable, Dict, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Device
from process_visualizer.curves.curve_sources import CurveSource, Quantity, tool_from_joints
from process_visualizer.curves.number_columns import Numbers
from process_visualizer.curves.tool_on_tf import Messages, tool_on_tf
from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_definition import DefinitionError
from process_visualizer.messages.number_places import FieldLocator, FloatArrayLocator, Locator
from process_visualizer.motion.placements import interpolated
from process_visualizer.motion.tool_path import MovingPart, SentTransform, ToolPath
from process_visualizer.motion.velocity.speed_series import measuring_times
from process_visualizer.motion.velocity.velocity_estimator import GAP_S
from process_visualizer.ros_names import FLOAT_ARRAY, POSE_STAMPED, TF_MESSAGE, WRENCH_STAMPED

_PATHS: Dict[Tuple[Quantity, str], str] = {
    (Quantity.SPEED, POSE_STAMPED): 'pose.position',
    (Quantity.FORCE, WRENCH_STAMPED): 'wrench.force'}
_ARRAY_LENGTHS = {Quantity.SPEED: (3, 6, 7), Quantity.FORCE: (3, 6)}
_PLAIN_TYPES = tuple(f'std_msgs/{name}' for name in (
    'Bool', 'Byte', 'Char', 'Float32', 'Float64', 'Int8', 'Int16', 'Int32', 'Int64', 'UInt8',
    'UInt16', 'UInt32', 'UInt64'))

MeasuringTimes = Callable[[Numbers], np.ndarray]
"""Returns when numbers (n, k) were measured: (n,) [s] from a beginning."""


class SourceLocators(NamedTuple):
    """Locators of a source's numbers: by connection, for each part that they are composed of.

    ``path`` puts together where a tool is of what moves it; without it there is one part.
    """

    parts: Tuple[Dict[int, Locator], ...]
    path: Optional[ToolPath] = None

    @property
    def connections(self) -> Tuple[int, ...]:
        """The connections of all parts; none where a part has none."""
        found = {number for part in self.parts for number in part}
        return tuple(sorted(found)) if all(self.parts) else ()

    def joined(self, measured: MeasuringTimes, parts: Sequence[Numbers]) -> Numbers:
        """Return the source's numbers, given those of its parts, and when those were measured.

        Of a tool, they are its positions at the times of what moves it and is the nearest to it:
        a recorded transform, if there is one.
        """
        path = self.path
        if path is None:
            return parts[0]
        leader = next((row for row, it in enumerate(path.moving)
                       if isinstance(it, SentTransform)), 0)
        times_s = measured(parts[leader])
        values = {moving: _at(times_s, measured(part), part.values, moving)
                  for moving, part in zip(path.moving, parts)}
        positions = path.places(values).positions
        known = np.isfinite(positions).all(axis=1)
        return Numbers(parts[leader].positions[known], positions[known],
                       parts[leader].stamps_ns[known])


def _at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray,
        moving: MovingPart) -> np.ndarray:
    if isinstance(moving, SentTransform):
        return interpolated(times_s, known_s, values, GAP_S, slice(3, 7))
    if moving.kind == 'continuous':
        values = np.unwrap(values, axis=0)
    return interpolated(times_s, known_s, values, GAP_S)


def measured_s(recording: Recording, numbers: Numbers,
               period_s: Optional[float] = None) -> np.ndarray:
    """Return when numbers were measured (n,) [s from the beginning]; see measuring_times."""
    recorded_s = (recording.index.time_ns[numbers.positions] - recording.begin_ns) / 1e9
    stamps_s = np.where(numbers.stamps_ns > 0, (numbers.stamps_ns - recording.begin_ns) / 1e9,
                        np.nan)
    return measuring_times(recorded_s, stamps_s, period_s)


def source_locators(messages: Messages, source: CurveSource,
                    devices: Sequence[Device]) -> SourceLocators:
    """Return what finds a source's numbers in messages; may load the device's model."""
    connections = messages.index.connections
    numbers = messages.index.connections_of(source.topic)
    if source.quantity is Quantity.SPEED:
        on_tf = [number for number in numbers if connections[number].type == TF_MESSAGE
                 and source.message_type in ('', TF_MESSAGE)]
        device = next(it for it in devices if it.name == source.device)
        is_computed = tool_from_joints(device)
        is_on_tf = on_tf or source.message_type == TF_MESSAGE or is_computed
        found = tool_on_tf(messages, source, device, on_tf) if is_on_tf else None
        if found is not None:
            return SourceLocators(found[1], found[0])
        if is_computed:
            return SourceLocators(({},))
    located = {number: locator_for(source, connections[number]) for number in numbers}
    return SourceLocators(({number: locator for number, locator in located.items()
                            if locator is not None},))


def locator_for(source: CurveSource, connection: Connection) -> Optional[Locator]:
    """Return what finds a source's numbers in a connection's messages; None if nothing can."""
    kind = connection.type
    if source.message_type not in ('', kind) or source.plain and kind not in _PLAIN_TYPES:
        return None
    if source.quantity is not Quantity.NUMBER and kind == FLOAT_ARRAY:
        return FloatArrayLocator(3, _ARRAY_LENGTHS[source.quantity])
    vector = _PATHS.get((source.quantity, kind), '')
    paths = [f'{vector}.{axis}' for axis in 'xyz'] if vector else [source.field]
    try:
        return FieldLocator(kind, connection.message_definition, paths)
    except (DefinitionError, ValueError):
        return None
