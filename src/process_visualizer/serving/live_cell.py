# SPDX-License-Identifier: BSD-3-Clause
"""The state of a running cell for its page: takes its messages, and fills the feed; no ROS."""
from __future__ import annotations

import json
import math
import os
import threading
from typing import Any, Dict, FrozenSet, Iterable, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bagio.json_text import parsed_json
from process_visualizer.cell.model import Cell, DeviceType
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.live_curves import LiveMark, LiveWindow
from process_visualizer.figures import clock_text
from process_visualizer.health.near_objects import seen_objects
from process_visualizer.msg import DetectedObjects
from process_visualizer.page.clouds import (
    MAX_LIVE_POINTS,
    cloud_message,
    live_points,
    placed,
)
from process_visualizer.page.live_feed import LiveFeed, Slot
from process_visualizer.page.live_lanes import LiveLanes
from process_visualizer.page.live_scene import LiveScene, ShownPart, ShownTool
from process_visualizer.page.objects import ShownObjects
from process_visualizer.page.robots import base_place, upwards
from process_visualizer.page.run_page import PageCell
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.visuals import link_visuals
from process_visualizer.ros_names import SCENE_WATCH
from process_visualizer.runs.comparison.live_comparison import live_bands
from process_visualizer.serving.cell_alarms import CellAlarms, SeenRecorder

PERIOD_S = 0.04
"""Period of frames."""
_OBJECTS_EVERY, _LANES_EVERY, _STATE_EVERY, _CLOUDS_EVERY = 3, 5, 12, 12  # in frames
_WATCH_TOPIC = f'/{SCENE_WATCH}/marker_array'
_OVERLAP_S = 1.0
"""Duration of columns sent again: late values change them, and messages may be skipped."""
_VERDICT_S = 3.0
"""Maximum age of a shown verdict; with an older one, the launcher no longer compares."""
_MAX_VERDICT = 20_000
_PLAYER_S = 2.0
_MAX_S = 1e10
"""Maximum of a time that is shown [s]."""


class SeenPlayer(NamedTuple):
    """The player's state: file, position [s], and whether it is paused."""

    name: str
    position_s: float
    is_paused: bool

    @property
    def text(self) -> str:
        """Return the state as text."""
        return (f'{self.name} is {"paused" if self.is_paused else "played"} '
                f'at {clock_text(self.position_s)}')


class _Since(NamedTuple):
    text: str
    since_s: float


