# SPDX-License-Identifier: BSD-3-Clause
"""The scene of a live page: the current poses of frames, and the arrows and texts of RViz.

A layout lists the poses, arrows and texts; a frame has a row of numbers for each of them, changed
or not, so that any frame may be skipped on its way to a viewer.
"""
from __future__ import annotations

import math
from struct import Struct
from types import MappingProxyType
from typing import (
    Any,
    Dict,
    Iterable,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from process_visualizer.bagio.message_layout import Data
from process_visualizer.bagio.number_places import transforms_in
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.page.live_markers import (
    FAR_M,
    MarkerAction,
    MarkerType,
    SeenMarker,
    markers_in,
)
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import Quaternion
from process_visualizer.ros_names import GHOST, GHOST_TOPIC

MAX_MARKERS = 200
"""Maximum number of arrows and texts of a page; further ones are left out."""
MAX_FRAMES = 2000
FRAME = 1
"""First byte of an encoded frame; see `LiveScene.frame`."""
_HEAD = Struct('<BxHId')
_PLACE = Struct('<3f4h')
_ARROW = Struct('<6f3B')
_TEXT = Struct('<3BB')
_POSE = Struct('<7d')
_MAX_QUATERNION = 1e3
"""Maximum of its parts; products of much greater ones would overflow."""
_TURN_STEPS = 32_767
_MAX_TEXT_BYTES = 255
_NOWHERE = _PLACE.pack(math.nan, math.nan, math.nan, 0, 0, 0, _TURN_STEPS)
_NO_ARROW = _ARROW.pack(*[math.nan] * 6, 0, 0, 0)
_NO_TEXT = _TEXT.pack(0, 0, 0, 0)
_VARIABLE = 'variable/'
_QUANTITIES = {'velocity': (Quantity.SPEED.value, 'v'), 'force': (Quantity.FORCE.value, 'F'),
               'joints': ('joints', 'joints')}
_LIGHT = 0.65  # share of white in a text's color: see nodes/common/markers.py


class NewestFrames:
    """The newest transform of each frame, regardless of its stamp, as RViz draws models."""

    def __init__(self, root: str) -> None:
        """Start without frames; poses are returned in the frame ``root``."""
        self._root = root
        self._above: Dict[str, Tuple[str, Placement, bool]] = {}
        self._dropped: Set[str] = set()

    def take(self, data: Data, is_static: bool) -> bool:
        """Add a tf2_msgs/TFMessage; return whether the tree has changed or a fixed frame moved."""
        is_other = False
        for it in transforms_in(data):
            child = it.child
            x, y, z, *turn = _POSE.unpack_from(data, it.pose)
            before = self._above.get(child)
            if not all(abs(it) < FAR_M for it in (x, y, z)) or not any(turn) \
                    or not all(abs(it) < _MAX_QUATERNION for it in turn) \
                    or (before is None and len(self._above) >= MAX_FRAMES):
                continue
            row = it.parent, Placement((x, y, z), tuple(turn)), is_static
            is_other = is_other or before is None or before[0] != row[0] or (
                is_static and before != row)
            self._above[child] = row
        return is_other

    def place(self, frame: str, known: Dict[str, Optional[Placement]]) -> Optional[Placement]:
        """Return the pose of a frame in the root; None if the two are not connected.

        ``known`` caches the poses found at this moment.
        """
        passed: List[str] = []
        found: Optional[Placement] = None
        while frame not in known:
            if frame == self._root:
                known[frame] = Placement()
                break
            above = self._above.get(frame)
            if above is None or frame in passed:
                known[frame] = None
                break
            passed.append(frame)
            frame = above[0]
        found = known[frame]
        for child in reversed(passed):
            found = None if found is None else found.then(self._above[child][1])
            known[child] = found
        return found

    def is_moving(self, frame: str) -> bool:
        """Return whether any transform between a frame and the root is not static."""
        for _ in range(len(self._above)):
            above = self._above.get(frame)
            if above is None or frame == self._root:
                return False
            if not above[2]:
                return True
            frame = above[0]
        return False


class _Drawn(NamedTuple):
    """A marker, and its time of receipt."""

    marker: SeenMarker
    came_s: float

    def is_there(self, now_s: float) -> bool:
        lifetime_s = self.marker.lifetime_s
        return math.isfinite(self.came_s) and (
            not lifetime_s or now_s - self.came_s <= lifetime_s)


class _Layout(NamedTuple):
    number: int
    entry: Dict[str, Any]
    moving: Tuple[str, ...]
    ghosts: Tuple['_Key', ...]
    arrows: Tuple['_Key', ...]
    texts: Tuple['_Key', ...]


_Key = Tuple[str, str]
"""Topic and namespace of an arrow or a text."""


class ShownPart(NamedTuple):
    """A mesh of a page, with the device and the link that it belongs to."""

    device: str
    link: str
    mesh: int


class ShownTool(NamedTuple):
    """The frame of a robot's tool, and the direction from there to its numbers."""

    frame: str
    up: Tuple[float, ...]


_GHOST, _DEVIATION = '/ghost', '/deviation'
Visuals = Mapping[str, Sequence[Tuple[str, Placement]]]
"""The shapes of each device's model in order: the link, and the pose in the link."""


class LiveScene:
    """Builds the scene from what nodes publish; without a clock or threads."""

    def __init__(self, root: str, parts: Sequence[ShownPart], tools: Dict[str, ShownTool],
                 devices: Sequence[str], sources: Sequence[CurveSource],
                 visuals: Visuals = MappingProxyType({})) -> None:
        """Initialize with the contents other than markers; ``root`` is the frame of the cell.

        ``devices`` have their own marker topics. The ghost of the reference run has a marker for
        each of a model's ``visuals``.
        """
        self._devices = tuple(devices)
        self._shapes = {(device, number): (link, place.inverse())
                        for device, several in visuals.items()
                        for number, (link, place) in enumerate(several)}
        self._ghosts: Dict[_Key, _Drawn] = {}
        self._frames = NewestFrames(root)
        self._parts, self._tools, self._sources = parts, tools, tuple(sources)
        self._arrows: Dict[_Key, _Drawn] = {}
        self._texts: Dict[_Key, _Drawn] = {}
        self._is_other = True
        self._layout = _Layout(0, {}, (), (), (), ())
        self._turns: Dict[str, Quaternion] = {}
        self._count = 0

    def take_transforms(self, data: Data, is_static: bool) -> None:
        """Process a serialized message of /tf or /tf_static."""
        self._is_other |= self._frames.take(data, is_static)

    def take_markers(self, topic: str, data: Data, now_s: float) -> None:
        """Process a serialized visualization_msgs/MarkerArray."""
        for marker in markers_in(data):
            key = topic, marker.namespace
            if marker.action == MarkerAction.DELETE_ALL:
                self._forget(topic)
            elif marker.action == MarkerAction.DELETE:
                # an arrow and its text share a namespace, but not an id
                for drawn in (self._arrows, self._texts):
                    before = drawn.get(key)
                    if before is not None and before.marker.number == marker.number:
                        drawn[key] = before._replace(came_s=-math.inf)
            elif topic == GHOST_TOPIC and marker.namespace.endswith(_GHOST) \
                    and marker.kind != MarkerType.ARROW:
                self._take_ghost(marker, now_s)
            elif marker.kind == MarkerType.ARROW:
                self._take(self._arrows, key, marker, now_s)
            elif marker.kind == MarkerType.TEXT:
                self._take(self._texts, key, marker, now_s)

    def _take(self, drawn: Dict[_Key, _Drawn], key: _Key, marker: SeenMarker,
              now_s: float) -> None:
        before = drawn.get(key)
        if before is None and len(self._arrows) + len(self._texts) >= MAX_MARKERS:
            return
        self._is_other |= before is None or before.marker.frame != marker.frame
        drawn[key] = _Drawn(marker, now_s)

    def _take_ghost(self, marker: SeenMarker, now_s: float) -> None:
        """Set the pose of a link from the marker of its first shape."""
        device = marker.namespace[:-len(_GHOST)]
        found = self._shapes.get((device, marker.number))
        if found is None or (device, marker.number - 1) in self._shapes \
                and self._shapes[device, marker.number - 1][0] == found[0]:
            return
        link, inner = found
        self._is_other |= (device, link) not in self._ghosts
        self._ghosts[device, link] = _Drawn(marker._replace(place=marker.place.then(inner)), now_s)

    def _forget(self, topic: str) -> None:
        if topic == GHOST_TOPIC:
            self._ghosts.clear()
        for drawn in (self._arrows, self._texts):
            for key in [it for it in drawn if it[0] == topic]:
                del drawn[key]
        self._is_other = True

    def place(self, frame: str) -> Optional[Placement]:
        """Return the current pose of a frame in the root; None if it is unknown."""
        return self._frames.place(frame, {})

    def said(self, topic: str, now_s: float) -> List[str]:
        """Return the lines of the texts now shown by a topic."""
        return [line for key, it in self._texts.items() if key[0] == topic and it.is_there(now_s)
                for line in it.marker.text.split('\n') if line.strip()]

    @property
    def layout(self) -> Dict[str, Any]:
        """Return the poses, arrows and texts of a frame, for JSON; `frame` keeps it current.

        ``places`` are either fixed (``at``) or have a row in each frame; their rows come first, in
        their order, then those of ``arrows`` and ``texts``.
        """
        return self._layout.entry

    def frame(self, time_s: float, now_s: float) -> bytes:
        """Return the current scene as bytes.

        A header (kind, number of the layout, number of the frame, time), then for each moving pose
        its position [m] (NaN: unknown) and orientation, for each arrow its foot and vector [m]
        (NaN: none) and color, for each text its color, length and UTF-8.

        Args:
            time_s: time of the frame.
            now_s: current time of the clock that timed the markers.
        """
        known: Dict[str, Optional[Placement]] = {}
        if self._is_other:
            self._is_other = False
            self._arrange(known)
        layout = self._layout
        self._count += 1
        parts = [_HEAD.pack(FRAME, layout.number & 0xFFFF, self._count & 0xFFFF_FFFF, time_s)]
        parts += [self._place(frame, self._frames.place(frame, known)) for frame in layout.moving]
        parts += [self._place(f'{device}{_GHOST} {link}', self._ghost_place((device, link), now_s,
                                                                            known))
                  for device, link in layout.ghosts]
        parts += [_arrow(self._arrows.get(key), now_s) for key in layout.arrows]
        parts += [_text(self._texts.get(key), now_s) for key in layout.texts]
        return b''.join(parts)

    def _ghost_place(self, key: _Key, now_s: float,
                     known: Dict[str, Optional[Placement]]) -> Optional[Placement]:
        drawn = self._ghosts.get(key)
        if drawn is None or not drawn.is_there(now_s):
            return None
        outer = self._frames.place(drawn.marker.frame, known)
        return None if outer is None else outer.then(drawn.marker.place)

    def _place(self, frame: str, place: Optional[Placement]) -> bytes:
        if place is None or max(map(abs, place.position)) > FAR_M:
            return _NOWHERE
        turn = _unit(place.quaternion)
        before = self._turns.get(frame, turn)
        if sum(a * b for a, b in zip(turn, before)) < 0.0:  # so that the page turns the short way
            x, y, z, w = turn
            turn = -x, -y, -z, -w
        self._turns[frame] = turn
        return _PLACE.pack(*place.position, *(round(_TURN_STEPS * it) for it in turn))

    def _arrange(self, known: Dict[str, Optional[Placement]]) -> None:
        """Rebuild the layout; its number changes only if its contents do."""
        numbers: Dict[str, int] = {}
        places: List[Dict[str, Any]] = []
        moving: List[str] = []

        def number(frame: str) -> Optional[int]:
            place = self._frames.place(frame, known)
            if place is None:
                return None
            if frame not in numbers:
                numbers[frame] = len(places)
                if self._frames.is_moving(frame):
                    moving.append(frame)
                    places.append({'name': frame})
                else:
                    places.append({'name': frame, 'at': [
                        *place.position, *_unit(place.quaternion)]})
            return numbers[frame]

        parts = [{'device': it.device, 'mesh': it.mesh, 'place': number(it.link)}
                 for it in self._parts]
        tools = {device: {'place': place, 'up': list(it.up)}
                 for device, it in self._shown_tools().items()
                 for place in [number(it.frame)] if place is not None}
        arrows = {key: it for key, it in self._arrows.items() if it.marker.size[1] > 0.0
                  and number(it.marker.frame) is not None}
        texts = self._in_order(key for key, it in self._texts.items()
                               if number(it.marker.frame) is not None)
        ghosts = tuple(self._ghosts)
        ghost_parts = []
        for device, link in ghosts:
            ghost_parts += [{'device': device, 'mesh': it.mesh, 'place': len(places)}
                            for it in self._parts if (it.device, it.link) == (device, link)]
            places.append({'name': f'{device}{_GHOST} {link}'})
        entry = {'places': places, 'tools': tools, 'ghost': ghost_parts,
                 'parts': [it for it in parts if it['place'] is not None],
                 'arrows': [self._arrow_entry(key, it.marker, numbers)
                            for key, it in arrows.items()],
                 'texts': [self._text_entry(key, numbers) for key in texts]}
        before = {key: it for key, it in self._layout.entry.items() if key != 'number'}
        if entry != before or not self._layout.number:
            number_ = self._layout.number + 1
            self._layout = _Layout(number_, {**entry, 'number': number_ & 0xFFFF}, tuple(moving),
                                   ghosts, tuple(arrows), tuple(texts))

    def _shown_tools(self) -> Dict[str, ShownTool]:
        """Return the tools of models; for robots without a model, where their numbers are."""
        found = dict(self._tools)
        for (topic, namespace), drawn in self._texts.items():
            if namespace in _QUANTITIES:
                found.setdefault(_device(topic), ShownTool(drawn.marker.frame, (0.0, 0.0, 1.0)))
        return found

    def _in_order(self, keys: Iterable[_Key]) -> List[_Key]:
        """Return the keys in the order of devices and curves, then the others."""
        devices = {name: row for row, name in enumerate(self._devices)}
        order = {(it.device, _namespace(it)): row for row, it in enumerate(self._sources)}
        return sorted(keys, key=lambda key: (
            devices.get(_device(key[0]), len(devices)),
            order.get((_device(key[0]), key[1]), len(order))))

    def _arrow_entry(self, key: _Key, marker: SeenMarker,
                     numbers: Dict[str, int]) -> Dict[str, Any]:
        place = numbers[marker.frame]
        if key[0] == GHOST_TOPIC:  # an arrow of the ghost has no number
            return {'device': GHOST, 'quantity': key[1], 'variable': False, 'frame': place,
                    'footFrame': place,
                    'diameter': round(marker.size[1], 6), 'color': list(_rounded(marker.color))}
        return {'device': _device(key[0]), 'quantity': _label(key[1]),
                'variable': key[1].startswith(_VARIABLE), 'frame': place, 'footFrame': place,
                'diameter': round(marker.size[1], 6), 'color': list(_rounded(marker.color))}

    def _text_entry(self, key: _Key, numbers: Dict[str, int]) -> Dict[str, Any]:
        topic, namespace = key
        marker = self._texts[key].marker
        if topic == GHOST_TOPIC and namespace.endswith(_DEVIATION):
            return {'device': namespace[:-len(_DEVIATION)], 'label': 'Δ', 'quantity': 'deviation'}
        if namespace in _QUANTITIES:
            quantity, label = _QUANTITIES[namespace]
            return {'device': _device(topic), 'label': label, 'quantity': quantity}
        place = {'place': numbers[marker.frame], 'foot': list(marker.place.position)}
        if _device(topic) in self._devices:  # a text without an arrow has its own position
            return {'device': _device(topic), 'label': _label(namespace),
                    'quantity': Quantity.NUMBER.value, **({} if key in self._arrows else place)}
        return {'device': namespace, 'label': '', 'quantity': 'note', **place}


def _device(topic: str) -> str:
    return topic.strip('/').partition('/')[0]


def _label(namespace: str) -> str:
    return namespace[len(_VARIABLE):] if namespace.startswith(_VARIABLE) else namespace


def _namespace(source: CurveSource) -> str:
    """Return the namespace of the markers that show a source."""
    found = {Quantity.SPEED: 'velocity', Quantity.FORCE: 'force'}.get(source.quantity)
    return f'{_VARIABLE}{source.label}' if found is None else found


def _arrow(drawn: Optional[_Drawn], now_s: float) -> bytes:
    if drawn is None or not drawn.is_there(now_s):
        return _NO_ARROW
    marker = drawn.marker
    return _ARROW.pack(*marker.place.position, *marker.vector, *_bytes(marker.color))


def _text(drawn: Optional[_Drawn], now_s: float) -> bytes:
    if drawn is None or not drawn.is_there(now_s):
        return _NO_TEXT
    text = '\n'.join(it for it in (line.strip() for line in drawn.marker.text.split('\n')) if it)
    data = text.encode()[:_MAX_TEXT_BYTES].decode('utf-8', 'ignore').encode()
    color = tuple((it - _LIGHT) / (1.0 - _LIGHT) for it in drawn.marker.color) \
        if min(drawn.marker.color) > _LIGHT - 1e-3 else drawn.marker.color
    return _TEXT.pack(*_bytes(color), len(data)) + data


def _bytes(color: Sequence[float]) -> Tuple[int, ...]:
    return tuple(min(max(round(255.0 * it), 0), 255) for it in color)


def _rounded(color: Sequence[float]) -> Tuple[float, ...]:
    return tuple(round(it, 3) for it in color)


def _unit(quaternion: Sequence[float]) -> Quaternion:
    length = math.sqrt(sum(it * it for it in quaternion)) or 1.0
    x, y, z, w = (it / length for it in quaternion)
    return x, y, z, w


