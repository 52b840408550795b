# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's own ROS node, also for the boxes and objects of depth sensors."""
from __future__ import annotations

import math
import time
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from PyQt5.QtCore import QObject, pyqtSignal
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import RegionOfInterest as PlaceMessage
from std_msgs.msg import Bool, String

from process_visualizer.cell.model import Pose, RegionOfInterest
from process_visualizer.clients.bag_recorder import BagRecorder, RecorderMemory
from process_visualizer.clients.connector import connect_patiently
from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.clients.running_system import from_system
from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.discovery.new_configuration import NewConfiguration
from process_visualizer.gui.ros.replay_link import ReplayLink, player_snapshot
from process_visualizer.gui.ros.rviz_markers import BoxMarker, PoseMarker
from process_visualizer.gui.ros.snapshots import (
    DisplaySnapshot,
    KeyPress,
    ObjectsSnapshot,
    PhaseSnapshot,
    RecorderSnapshot,
    TopicSnapshot,
)
from process_visualizer.gui.toolkit.tasks import NewestValue
from process_visualizer.health.near_objects import seen_objects
from process_visualizer.health.node_warnings import NodeWarnings, Severity
from process_visualizer.launching.cell_owner import cell_owner
from process_visualizer.msg import (
    DetectedObject,
    DetectedObjects,
    GhostPhase,
    RecorderState,
    TopicRecord,
)
from process_visualizer.ros_names import (
    BANDS_TOPIC,
    CELL_FRAMES,
    COMPARISON_TOPIC,
    DISPLAY_STATUS_TOPIC,
    GHOST_PHASE_TOPIC,
    OBJECTS,
    ROI_FILTER,
    RVIZ_CAMERA_TOPIC,
    RVIZ_COVERED_TOPIC,
    RVIZ_KEY_TOPIC,
    RVIZ_KEYS_TOPIC,
    RVIZ_PLACE_TOPIC,
    RVIZ_WINDOW_TOPIC,
)
from process_visualizer.rviz.window_geometry import Rectangle
from process_visualizer.srv import SetFrame

NODE = 'process_visualizer'
_PHASES = {RecorderState.IDLE: 'idle', RecorderState.STARTING: 'starting',
           RecorderState.RECORDING: 'recording', RecorderState.STOPPING: 'stopping'}
_SEVERITIES = {DiagnosticStatus.WARN: Severity.WARNING, DiagnosticStatus.ERROR: Severity.ERROR}


class RosLinkError(Exception):
    """The launcher cannot be a node, or a node refused; the text says why and what to do."""


