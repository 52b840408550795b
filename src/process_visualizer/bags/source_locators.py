"""What finds the numbers of a process variable in the messages of a recording."""
from __future__ import annotations

from typing import Dict, Optional, Sequence, Tuple

from process_visualizer.bags.bag_records import Connection
from process_visualizer.bags.curve_sources import CurveSource, Quantity, with_frames_of_model
from process_visualizer.bags.message_definition import DefinitionError
from process_visualizer.bags.number_places import (
    FieldLocator,
    FloatArrayLocator,
    Locator,
    TransformLocator,
)
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Device

_ARRAY = 'std_msgs/Float32MultiArray'
_TRANSFORMS = 'tf2_msgs/TFMessage'
_PATHS: Dict[Tuple[Quantity, str], str] = {
    (Quantity.SPEED, 'geometry_msgs/PoseStamped'): 'pose.position',
    (Quantity.FORCE, 'geometry_msgs/WrenchStamped'): 'wrench.force'}
_ARRAY_LENGTHS = {Quantity.SPEED: (3, 6, 7), Quantity.FORCE: (3, 6)}
_PLAIN_TYPES = tuple(f'std_msgs/{name}' for name in (
    'Bool', 'Byte', 'Char', 'Float32', 'Float64', 'Int8', 'Int16', 'Int32', 'Int64', 'UInt8',
    'UInt16', 'UInt32', 'UInt64'))


def source_locators(recording: Recording, source: CurveSource,
                    devices: Sequence[Device]) -> Dict[int, Locator]:
    """Return by connection what finds a source's numbers; of others there are none.

    May load the model of the source's device, to know the frame of its tool.
    """
    connections = recording.index.connections
    numbers = recording.index.connections_of(source.topic)
    if source.model and any(connections[number].type == _TRANSFORMS for number in numbers):
        source = with_frames_of_model(source, devices)
    found = {number: locator_for(source, connections[number]) for number in numbers}
    return {number: locator for number, locator in found.items() if locator is not None}


def locator_for(source: CurveSource, connection: Connection) -> Optional[Locator]:
    """Return what finds a source's numbers in a connection's messages; None if nothing can."""
    kind = connection.type
    if source.message_type not in ('', kind) or source.plain and kind not in _PLAIN_TYPES:
        return None
    if source.quantity is not Quantity.NUMBER and kind == _ARRAY:
        return FloatArrayLocator(3, _ARRAY_LENGTHS[source.quantity])
    if source.quantity is Quantity.SPEED and kind == _TRANSFORMS:
        return TransformLocator(*source.frames)
    vector = _PATHS.get((source.quantity, kind), '')
    paths = [f'{vector}.{axis}' for axis in 'xyz'] if vector else [source.field]
    try:
        return FieldLocator(kind, connection.message_definition, paths)
    except (DefinitionError, ValueError):
        return None
