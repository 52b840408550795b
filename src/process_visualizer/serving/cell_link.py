# SPDX-License-Identifier: BSD-3-Clause
"""The node of a live page: subscribes, asks recorder and master, and publishes nothing."""
from __future__ import annotations

import threading
import time
from functools import partial
from typing import Any, List, Optional, Sequence
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.clients.bag_recorder import RecorderMemory
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.curves.live_curves import LiveCurves
from process_visualizer.health.node_warnings import Severity
from process_visualizer.launching.ros_api import (
    CONNECTION_ERRORS,
    PATIENT_TIMEOUT_S,
    LimitedTransport,
    MasterClient,
    is_registered,
)
from process_visualizer.msg import DetectedObjects, PlayerState, RecorderState
from process_visualizer.page.live_lanes import WINDOW_S
from process_visualizer.page.live_markers import MARKERS
from process_visualizer.ros_names import (
    BAG_RECORDER,
    BANDS_TOPIC,
    CELL_FRAMES,
    COMPARISON_TOPIC,
    GHOST_TOPIC,
    OBJECTS,
    PLAYER_STATE_TOPIC,
    SCENE_WATCH,
    STATIC_TF_TOPIC,
    TF_TOPIC,
    TF_TYPES,
)
from process_visualizer.serving.cell_alarms import RecorderTopic, SeenRecorder
from process_visualizer.serving.live_cell import LiveCell, SeenPlayer, file_name

CELL_NODES = (f'/{SCENE_WATCH}', f'/{CELL_FRAMES}')
"""Nodes that run with every cell, and only with a cell."""
_LOOK_S, _MASTER_S = 0.2, 2.0
_SEVERITIES = {DiagnosticStatus.WARN: Severity.WARNING, DiagnosticStatus.ERROR: Severity.ERROR}
_OTHER_CLOCK_S = 0.5
_BUFFER_BYTES, _CLOUD_BUFFER_BYTES = 1 << 20, 1 << 24


class PageClock:
    """The time of a page [s since the epoch], which never jumps, even if the system clock does."""

    def __init__(self) -> None:
        """Begin at the current time."""
        self._shift_s = time.time() - time.monotonic()

    def now_s(self) -> float:
        """Return the time."""
        return self.steady_s() + self._shift_s

    @staticmethod
    def steady_s() -> float:
        """Return the time of the clock that times markers and warnings."""
        return time.monotonic()


