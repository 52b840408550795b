# SPDX-License-Identifier: BSD-3-Clause
"""Places of numbers in the bytes of a message, and the other messages that share them."""
from __future__ import annotations

import re
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from process_visualizer.bagio.message_definition import (
    HEADER,
    PRIMITIVE_FORMATS,
    PRIMITIVE_SIZES,
    STRING,
    Definitions,
    Field,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.message_layout import (
    Data,
    MessageDamaged,
    ValueBudget,
    checked_end,
    read_length,
    read_text,
)
from process_visualizer.cell.errors import nearest
from process_visualizer.ros_names import JOINT_STATE

_PART = re.compile(r'([A-Za-z]\w*)((?:\[\d+\])*)\Z', re.ASCII)
_INDEX = re.compile(r'\[(\d+)\]')


class FieldPath:
    """A path of names and array indices from a message to a number.

    A message is any object that lists its fields in __slots__, as ROS's generated classes do.
    """

    def __init__(self, text: str) -> None:
        """Initialize with the path's text.

        Raises:
            ValueError: the text is not a path.
        """
        self._text = text
        self._steps: List[Union[str, int]] = []
        for part in text.split('.'):
            match = _PART.match(part)
            if match is None:
                raise ValueError(f'{text!r} is not a valid field path; write a path such as data, '
                                 'data[2] or wrench.force.z')
            self._steps.append(match.group(1))
            self._steps += [int(index) for index in _INDEX.findall(match.group(2))]

    def __str__(self) -> str:
        """Return the path as it was written."""
        return self._text

    @property
    def steps(self) -> Tuple[Union[str, int], ...]:
        """The names of fields and the indices of elements, from the message inwards."""
        return tuple(self._steps)

    def number(self, message: Any) -> Union[int, float]:
        """Return the number at the path; a boolean is 0 or 1.

        Raises:
            ValueError: the field or element does not exist, or is not a number; the text says what
                does exist.
        """
        value, here = message, ''
        for step in self._steps:
            value = _element(value, here, step) if isinstance(step, int) else _field(
                value, here, step)
            here += f'[{step}]' if isinstance(step, int) else f'.{step}' if here else step
        if isinstance(value, (int, float)):  # a bool is an int too
            return value + 0
        raise ValueError(f'{here} is not a number but {_describe(value, here)}')


def _field(value: Any, here: str, name: str) -> Any:
    names = _names(value)
    if name in names:
        return getattr(value, name)
    if here and not names:
        raise ValueError(f'{here} is {_describe(value, here)}, and has no field {name}')
    meant = nearest(name, names)
    what = here or getattr(value, '_type', type(value).__name__)
    raise ValueError(f'{what} has no field {name}, it has {", ".join(names) or "none"}'
                     + (f'; did you mean {meant}?' if meant else ''))


def _element(value: Any, here: str, index: int) -> Any:
    if not _is_array(value):
        raise ValueError(f'{here} is not an array but {_describe(value, here)}')
    if index >= len(value):
        raise ValueError(f'{here}[{index}] is out of range: {here} has {len(value)} elements')
    return value[index]


def _describe(value: Any, here: str) -> str:
    if isinstance(value, (int, float)):
        return 'a number'
    if isinstance(value, str):
        return 'a string'
    if _is_array(value):
        return f'an array of {len(value)} elements; write {here}[0] for the first'
    fields = ', '.join(f'{here}.{name}' for name in _names(value))
    return f'a submessage; its fields are {fields}'


def _is_array(value: Any) -> bool:
    return isinstance(value, (list, tuple, bytes))  # rospy gives uint8[] as bytes


def _names(value: Any) -> List[str]:
    return list(getattr(value, '__slots__', ()))


_LENGTH_BYTES = 4
_STAMP_OFFSET = 4  # in a std_msgs/Header, after the sequence number
_MAX_ELEMENTS = 100_000  # limit of elements walked over one by one
_FLOAT32, _FLOAT64 = PRIMITIVE_FORMATS['float32'], PRIMITIVE_FORMATS['float64']
_NUMBERS: Dict[str, str] = {  # times are not numbers
    name: code for name, code in PRIMITIVE_FORMATS.items() if name not in ('time', 'duration')}
_STAMPED_BYTES = 12  # sequence number and stamp of a std_msgs/Header
_POSE_BYTES = 7 * 8


class Place(NamedTuple):
    """A number: the byte where it begins, and its kind in the notation of numpy."""

    offset: int
    kind: str


class NumberPlaces(NamedTuple):
    """The places of the wanted numbers; none if the message does not have them.

    The places are the same in every message of the same length with the same bytes in the
    ``fixed`` ranges (begin, end). ``stamp`` is the byte of the header's stamp, if there is one.
    """

    numbers: Tuple[Place, ...]
    fixed: Tuple[Tuple[int, int], ...] = ()
    stamp: Optional[int] = None


class Locator(ABC):
    """Finds the places of ``number_count`` numbers in messages of one type."""

    number_count: int

    @abstractmethod
    def places(self, data: Data) -> NumberPlaces:
        """Return the places in a message; none if it does not fit its definition."""


class FieldLocator(Locator):
    """Finds fields by their paths."""

    def __init__(self, type_name: str, definition: str, paths: Sequence[str]) -> None:
        """Initialize with the type, its definition from the bag, and paths such as pose.position.x.

        Raises:
            DefinitionError: the definition is invalid.
            ValueError: a path is invalid.
        """
        self._type = short_name(type_name)
        self._definitions = parse_definitions(self._type, definition)
        self._paths = [FieldPath(path) for path in paths]
        self.number_count = len(self._paths)

    def places(self, data: Data) -> NumberPlaces:
        """See Locator."""
        walk = _Walk(self._definitions, data)
        try:
            numbers = tuple(walk.place(self._type, path) for path in self._paths)
        except (MessageDamaged, KeyError, RecursionError):
            numbers = ()
        return NumberPlaces(numbers, tuple(dict.fromkeys(walk.lengths)), self._stamp())

    def _stamp(self) -> Optional[int]:
        first = self._definitions[self._type][:1]
        has_header = first and first[0].type_name == HEADER and not first[0].is_array
        return _STAMP_OFFSET if has_header else None


class FloatArrayLocator(Locator):
    """Finds consecutive numbers in a std_msgs/Float32MultiArray of certain lengths."""

    def __init__(self, count: int, lengths: Sequence[int], first: int = 0) -> None:
        """Initialize with the number of values, the valid lengths, and the first value's index."""
        self.number_count = count
        self._lengths, self._first = lengths, first

    def places(self, data: Data) -> NumberPlaces:
        """See Locator; padding (data_offset) is left out, as in float32_values."""
        try:
            begin, count, padding = float_array(data)
        except MessageDamaged:
            return NumberPlaces(())
        numbers: Tuple[Place, ...] = ()
        if count - padding in self._lengths and len(data) == begin + 4 * count:
            numbers = tuple(Place(begin + 4 * (padding + self._first + number), _FLOAT32)
                            for number in range(self.number_count))
        return NumberPlaces(numbers, ((0, begin),))


def float_array(data: Data) -> Tuple[int, int, int]:
    """Return where the numbers of a std_msgs/Float32MultiArray begin [byte], and their count.

    The third value is the number of padding values before them (the layout's data_offset).

    Raises:
        MessageDamaged: the message ends inside its layout.
    """
    dimensions, position = read_length(data, 0)
    for _ in range(dimensions):
        _, position = read_text(data, position)
        position = checked_end(data, position, 2 * _LENGTH_BYTES)  # size and stride
    padding, position = read_length(data, position)
    count, position = read_length(data, position)
    return position, count, padding


class TransformPlaces(NamedTuple):
    """A transform in a message: the bytes where the transform, its frames and its pose begin."""

    begin: int
    names: int
    pose: int  # float64: x y z [m], x y z w
    parent_name: bytes
    child_name: bytes

    @property
    def parent(self) -> str:
        """The frame in which the pose is given."""
        return self.parent_name.decode('utf-8', 'replace').strip('/')

    @property
    def child(self) -> str:
        """The frame whose pose it is."""
        return self.child_name.decode('utf-8', 'replace').strip('/')

    @property
    def stamp(self) -> int:
        """The byte where its stamp begins."""
        return self.begin + _STAMP_OFFSET

    @property
    def end(self) -> int:
        """The byte after the transform."""
        return self.pose + _POSE_BYTES


def transform_places(data: Data) -> Iterator[TransformPlaces]:
    """Yield the places of the transforms in a tf2_msgs/TFMessage.

    Raises:
        MessageDamaged: the message ends inside a transform, or has bytes after the last one.
    """
    count, begin = read_length(data, 0)
    for _ in range(count):
        names = begin + _STAMPED_BYTES
        parent, child_at = read_text(data, names)
        child, pose = read_text(data, child_at)
        end = checked_end(data, pose, _POSE_BYTES)
        yield TransformPlaces(begin, names, pose, parent, child)
        begin = end
    if begin != len(data):
        raise MessageDamaged(f'the transforms take {begin} bytes, and there are {len(data)}')


class TransformLocator(Locator):
    """Finds the pose (x y z, x y z w) of a frame in its parent, in a tf2_msgs/TFMessage."""

    number_count = 7

    def __init__(self, parent: str, child: str) -> None:
        """Initialize with the parent and the child frame."""
        self._frames = parent.strip('/'), child.strip('/')

    def places(self, data: Data) -> NumberPlaces:
        """See Locator."""
        fixed = [(0, _LENGTH_BYTES)]
        for it in transforms_in(data):
            fixed.append((it.names, it.pose))
            if (it.parent, it.child) == self._frames:
                numbers = tuple(Place(it.pose + 8 * number, _FLOAT64)
                                for number in range(self.number_count))
                return NumberPlaces(numbers, tuple(fixed), it.stamp)
        return NumberPlaces((), tuple(fixed))


class TransformFrames(Locator):
    """Collects parent and child of each transform in messages of type tf2_msgs/TFMessage."""

    number_count = 0

    def __init__(self) -> None:
        """Start without transforms."""
        self.pairs: Dict[Tuple[str, str], None] = {}

    def places(self, data: Data) -> NumberPlaces:
        """See Locator; there are no numbers."""
        fixed = [(0, _LENGTH_BYTES)]
        for it in transforms_in(data):
            fixed.append((it.names, it.pose))
            self.pairs[it.parent, it.child] = None
        return NumberPlaces((), tuple(fixed))


def transforms_in(data: Data) -> Iterator[TransformPlaces]:
    """Yield the places of the transforms in a tf2_msgs/TFMessage, up to a damaged one."""
    with suppress(MessageDamaged):
        yield from transform_places(data)


class JointPlaces(NamedTuple):
    """The joints of a message, and the byte where the position (float64) of each begins.

    In a damaged message, the numbers of names and positions may differ. ``fixed`` are the ranges of
    bytes that these places depend on.
    """

    names: Tuple[str, ...]
    offsets: Tuple[int, ...]
    fixed: Tuple[Tuple[int, int], ...]


def joint_places(message_type: str, data: Data) -> JointPlaces:
    """Return the places of the joints' positions in a message of one of the types `NAMED_JOINTS`.

    Raises:
        MessageDamaged: the message ends too early.
    """
    _, position = read_text(data, _STAMPED_BYTES)
    names, position = _texts(data, position)
    if message_type == JOINT_STATE:
        count, position = read_length(data, position)
        checked_end(data, position, 8 * count)
        return JointPlaces(names, tuple(range(position, position + 8 * count, 8)),
                           ((_STAMPED_BYTES, position),))
    found, fixed, begin = {}, [], _STAMPED_BYTES
    count, position = read_length(data, position)
    for name in names[:count]:  # control_msgs/InterfaceValue
        interfaces, position = _texts(data, position)
        length, position = read_length(data, position)
        fixed.append((begin, position))
        begin = checked_end(data, position, 8 * length)
        if 'position' in interfaces[:length]:
            found[name] = position + 8 * interfaces.index('position')
        position = begin
    return JointPlaces(tuple(found), tuple(found.values()), tuple(fixed))


def _texts(data: Data, position: int) -> Tuple[Tuple[str, ...], int]:
    """Return an array of strings, and the position after it."""
    count, position = read_length(data, position)
    found = []
    for _ in range(min(count, _MAX_ELEMENTS)):
        text, position = read_text(data, position)
        found.append(text.decode('utf-8', 'replace'))
    return tuple(found), position


class JointLocator(Locator):
    """Finds the position of a joint in a message of one of the types `NAMED_JOINTS`."""

    number_count = 1

    def __init__(self, message_type: str, names: Sequence[str]) -> None:
        """Initialize with the type of the messages, and the possible names of the joint."""
        self._type, self._names = message_type, names

    def places(self, data: Data) -> NumberPlaces:
        """See Locator."""
        try:
            joints = joint_places(self._type, data)
        except MessageDamaged:
            return NumberPlaces(())
        numbers = [Place(offset, _FLOAT64) for name, offset in zip(joints.names, joints.offsets)
                   if name in self._names]
        return NumberPlaces(tuple(numbers[:1]), joints.fixed, _STAMP_OFFSET)


class _Walk:
    """A walk over one message that records the lengths it depends on."""

    def __init__(self, definitions: Definitions, data: Data) -> None:
        self._definitions = definitions
        self._data = data
        self._budget = ValueBudget(data)
        self.lengths: List[Tuple[int, int]] = []

    def place(self, type_name: str, path: FieldPath) -> Place:
        """Return the place of a number.

        Raises:
            MessageDamaged, KeyError: the message has no such number.
        """
        self._budget = ValueBudget(self._data)
        position = 0
        field = Field('', type_name, False, None)
        for step in path.steps:
            field, position = self._inside(field, position, step)
        if field.is_array:
            raise KeyError(field.name)
        kind = _NUMBERS[field.type_name]
        checked_end(self._data, position, PRIMITIVE_SIZES[field.type_name])
        return Place(position, kind)

    def _inside(self, field: Field, position: int, step: Union[str, int]) -> Tuple[Field, int]:
        """Return an element or subfield of a field, and where it begins."""
        element = field._replace(is_array=False, length=None)
        if isinstance(step, int):
            count, position = self._count(field, position)
            if not field.is_array or step >= count:
                raise KeyError(step)
            return element, self._skip_elements(element, step, position)
        if field.is_array:
            raise KeyError(step)
        for inner in self._definitions[field.type_name]:
            if inner.name == step:
                return inner, position
            position = self._skip(inner, position)
        raise KeyError(step)

    def _count(self, field: Field, position: int) -> Tuple[int, int]:
        if field.length is not None:
            return field.length, position
        self.lengths.append((position, position + _LENGTH_BYTES))
        return read_length(self._data, position)

    def _skip(self, field: Field, position: int) -> int:
        self._budget.spend(1)
        if field.is_array:
            count, position = self._count(field, position)
            return self._skip_elements(field._replace(is_array=False, length=None), count, position)
        if field.type_name in PRIMITIVE_SIZES:
            return checked_end(self._data, position, PRIMITIVE_SIZES[field.type_name])
        if field.type_name == STRING:
            length, position = self._count(field, position)
            return checked_end(self._data, position, length)
        for inner in self._definitions[field.type_name]:
            position = self._skip(inner, position)
        return position

    def _skip_elements(self, element: Field, count: int, position: int) -> int:
        size = PRIMITIVE_SIZES.get(element.type_name)
        if size is not None:
            return checked_end(self._data, position, size * count)
        if count > _MAX_ELEMENTS:
            raise KeyError(element.name)
        for _ in range(count):
            position = self._skip(element, position)
        return position
