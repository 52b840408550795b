# SPDX-License-Identifier: BSD-3-Clause
"""A run as an MCAP file for Lichtblick and Foxglove: the contents of a page as ROS 1 messages.

Besides the recording's own messages, the file contains the frames of the models and of the
configuration, the models as markers, arrows with their numbers, and each number on its own topic.
"""
from __future__ import annotations

import heapq
import io
import itertools
import re
from typing import Any, BinaryIO, Dict, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

import genpy
import numpy as np
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from mcap.writer import Writer
from std_msgs.msg import ColorRGBA, Float64, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.recorder_topics import CALIBRATION, STATIC_FRAMES
from process_visualizer.bagio.recording import Recording
from process_visualizer.page.packed import Packed
from process_visualizer.page.recorded_frames import sent_pairs
from process_visualizer.page.robots import PageSpan, rows_held
from process_visualizer.robot.arrows import GHOST_COLOR
from process_visualizer.robot.placements import Placements, interpolated
from process_visualizer.ros_names import STATIC_TF_TOPIC, TF_TOPIC

OWN = '/process_visualizer'
_TF_HZ, _ARROWS_HZ = 50.0, 25.0
_GHOST = 'ghost/'
_TURN_STEPS = 32_767
_TEXT_HEIGHT_M, _TEXT_ABOVE_M = 0.045, 0.06
_MIN_ARROW_M = 1e-4
_TICK_S = 1e-9  # tolerance, so that a row holds at its own time despite rounding
_NO_NAME = re.compile(r'[^A-Za-z0-9_]+')


class PageData(NamedTuple):
    """The data of a run on a page: its entry, the meshes, and the columns that both refer to.

    The entry includes every frame.
    """

    entry: Dict[str, Any]
    meshes: Sequence[Dict[str, Any]]
    packed: Packed
    frame: str
    """The cell's global frame."""


class _Message(NamedTuple):
    time_ns: int
    channel: int
    data: bytes


def write_mcap(file: BinaryIO, recording: Recording, span: PageSpan, page: PageData) -> int:
    """Write a part of a recording, and its page as messages; return the number of messages."""
    writer: Any = Writer(file)
    writer.start(profile='ros1', library='process_visualizer')
    channels = _Channels(writer)
    shown = _Shown(page, recording, span)
    own = [*shown.transforms(channels), *shown.models(channels), *shown.arrows(channels),
           *shown.numbers(channels)]
    count = 0
    for message in heapq.merge(_recorded(recording, span, channels), sorted(own)):
        writer.add_message(message.channel, message.time_ns, message.data, message.time_ns)
        count += 1
    writer.finish()
    return count