class LiveCell:
    """The live state of a cell; any thread may call its methods."""

    def __init__(self, cell: Cell, shared: PageCell, server: str) -> None:
        """Initialize with the cell, its models, and an identifier of this server."""
        self._lock = threading.Lock()
        self._has_sensors = any(it.type is DeviceType.DEPTH_SENSOR for it in cell.devices)
        self._server = server
        parts = [ShownPart(str(it['device']), str(it['link']), int(it['mesh']))
                 for it in shared.parts]
        tools = {name: ShownTool(arm.tool, tuple(upwards(base_place(arm.device))))
                 for name, arm in shared.arms.items()}
        visuals = {name: [(it.link, it.place) for it in link_visuals(model.text)]
                   for name, model in shared.models.items()}
        self._scene = LiveScene(cell.frame, parts, tools, [it.name for it in cell.devices],
                                curve_sources(cell.devices), visuals)
        self._lanes = LiveLanes()
        self._marks: Tuple[LiveMark, ...] = ()
        self._epoch_s = 0.0
        self._problem: Optional[_Since] = None
        self._verdict: Tuple[Dict[str, Any], float] = {}, 0.0
        self._player: Tuple[Optional[SeenPlayer], float] = None, 0.0
        self._clouds: Dict[str, bytes] = {}
        self._objects = ShownObjects()
        self._object_entries: List[Dict[str, Any]] = []
        self._layout, self._count = 0, 0
        self._has_new_lanes = self._has_new_cloud = False
        self.wants_clouds = False
        """True while any viewer wants clouds."""
        self.alarms = CellAlarms(cell.devices)
        self.feed = LiveFeed()

    def take_transforms(self, data: bytes, is_static: bool) -> None:
        """Process a message of /tf or /tf_static."""
        with self._lock:
            self._scene.take_transforms(data, is_static)

    def take_markers(self, topic: str, data: bytes, clock_s: float) -> None:
        """Process a visualization_msgs/MarkerArray."""
        with self._lock:
            self._scene.take_markers(topic, data, clock_s)

    def take_cloud(self, device: str, data: bytes) -> None:
        """Process a sensor_msgs/PointCloud2 of a device."""
        with self._lock:
            self._clouds[device], self._has_new_cloud = data, True

    def take_objects(self, sensor: str, message: DetectedObjects, wall_s: float,
                     clock_s: float) -> None:
        """Update the unmodeled objects that a sensor sees."""
        with self._lock:
            place = self._scene.place(message.header.frame_id.strip('/'))
            if place is not None:
                self._objects.take(sensor, message, place, clock_s)
            self.alarms.take_objects(sensor, seen_objects(message), wall_s)

    def take_curves(self, window: LiveWindow) -> None:
        """Update the curves of the last seconds, on the clock of the page."""
        with self._lock:
            self._lanes.take(window)
            self._marks, self._epoch_s = window.marks, window.epoch_s
            self._has_new_lanes = True

    def take_recorder(self, recorder: SeenRecorder) -> None:
        """Update the recorder's state."""
        with self._lock:
            self.alarms.take_recorder(recorder)

    def take_player(self, player: SeenPlayer, clock_s: float) -> None:
        """Update the player's state; a state with an invalid position is ignored."""
        if not abs(player.position_s) < _MAX_S:
            return
        with self._lock:
            self._player = player, clock_s

    def take_verdict(self, text: str, clock_s: float) -> None:
        """Update the launcher's verdict on the current run; see `verdict_entry`."""
        found = verdict_entry(text)
        with self._lock:
            self._verdict = found, clock_s
            self.alarms.lost = frozenset(found.pop('lost', _channels(self.alarms.departed)))
            self.alarms.departed = [tuple(it) for it in found.get('departed', ())]

    def take_bands(self, text: str, ahead_s: float = 0.0) -> None:
        """Update the bands of good runs behind the curves; see `live_bands`.

        ``ahead_s`` is by how much the clock of the page is ahead of the recorder's.
        """
        try:
            bands = live_bands(text)
        except ValueError:
            return  # not from the launcher
        with self._lock:
            self._lanes.take_bands(bands._replace(begin_s=bands.begin_s + ahead_s))
            self._has_new_lanes = True

    def take_problem(self, text: str, wall_s: float) -> None:
        """Set the reason why the cell cannot be seen; '' if it can be seen."""
        with self._lock:
            before = '' if self._problem is None else self._problem.text
            if text != before:
                self._problem = _Since(text, wall_s) if text else None
                self.alarms.note(text or 'The cell answers again', wall_s)

    def tick(self, wall_s: float, clock_s: float, viewers: int = 0) -> None:
        """Put the current state into the feed; ``wall_s`` must increase, ``viewers`` is a count."""
        self._put_clouds(wall_s)
        with self._lock:
            data = self._scene.frame(wall_s, clock_s)
            layout = self._scene.layout
            number = int(layout['number'])
            if number != self._layout:
                self._layout = number
                self.feed.put(Slot.LAYOUT, json.dumps(
                    {'kind': 'layout', 'server': self._server, **layout}, separators=(',', ':')))
            self.feed.put_frame(wall_s, number, data)
            if self._count % _OBJECTS_EVERY == 0:
                self._put_objects(wall_s, clock_s)
            if self._has_new_lanes and self._count % _LANES_EVERY == 0:
                self._has_new_lanes = False
                self.feed.put(Slot.LANES, self._lanes.new_columns(_OVERLAP_S))
            if self._count % _STATE_EVERY == 0:
                self.alarms.look(wall_s, clock_s, self._scene.said(_WATCH_TOPIC, clock_s),
                                 is_live=self._played(clock_s) is None)
                self.feed.put(Slot.STATE, json.dumps(
                    self._state(clock_s, viewers), separators=(',', ':'), allow_nan=False))
            self._count += 1

    def _put_clouds(self, wall_s: float) -> None:
        with self._lock:
            if not self._has_new_cloud or self._count % _CLOUDS_EVERY:
                return
            self._has_new_cloud, clouds = False, tuple(self._clouds.values())
        most = MAX_LIVE_POINTS // len(clouds)
        found = []
        for points in (live_points(it, most) for it in clouds):
            place = None if points is None else self.place(points.frame)
            if points is not None and place is not None:
                found.append(placed(points, place))
        self.feed.put(Slot.CLOUD, cloud_message(wall_s, found))

    def _put_objects(self, wall_s: float, clock_s: float) -> None:
        entries = self._objects.at(clock_s)
        if entries != self._object_entries:
            self._object_entries = entries
            self.feed.put(Slot.OBJECTS, json.dumps(
                {'kind': 'objects', 'time': round(wall_s, 3), 'objects': entries},
                separators=(',', ':'), allow_nan=False))

    def place(self, frame: str) -> Optional[Placement]:
        """Return the current pose of a frame in the cell; None if it is unknown."""
        with self._lock:
            return self._scene.place(frame)

    def _state(self, clock_s: float, viewers: int) -> Dict[str, Any]:
        verdict, said_s = self._verdict
        if clock_s - said_s > _VERDICT_S:
            self.alarms.lost |= _channels(self.alarms.departed)
            verdict, self.alarms.departed = {}, ()
        player, problem = self._played(clock_s), self._problem
        return {**self.alarms.entries(self._marks, self._epoch_s), 'kind': 'state',
                'lanes': self._lanes.entries, 'verdict': verdict or None,
                'departures': [{'device': device, 'label': label, 'began_s': since_s}
                               for device, label, _, since_s in verdict.get('departed', ())],
                'playback': '' if player is None else player.text,
                'has_clouds': self._has_sensors,
                'viewers': f'{viewers} {"page" if viewers == 1 else "pages"} open now.',
                'problem': None if problem is None else {
                    'text': problem.text, 'since': problem.since_s}}

    def _played(self, clock_s: float) -> Optional[SeenPlayer]:
        """Return the state of the player; None if the cell is live."""
        player, said_s = self._player
        return player if clock_s - said_s < _PLAYER_S else None

    def recent(self, after_s: float, before_s: float) -> bytes:
        """Return all columns, and the frames between two times; see `LiveFeed.recent`."""
        with self._lock:
            columns = self._lanes.columns(600.0)
            return len(columns).to_bytes(4, 'little') + columns + self.feed.recent(
                after_s, before_s)