class RosLink(QObject):
    """Turns messages of nodes into snapshots, delivered in the GUI thread by queued signals.

    Of the states of player, recorder and displays, a late GUI thread gets only the newest.

    Its methods and the commands of ``player`` and ``recorder`` block: run them as tasks. Nothing
    is delivered before ``begin``.
    """

    player_state = pyqtSignal(object)
    recorder_state = pyqtSignal(object)
    displays = pyqtSignal(object)
    """A tuple of DisplaySnapshot."""
    ghost_phase = pyqtSignal(object)
    rviz_moved = pyqtSignal()
    """RViz has been moved or resized, by anyone."""
    key_pressed = pyqtSignal(object)
    """One of the keys of ``take_keys`` was pressed in RViz, or in that of a replay: a KeyPress."""
    pose_dragged = pyqtSignal(str, object)
    """A frame has been dragged in RViz to this Pose in the global frame."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._displays = NewestValue(self)
        recorder_states, player_states = NewestValue(self), NewestValue(self)
        self._displays.came.connect(self.displays)
        recorder_states.came.connect(self.recorder_state)
        player_states.came.connect(self.player_state)
        self.player = PlayerClient(lambda state: player_states.put(player_snapshot(state)),
                                   follow_now=False)
        self.recorder = BagRecorder(lambda state: recorder_states.put(_recorder(state)),
                                    follow_now=False)
        self.memory = RecorderMemory()
        self._frames = ServiceConnection(f'/{CELL_FRAMES}/set_frame', SetFrame)
        self.warnings = NodeWarnings()
        self._subscribers: List[rospy.Subscriber] = []
        self._marker = PoseMarker(self.pose_dragged.emit)
        self._place: Optional[Rectangle] = None
        self._window: Optional[Rectangle] = None
        self._camera = ''
        self._keys: Sequence[str] = ()
        self.replay = ReplayLink(self.recorder.copy_recent, lambda: self._camera,
                                 lambda: self._window or self._place, lambda: self._keys, self)
        self.replay.key_pressed.connect(self.key_pressed)
        self._place_publisher: Optional[rospy.Publisher] = None
        self._keys_publisher: Optional[rospy.Publisher] = None
        self._covered_publisher: Optional[rospy.Publisher] = None
        self._is_covered = False
        self._comparison_publishers: Tuple[rospy.Publisher, ...] = ()

    def begin(self) -> None:
        """Register as a node with the master.

        Raises:
            RosLinkError: another launcher is running, or the master does not answer.
        """
        _refuse_second_launcher()
        try:
            rospy.init_node(NODE, disable_signals=True)
            connect_patiently()
            self._subscribe()
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'The ROS master at {rosgraph.get_master_uri()} has refused the '
                               f'launcher ({error}). Start the launcher again.') from error

    def place_rviz(self, place: Rectangle) -> None:
        """Move RViz, now and whenever it starts, to a place in unscaled pixels of the screen.

        Return at once. x and y are those of the window's frame; the size excludes the frame.
        """
        self._place = place
        self._send_place()

    def cover_rviz(self, is_covered: bool) -> None:
        """Tell RViz whether another window covers its own; return at once.

        RViz then draws few pictures, and the other window's program gets the time.
        """
        if is_covered != self._is_covered:
            self._is_covered = is_covered
            self._send_covered()

    def take_keys(self, keys: Sequence[str]) -> None:
        """Let RViz pass on these keys, as written by QKeySequence; return at once."""
        if tuple(keys) != self._keys:
            self._keys = tuple(keys)
            self._send_keys()

    def tell_comparison(self, verdict: Callable[[], str], bands: Callable[[], str]) -> None:
        """Publish the comparison of the running cell with good runs; return at once.

        The texts are made only for topics with a subscriber.
        """
        for publisher, text in zip(self._comparison_publishers, (verdict, bands)):
            if publisher.get_num_connections() > 0:
                publisher.publish(String(text()))

    def _send_covered(self) -> None:
        if self._covered_publisher is not None:
            self._covered_publisher.publish(Bool(self._is_covered))

    def _send_keys(self) -> None:
        if self._keys_publisher is not None:
            self._keys_publisher.publish(String('\n'.join(self._keys)))

    def _send_place(self) -> None:
        place, publisher = self._place, self._place_publisher
        if place is not None and publisher is not None:
            publisher.publish(PlaceMessage(
                x_offset=max(place.x, 0), y_offset=max(place.y, 0), width=place.width,
                height=place.height))

    def _subscribe(self) -> None:
        self._place_publisher = rospy.Publisher(RVIZ_PLACE_TOPIC, PlaceMessage, queue_size=1,
                                                latch=True)
        self._send_place()
        self._covered_publisher = rospy.Publisher(RVIZ_COVERED_TOPIC, Bool, queue_size=1,
                                                  latch=True)
        self._send_covered()
        self._keys_publisher = rospy.Publisher(RVIZ_KEYS_TOPIC, String, queue_size=1, latch=True)
        self._send_keys()
        self._comparison_publishers = tuple(
            rospy.Publisher(it, String, queue_size=1) for it in (COMPARISON_TOPIC, BANDS_TOPIC))
        self.player.begin()
        self.recorder.begin()
        self._subscribers = [
            rospy.Subscriber(DISPLAY_STATUS_TOPIC, DiagnosticArray,
                             lambda report: self._displays.put(tuple(
                                 DisplaySnapshot(it.name, int(it.level), it.message)
                                 for it in report.status)), queue_size=2),
            rospy.Subscriber(GHOST_PHASE_TOPIC, GhostPhase,
                             lambda phase: self.ghost_phase.emit(_phase(phase)), queue_size=100),
            rospy.Subscriber(RVIZ_CAMERA_TOPIC, String, self._take_camera, queue_size=1),
            rospy.Subscriber(RVIZ_WINDOW_TOPIC, PlaceMessage, self._take_window, queue_size=1),
            rospy.Subscriber(RVIZ_KEY_TOPIC, String,
                             lambda text: self.key_pressed.emit(
                                 KeyPress.from_text(text.data, time.time())), queue_size=10),
            rospy.Subscriber('/rosout', Log, self._take_log),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self._take_states)]

    def _take_camera(self, camera: String) -> None:
        self._camera = camera.data

    def _take_window(self, place: PlaceMessage) -> None:
        self._window = Rectangle(place.x_offset, place.y_offset, place.width, place.height)
        self.rviz_moved.emit()

    def _take_log(self, log: Any) -> None:
        if log.level >= Log.WARN:
            severity = Severity.WARNING if log.level == Log.WARN else Severity.ERROR
            self.warnings.take_log(_sender(log), severity, log.msg, time.monotonic())

    def _take_states(self, report: Any) -> None:
        for it in report.status:
            self.warnings.take_state(_sender(report), it.name, _SEVERITIES.get(it.level),
                                     it.message, time.monotonic(),
                                     {pair.key: pair.value for pair in it.values})

    def end(self) -> None:
        """Unregister from the master."""
        if rospy.core.is_initialized():
            rospy.signal_shutdown('the launcher is closed')

    @staticmethod
    def look_at_system() -> NewConfiguration:
        """Return a configuration for the nodes that are running; takes some seconds.

        Raises:
            ValueError: nothing that belongs in a configuration is running, or there is no master.
        """
        if not rospy.core.is_initialized():
            raise ValueError('the launcher has no ROS master to ask')
        return from_system()

    def move_frame(self, frame: str, xyz: Sequence[float], ypr: Sequence[float]) -> str:
        """Move a base frame while everything runs; return the answer of cell_frames.

        xyz in m, ypr in rad (yaw pitch roll).

        Raises:
            RosLinkError: cell_frames does not answer, or refuses.
        """
        try:
            answer = self._frames.call('', frame, list(xyz), list(ypr))
        except ServiceUnreachable as error:
            raise RosLinkError(f'{frame} is not moved: {error}') from error
        if not answer.success:
            raise RosLinkError(f'{frame} is not moved: {answer.message}')
        return str(answer.message)

    def show_marker(self, parent: str, frame: str, pose: Pose) -> None:
        """Show a marker for dragging a frame in RViz; ``pose`` is in the parent frame.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._marker.show(parent, frame, pose)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'{frame} has no marker: the ROS master does not answer '
                               f'({error})') from error

    def move_marker(self, frame: str, pose: Pose) -> None:
        """Move the marker to a frame's new pose if it is the marker of this frame."""
        if frame == self._marker.frame:
            self._marker.move(pose)

    def hide_marker(self) -> None:
        """Remove the marker."""
        self._marker.hide()