class CellLink:
    """Passes messages from the nodes of a cell to a LiveCell, until it is closed."""

    def __init__(self, live: LiveCell, devices: Sequence[Device], clock: PageClock) -> None:
        """Subscribe; needs a rospy node.

        Raises:
            OSError, rosgraph.MasterException: the master does not answer.
        """
        self._live, self._clock = live, clock
        self._curves = LiveCurves(devices)
        self._memory = RecorderMemory()
        self._master = MasterClient(rospy.get_name(), timeout_s=PATIENT_TIMEOUT_S)
        self._ended = threading.Event()
        self._is_unknown = False  # to the master, wholly or partly
        self._shift_s: Optional[float] = None
        self._subscribers: List[rospy.Subscriber] = []
        self._sensors = [it.name for it in devices if it.type is DeviceType.DEPTH_SENSOR]
        self._clouds: List[rospy.Subscriber] = []
        for topic, is_static in ((TF_TOPIC, False), (STATIC_TF_TOPIC, True)):
            self._subscribe(topic, rospy.AnyMsg, partial(self._on_transforms, is_static))
        for topic in (*(f'/{it.name}/marker_array' for it in devices),
                      f'/{SCENE_WATCH}/marker_array', GHOST_TOPIC):
            self._subscribe(topic, rospy.AnyMsg, partial(self._on_markers, topic))
        for device in devices:
            if device.objects is not None:
                self._subscribe(f'/{device.name}/{OBJECTS}', DetectedObjects,
                                partial(self._on_objects, device.name))
        self._subscribe(f'/{BAG_RECORDER}/state', RecorderState, self._on_recorder)
        self._subscribe(PLAYER_STATE_TOPIC, PlayerState, self._on_player)
        self._subscribe('/diagnostics', DiagnosticArray, self._on_diagnostics)
        self._subscribe('/rosout', Log, self._on_log)
        self._subscribe(COMPARISON_TOPIC, String, self._on_comparison)
        self._subscribe(BANDS_TOPIC, String, self._on_bands)
        self._threads = [threading.Thread(target=it, name=it.__name__, daemon=True)
                         for it in (self._read_curves, self._watch_cell)]
        for thread in self._threads:
            thread.start()

    def _subscribe(self, topic: str, kind: Any, act: Any) -> None:
        self._subscribers.append(rospy.Subscriber(topic, kind, act, queue_size=100,
                                                  buff_size=_BUFFER_BYTES, tcp_nodelay=True))

    def close(self) -> None:
        """Stop; the cell keeps running."""
        self._ended.set()
        for thread in self._threads:
            thread.join(PATIENT_TIMEOUT_S)
        self._memory.close()

    # Callbacks, each topic in its own thread

    def _on_transforms(self, is_static: bool, message: Any) -> None:
        if message._connection_header['type'] in TF_TYPES:
            self._live.take_transforms(message._buff, is_static)

    def _on_markers(self, topic: str, message: Any) -> None:
        if message._connection_header['type'] == MARKERS:
            self._live.take_markers(topic, message._buff, time.monotonic())

    def _on_objects(self, sensor: str, message: DetectedObjects) -> None:
        self._live.take_objects(sensor, message, self._clock.now_s(), self._clock.steady_s())

    def _on_recorder(self, state: RecorderState) -> None:
        self._live.take_recorder(SeenRecorder(
            state.state == RecorderState.RECORDING, file_name(state.files), state.duration,
            state.dropped, state.lost, tuple(
                RecorderTopic(it.name, it.rate, None if it.silence < 0.0 else it.silence,
                              it.messages, it.latching, it.largest_gap)
                for it in state.topics)))

    def _on_player(self, state: PlayerState) -> None:
        self._live.take_player(SeenPlayer(file_name(state.files), state.position, state.paused),
                               time.monotonic())

    def _on_diagnostics(self, report: DiagnosticArray) -> None:
        sender = str(report._connection_header['callerid'])
        for it in report.status:
            self._live.alarms.warnings.take_state(
                sender, it.name, _SEVERITIES.get(it.level), it.message, time.monotonic(),
                {pair.key: pair.value for pair in it.values})

    def _on_log(self, log: Log) -> None:
        if log.level >= Log.WARN:
            severity = Severity.WARNING if log.level == Log.WARN else Severity.ERROR
            self._live.alarms.warnings.take_log(
                str(log._connection_header['callerid']), severity, log.msg, time.monotonic())

    def _on_comparison(self, message: String) -> None:
        self._live.take_verdict(message.data, time.monotonic())

    def _on_bands(self, message: String) -> None:
        self._live.take_bands(message.data, self._shift_s or 0.0)

    # Requests to the recorder and the master

    def _read_curves(self) -> None:
        while not self._ended.wait(_LOOK_S):
            self._follow_clouds()
            try:
                more = True
                while more and not self._ended.is_set():
                    part, more = self._memory.read(self._curves.topics)
                    if part.is_anew or self._shift_s is None:
                        shift_s = self._clock.now_s() - part.now_ns / 1e9
                        self._shift_s = shift_s if abs(shift_s) > _OTHER_CLOCK_S else 0.0
                    self._curves.add(part)
                window = self._curves.window(WINDOW_S)
                self._live.take_curves(window._replace(
                    epoch_s=window.epoch_s + (self._shift_s or 0)))
            except (ServiceUnreachable, MemoryError):  # there is no recorder in playback
                self._ended.wait(_MASTER_S)

    def _follow_clouds(self) -> None:
        """Subscribe to clouds, which are large, only while a viewer wants them."""
        if not self._sensors or self._live.wants_clouds == bool(self._clouds):
            return
        for it in self._clouds:
            it.unregister()
        self._clouds = [
            rospy.Subscriber(f'/{name}/points', rospy.AnyMsg, partial(self._on_cloud, name),
                             queue_size=1, buff_size=_CLOUD_BUFFER_BYTES)
            for name in (self._sensors if self._live.wants_clouds else ())]

    def _on_cloud(self, name: str, message: Any) -> None:
        if message._connection_header['md5sum'] == PointCloud2._md5sum:
            self._live.take_cloud(name, message._buff)

    def _watch_cell(self) -> None:
        while not self._ended.wait(_MASTER_S):
            self._live.take_problem(self._problem(), self._clock.now_s())

    def _problem(self) -> str:
        try:
            self._master.getPid()
        except (OSError, rosgraph.MasterException):
            return 'The ROS master does not answer'
        if not any(is_registered(name) for name in CELL_NODES):
            return 'The cell does not run'
        try:
            self._master.lookupNode(rospy.get_name())
        except rosgraph.MasterException:  # the master was restarted
            self._is_unknown = True
        except OSError:
            return 'The ROS master does not answer'
        if self._is_unknown:
            self._is_unknown = not self._register_again()
        return ''

    def _register_again(self) -> bool:
        """Register the node with a master that was started after it; return whether all is done.

        If that failed halfway, the master already knows the node.
        """
        own = rospy.get_node_uri()
        try:
            with ServerProxy(rosgraph.get_master_uri(),
                             transport=LimitedTransport(PATIENT_TIMEOUT_S)) as master, \
                    ServerProxy(own, transport=LimitedTransport(PATIENT_TIMEOUT_S)) as node:
                for it in [*self._subscribers, *self._clouds]:
                    answer: Any = master.registerSubscriber(rospy.get_name(), it.resolved_name,
                                                            it.type, own)
                    node.publisherUpdate('/master', it.resolved_name, answer[2])
        except CONNECTION_ERRORS as error:
            rospy.logdebug('not registered: %s', error)
            return False  # tried again at the next check
        return True