def _channels(departed: Iterable[Tuple[str, str, str, float]]) -> FrozenSet[Tuple[str, str]]:
    return frozenset((device, label) for device, label, _, _ in departed)


def verdict_entry(text: str) -> Dict[str, Any]:
    """Return the launcher's verdict on the running cell; {} if there is none.

    ``text`` is JSON: text, state (good, poor, plain), reference, departed (device, label, amount,
    start [s since the epoch]), and optionally lost (device and label of the channels that cannot be
    judged now).
    """
    try:
        verdict = parsed_json(text) if len(text) <= _MAX_VERDICT else None
        if not isinstance(verdict, dict) or not verdict['text']:
            return {}
        departed: List[List[Any]] = [
            [str(device), str(label), str(amount), float(since_s)]
            for device, label, amount, since_s in verdict['departed']]
        if not all(math.isfinite(it[3]) for it in departed):
            return {}
        lost = [(str(device), str(label)) for device, label in verdict.get('lost', ())]
        state = verdict['state'] if verdict['state'] in ('good', 'poor') else 'plain'
        return {'text': str(verdict['text']), 'state': state,
                'reference': str(verdict['reference']), 'departed': departed, 'lost': lost}
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return {}


def file_name(paths: Sequence[str]) -> str:
    """Return the name of the first file, without its folder."""
    return os.path.basename(paths[0]) if paths else ''