def _refuse_second_launcher() -> None:
    """Raise RosLinkError if another launcher runs: nodes of the same name replace each other.

    The other launcher may have started after this program.
    """
    owner = cell_owner(NODE)
    if owner is not None:
        raise RosLinkError(f'{owner.text}. Close it, or set ROS_MASTER_URI.')


def _sender(message: Any) -> str:
    """Return the node that sent a message, regardless of the message's content."""
    return str(message._connection_header['callerid'])


def _recorder(state: RecorderState) -> RecorderSnapshot:
    return RecorderSnapshot(
        phase=_PHASES[state.state], files=tuple(state.files), duration_s=state.duration,
        messages=state.messages, dropped=state.dropped, lost=state.lost, bytes=state.bytes,
        rate=state.rate, free_bytes=state.free_bytes, time_left_s=_known(state.time_left),
        recent_s=state.recent, remembered_s=state.remembered, problems=tuple(state.problems),
        topics=tuple(_topic(topic) for topic in state.topics), stamp_s=state.stamp.to_sec())


def _topic(topic: TopicRecord) -> TopicSnapshot:
    return TopicSnapshot(
        name=topic.name, type=topic.type, publishers=topic.publishers, messages=topic.messages,
        rate_hz=topic.rate, bytes=topic.bytes, dropped=topic.dropped, lost=topic.lost,
        silence_s=_known(topic.silence), is_latched=topic.latching,
        largest_gap_s=topic.largest_gap)