class _Channels:
    """The channels of a file; connections with the same topic and type share one."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: Dict[Tuple[str, str], int] = {}
        self._channels: Dict[Tuple[str, int], int] = {}

    def of(self, topic: str, message_type: str, definition: str, latching: bool = False) -> int:
        schema = (message_type, definition)
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(
                message_type, 'ros1msg', definition.encode('utf-8', 'replace'))
        key = (topic, self._schemas[schema])
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(
                topic, 'ros1', key[1], {'latching': '1'} if latching else {})
        return self._channels[key]

    def of_class(self, topic: str, message_class: Any, latching: bool = False) -> int:
        return self.of(topic, message_class._type, message_class._full_text, latching)


def _recorded(recording: Recording, span: PageSpan, channels: _Channels) -> Iterator[_Message]:
    """Yield the last latched messages and all of /tf_static before a span, then those in the span.

    The recorder's copies of fixed frames are left out: the page's frames include them, at the poses
    saved later.
    """
    index = recording.index
    begin_ns, end_ns = (recording.begin_ns + round(it * 1e9) for it in span)
    first, behind = index.count_before(begin_ns), index.count_until(end_ns)
    before = []
    for number, it in enumerate(index.connections):
        held = index.positions(number)
        held = held[held < first]
        if it.topic == STATIC_TF_TOPIC:
            before += held.tolist()
        elif it.latching:
            before += held[-1:].tolist()
    for position in (*before, *range(first, behind)):
        connection = index.connections[int(index.connection[position])]
        if connection.topic in _COPIES:
            continue
        try:
            data = bytes(recording.message(position))
        except BagDamaged:
            continue  # the recording reports the damage
        yield _Message(max(int(index.time_ns[position]), begin_ns), channels.of(
            connection.topic, connection.type, connection.message_definition,
            connection.latching), data)


_COPIES = (CALIBRATION, STATIC_FRAMES)


class _Shown:
    """Turns the contents of a page into messages."""

    def __init__(self, page: PageData, recording: Recording, span: PageSpan) -> None:
        self._page, self._span, self._begin_ns = page, span, recording.begin_ns
        self._columns = page.packed.column
        entry = page.entry
        self._sent = {child for number, pairs in sent_pairs(recording).items()
                      if recording.index.connections[number].topic not in _COPIES
                      for _, child in pairs}
        ghost = entry['ghost']
        self._parts = [(str(it['link']), it) for it in entry['parts']]
        if ghost is not None:
            self._parts += [(_GHOST + str(it['link']), it) for it in ghost['parts']]
        self._parts = [it for it in self._parts if it[1]['place'] is not None]
        self._frames: Dict[str, int] = {
            **entry['frames'], **{frame: int(part['place']) for frame, part in self._parts}}

    def _moments(self, rate_hz: float) -> np.ndarray:
        begin_s, end_s = self._span
        return begin_s + np.arange(int((end_s - begin_s) * rate_hz + 1e-6) + 1) / rate_hz

    def _time_ns(self, time_s: float) -> int:
        return self._begin_ns + round(time_s * 1e9)

    def _header(self, time_s: float) -> Header:
        return Header(stamp=genpy.Time(nsecs=self._time_ns(time_s)), frame_id=self._page.frame)

    def _places(self, number: int, times_s: np.ndarray) -> np.ndarray:
        """Return a pose x y z [m], x y z w (m, 7) at given times; NaN where it is unknown."""
        entry = self._page.entry['places'][number]
        if 'at' in entry:
            return np.broadcast_to(np.array(entry['at'], float), (len(times_s), 7))
        rows = np.hstack((self._columns(entry['positions']),
                          self._columns(entry['turns'], 4) / _TURN_STEPS))
        known_s = self._columns(entry['times'])
        if not len(known_s):
            return np.full((len(times_s), 7), np.nan)
        if entry.get('between'):
            inside_s = np.clip(times_s, known_s[0], known_s[-1])
            found = interpolated(inside_s, known_s, rows, np.inf, slice(3, 7))
        else:
            found = rows[rows_held(known_s, times_s + _TICK_S)]
        found[:, 3:] /= np.maximum(np.linalg.norm(found[:, 3:], axis=1, keepdims=True), 1e-12)
        return found

    def transforms(self, channels: _Channels) -> Iterator[_Message]:
        """Yield all known frames, except those in the recording.

        Frames without a mesh are needed, too: those of recorded messages, such as a sensor's, and
        the frame that connects the recording's own frames to the cell.
        """
        places = {frame: number for frame, number in self._frames.items()
                  if frame not in self._sent and frame != self._page.frame}
        entries = self._page.entry['places']
        begin_s = self._span.begin_s
        fixed = [frame for frame, number in places.items() if 'at' in entries[number]]
        if fixed:
            at_begin = np.array([begin_s])
            yield self._message(channels.of_class(STATIC_TF_TOPIC, TFMessage, True), begin_s,
                                TFMessage([self._transform(it, self._places(
                                    places[it], at_begin)[0], begin_s) for it in fixed]))
        times_s = self._moments(_TF_HZ)
        moving = {frame: self._places(number, times_s) for frame, number in places.items()
                  if frame not in fixed}
        for row, time_s in enumerate(times_s.tolist() if moving else []):
            known = [self._transform(frame, rows[row], time_s) for frame, rows in moving.items()
                     if np.isfinite(rows[row]).all()]
            yield self._message(channels.of_class(TF_TOPIC, TFMessage), time_s, TFMessage(known))

    def _transform(self, frame: str, place: np.ndarray, time_s: float) -> TransformStamped:
        return TransformStamped(self._header(time_s), frame, Transform(
            Vector3(*place[:3].tolist()), Quaternion(*place[3:].tolist())))

    def models(self, channels: _Channels) -> Iterator[_Message]:
        """Yield the meshes of all links, each in the frame of its link."""
        markers = []
        for number, (frame, part) in enumerate(self._parts):
            mesh = self._page.meshes[int(part['mesh'])]
            corners = self._columns(mesh['positions'])
            rows = self._columns(mesh['triangles']).astype(int)
            marker = self._marker('models', number, Marker.TRIANGLE_LIST, frame)
            marker.points = [Point(*it) for it in corners[rows].tolist()]
            marker.scale = Vector3(1.0, 1.0, 1.0)
            if frame.startswith(_GHOST):
                marker.color = ColorRGBA(*GHOST_COLOR)
            else:
                colors = self._columns(mesh['colors'], 3)[rows] / 255.0
                marker.color = ColorRGBA(1.0, 1.0, 1.0, 1.0)
                marker.colors = [ColorRGBA(*it, 1.0) for it in colors.tolist()]
            markers.append(marker)
        if markers:
            yield self._message(channels.of_class(f'{OWN}/models', MarkerArray, True),
                                self._span.begin_s, MarkerArray(markers))

    def arrows(self, channels: _Channels) -> Iterator[_Message]:
        """Yield the arrows in the global frame, with the texts of their numbers."""
        ghost = self._page.entry['ghost']
        entries = [*self._page.entry['arrows'], *([] if ghost is None else ghost['arrows'])]
        times_s = self._moments(_ARROWS_HZ)
        feet, tips = [], []
        for it in entries:
            foot = self._places(int(it['footFrame']), times_s)
            turn = self._places(int(it['frame']), times_s)
            feet.append(_placed(foot, np.array([it['foot']], float)))
            vector = self._vectors(it, times_s)
            turn = np.hstack((np.zeros((len(turn), 3)), turn[:, 3:]))
            tips.append(feet[-1] + _placed(turn, vector))
        texts = [self._number_of(it) for it in self._page.entry['arrows']]
        channel = channels.of_class(f'{OWN}/arrows', MarkerArray)
        for row, time_s in enumerate(times_s.tolist() if entries else []):
            markers = []
            for number, it in enumerate(entries):
                markers += self._arrow(number, it, feet[number][row], tips[number][row], time_s,
                                       texts[number] if number < len(texts) else None)
            yield self._message(channel, time_s, MarkerArray(markers))

    def _vectors(self, entry: Dict[str, Any], times_s: np.ndarray) -> np.ndarray:
        """Return an arrow (m, 3) at given times; NaN where there is none."""
        known_s = self._columns(entry['times'])
        vectors = self._columns(entry['vectors'], 3).astype(float)
        if entry.get('between'):
            return interpolated(times_s, known_s, vectors, np.inf)
        found = np.full((len(times_s), 3), np.nan)
        is_known = times_s + _TICK_S >= (known_s[0] if len(known_s) else np.inf)
        found[is_known] = vectors[rows_held(known_s, times_s[is_known] + _TICK_S)]
        return found

    def _arrow(self, number: int, entry: Dict[str, Any], foot: np.ndarray, tip: np.ndarray,
               time_s: float, text: Optional['_Texts']) -> List[Marker]:
        arrow = self._marker('arrows', number, Marker.ARROW, self._page.frame, time_s)
        known = np.isfinite((foot, tip)).all() and np.linalg.norm(tip - foot) > _MIN_ARROW_M
        if known:
            arrow.points = [Point(*foot.tolist()), Point(*tip.tolist())]
            diameter_m = float(entry['diameter'])
            arrow.scale = Vector3(diameter_m, 2.0 * diameter_m, 0.0)
            arrow.color = ColorRGBA(*entry['color'], 1.0)
        else:
            arrow.action = Marker.DELETE
        if text is None or not np.isfinite(foot).all():
            return [arrow]
        words = self._marker('numbers', number, Marker.TEXT_VIEW_FACING, self._page.frame, time_s)
        words.text = text.at(time_s)
        words.pose.position = Point(*((tip if known else foot)
                                      + (0.0, 0.0, _TEXT_ABOVE_M)).tolist())
        words.scale.z = _TEXT_HEIGHT_M
        words.color = ColorRGBA(*entry['color'], 1.0)
        return [arrow, words]

    def _marker(self, namespace: str, number: int, kind: int, frame: str,
                time_s: Optional[float] = None) -> Marker:
        marker = Marker(ns=namespace, id=number, type=kind, frame_locked=time_s is None)
        marker.header.frame_id = frame
        if time_s is not None:
            marker.header.stamp = genpy.Time(nsecs=self._time_ns(time_s))
        marker.pose.orientation.w = 1.0
        return marker

    def _number_of(self, arrow: Dict[str, Any]) -> Optional['_Texts']:
        """Return the texts of the number that an arrow shows."""
        entry = next((it for it in self._page.entry['numbers'] if it['device'] == arrow['device']
                      and arrow['quantity'] == (it['label'] if arrow['variable']
                                                else _QUANTITIES.get(it['quantity']))), None)
        return None if entry is None else _Texts(entry, self._page.packed)

    def numbers(self, channels: _Channels) -> Iterator[_Message]:
        """Yield the values of each number, at the times from which they hold."""
        known: Set[str] = set()
        for entry in self._page.entry['numbers']:
            name = topic = f'{OWN}/{_name(entry["device"])}/{_name(entry["label"])}'
            for number in itertools.count(2):
                if topic not in known:
                    break
                topic = f'{name}_{number}'
            known.add(topic)
            channel = channels.of_class(topic, Float64)
            times_s, values = number_rows(entry, self._page.packed)
            for time_s, value in zip(times_s.tolist(), values.tolist()):
                if self._span.begin_s <= time_s <= self._span.end_s and np.isfinite(value):
                    yield self._message(channel, time_s, Float64(value))

    def _message(self, channel: int, time_s: float, message: Any) -> _Message:
        buffer = io.BytesIO()
        message.serialize(buffer)
        return _Message(self._time_ns(time_s), channel, buffer.getvalue())


_QUANTITIES = {'speed': 'velocity', 'force': 'force'}


class _Texts:
    """The texts of a number over time, as on the page."""

    def __init__(self, entry: Dict[str, Any], packed: Packed) -> None:
        self._entry = entry
        self._times_s, self._values = number_rows(entry, packed)
        self._rows = None if 'format' in entry else packed.column(entry['text'])

    def at(self, time_s: float) -> str:
        """Return the text at a time."""
        row = int(np.searchsorted(self._times_s, time_s, side='right')) - 1
        if self._rows is not None:
            if row < 0:
                return f'{self._entry["label"]} –'
            age_s, holds_s = time_s - float(self._times_s[row]), self._entry.get('holds')
            if holds_s is not None and age_s > holds_s:
                return f'{self._entry["short"]} no data for {age_s:.1f} s'.strip()
            return str(self._entry['texts'][self._rows[row]])
        form: Dict[str, Any] = self._entry['format']
        value = float(np.interp(time_s, self._times_s, self._values, np.nan, np.nan)) \
            if len(self._times_s) else np.nan
        number = '–' if np.isnan(value) else f'{value:.{form["decimals"]}f} {form["unit"]}'
        return f'{form["label"]} {number}'


def number_rows(entry: Dict[str, Any], packed: Packed) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (n,) and unformatted values (n,) of a number of a page."""
    times_s = packed.column(entry['times'])
    if 'vectors' in entry:
        return times_s, np.asarray(np.linalg.norm(packed.column(entry['vectors'], 3), axis=1))
    return times_s, packed.column(entry['values']).astype(float)


def _placed(places: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points in the outer frame, given points (m, 3) or (1, 3) in poses (m, 7)."""
    inner = Placements(points, np.array([(0.0, 0.0, 0.0, 1.0)]))
    return Placements(places[:, :3], places[:, 3:]).then(inner).positions


def _name(text: str) -> str:
    """Return a text as a part of a topic's name."""
    return _NO_NAME.sub('_', text).strip('_') or 'number'