def _known(value: float) -> Optional[float]:
    """Return a value of the recorder; None for -1, which it sends for unknown values."""
    return None if value < 0.0 else value


def _phase(phase: GhostPhase) -> PhaseSnapshot:
    return PhaseSnapshot(phase.stamp.to_sec(), phase.reference if phase.known else None,
                         None if math.isnan(phase.behind) else phase.behind)


class RegionLink(QObject):
    """Moves boxes while everything runs; all methods but the constructor block."""

    dragged = pyqtSignal(str, object)
    """The box of a device (by name) has been dragged in RViz to this RegionOfInterest."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._marker = BoxMarker(self.dragged.emit)

    def move(self, device: str, region: RegionOfInterest) -> None:
        """Set the box to which a device's cloud is cropped; it takes effect with the next cloud.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            for name, values in (('center', region.center), ('size', region.size)):
                rospy.set_param(f'/{device}/{ROI_FILTER}/{name}', [float(it) for it in values])
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the ROS master does not answer ({error})') from error

    def show_marker(self, device: str, region: RegionOfInterest) -> None:
        """Show the box of a device for dragging in RViz.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._marker.show(device, region)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError(f'the box of {device} cannot be dragged: the ROS master does not '
                               f'answer ({error})') from error

    def move_marker(self, device: str, region: RegionOfInterest) -> None:
        """Move the box in RViz."""
        self._marker.move(device, region)

    def hide_marker(self) -> None:
        """Remove the box from RViz."""
        self._marker.hide()


_BEAT_S = 1.0


class ObjectLink(QObject):
    """Follows the objects of depth sensors; while the cell is clear, this costs little time."""

    seen = pyqtSignal(object)
    """An ObjectsSnapshot: each one with a near object, the first without, and one per second."""

    def __init__(self, parent: Optional[QObject] = None,
                 monotonic_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__(parent)
        self._monotonic_s = monotonic_s
        self._subscribers: Dict[str, rospy.Subscriber] = {}
        self._was_near: Dict[str, bool] = {}  # each entry is written by its subscriber's thread
        self._reported_s: Dict[str, float] = {}

    def follow(self, devices: Iterable[str]) -> None:
        """Follow these depth sensors (by name) and no others; blocks for a moment.

        Raises:
            RosLinkError: the master does not answer.
        """
        try:
            self._follow(devices)
        except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
            raise RosLinkError('no alarms for objects near robots: the ROS master does not answer '
                               f'({error})') from error

    def _follow(self, devices: Iterable[str]) -> None:
        wanted = set(devices)
        for device in set(self._subscribers) - wanted:
            self._subscribers.pop(device).unregister()
        for device in wanted - set(self._subscribers):
            self._subscribers[device] = rospy.Subscriber(
                f'/{device}/{OBJECTS}', DetectedObjects, self._take, device, queue_size=2)

    def _take(self, message: DetectedObjects, device: str) -> None:
        is_near = any(it.level != DetectedObject.CLEAR for it in message.objects)
        now_s = self._monotonic_s()
        is_due = now_s >= self._reported_s.get(device, -math.inf) + _BEAT_S
        if is_near or is_due or self._was_near.get(device, False):
            self._reported_s[device] = now_s
            self.seen.emit(ObjectsSnapshot(device, message.header.stamp.to_sec(),
                                           seen_objects(message)))
        self._was_near[device] = is_near
