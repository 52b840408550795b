# SPDX-License-Identifier: BSD-3-Clause
"""A stage for playback without ROS: a recording in memory, a scripted clock and a viewer."""
from __future__ import annotations

import io
import struct
import threading
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from bags_fake_clock import FakeClock
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Path
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from process_visualizer.bagio.bag_index import BagIndex, ChunkPlaces, Columns
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.playback.engine import Playback, UnevenParts
from process_visualizer.playback.player_control import PlayerControl
from process_visualizer.playback.scheduled_output import RestoredStamps
from process_visualizer.playback.timeline import Timeline

BEGIN_NS = 1_600_000_000_000_000_000
MS = 1_000_000

NUMBERED = Connection('/a', 'test_msgs/Numbered', '*', 'Header header\nint32 number\n' + '=' * 80
                      + '\nMSG: std_msgs/Header\n' + Header._full_text, False, '/n')
CONNECTIONS = (
    NUMBERED,
    NUMBERED._replace(topic='/b'),
    NUMBERED._replace(topic='/latched', latching=True, caller_id='/one'),
    NUMBERED._replace(topic='/latched', latching=True, caller_id='/two'),
    Connection('/tf_static', TFMessage._type, TFMessage._md5sum, TFMessage._full_text, True, '/n'),
    Connection('/markers', Marker._type, Marker._md5sum, Marker._full_text, False, '/n'),
    Connection('/path', Path._type, Path._md5sum, Path._full_text, False, '/n'),
    Connection('/tf_static', TFMessage._type, TFMessage._md5sum, TFMessage._full_text, True, '/o'),
    NUMBERED._replace(topic='/picture', type='sensor_msgs/Image'),
)
LATCHED, STATIC, MARKERS, PATH, OTHER_STATIC, PICTURE = 2, 4, 5, 6, 7, 8
LARGE = (1, 3, PATH)  # includes one of two latched messages
SOURCES = (0, 1, 2, 3, 4, 5, 6, 4, 8)
MOMENT_MS = 200  # messages this early are in the scene from the beginning


class Message(NamedTuple):
    """Message of the recording: connection number, time and stamp [ms from the start]."""

    connection: int
    time_ms: int
    stamp_ms: int = -1  # below 0: same as its time

    @property
    def stamp_ns(self) -> int:
        """The stamp in the message [bag ns]."""
        return self.time_ns if self.stamp_ms < 0 else BEGIN_NS + self.stamp_ms * MS

    @property
    def time_ns(self) -> int:
        """Bag time [ns]."""
        return BEGIN_NS + self.time_ms * MS


class MemoryRecording:
    """The parts of Recording that playback needs; the number in a message is its position."""

    gaps = ()

    def __init__(self, messages: Sequence[Message]) -> None:
        count = len(messages)
        self._messages = messages
        columns = Columns(np.array([it.time_ns for it in messages], np.int64),
                          np.array([it.connection for it in messages], np.int16),
                          np.zeros(count, np.int32), np.arange(count, dtype=np.int32))
        self.index = BagIndex(CONNECTIONS, columns,
                              ChunkPlaces(np.zeros(1, np.int32), np.zeros(1, np.int64)))
        self.begin_ns, self.end_ns = self.index.begin_ns, self.index.end_ns

    def message(self, position: int) -> memoryview:
        """The serialized message."""
        connection = int(self.index.connection[position])
        stamp = struct.pack('<II', *divmod(self._messages[position].stamp_ns, 10 ** 9))
        if connection in (STATIC, OTHER_STATIC):
            return memoryview(static_message(position, stamp))
        if connection == PATH:
            pose = PoseStamped()
            pose.pose.position.x = position
            return memoryview(serialized(Path(header=Header(frame_id='world'), poses=[pose])))
        if connection == MARKERS:
            return memoryview(serialized(Marker(header=Header(frame_id='world'), id=position % 3,
                                                ns=str(position))))
        return memoryview(struct.pack('<I', 0) + stamp + struct.pack('<Ii', 0, position))


def static_message(position: int, stamp: bytes) -> bytes:
    """A transform to one of three frames, with its position in the recording as x."""
    transform = TransformStamped(child_frame_id=f'frame{position % 3}')
    transform.transform.translation.x = position
    data = serialized(TFMessage([transform]))
    return data[:8] + stamp + data[16:]


def static_in(data: bytes) -> Dict[str, float]:
    """The frames in a message on /tf_static, with their x."""
    return {it.child_frame_id: it.transform.translation.x
            for it in TFMessage().deserialize(data).transforms}


def number_in(data: bytes) -> int:
    """The number in a numbered message."""
    return int(struct.unpack_from('<i', data, len(data) - 4)[0])


def serialized(message: object) -> bytes:
    """The bytes of a message."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


class ScriptedClock(FakeClock):
    """Clock that runs scripted actions at their times [ns], and ends when nothing is left to do."""

    def __init__(self) -> None:
        super().__init__()
        self.begin_ns = self.now_ns
        self._script: List[Tuple[int, int, Callable[[], object]]] = []
        self.at_end: Callable[[], object] = lambda: None
        self.on_time: Callable[[], object] = lambda: None  # called whenever time has advanced

    def at(self, time_ms: int, action: Callable[[], object]) -> None:
        """Run an action at a time from the beginning."""
        self._script.append((self.begin_ns + time_ms * MS, len(self._script), action))
        self._script.sort(key=lambda it: it[:2])

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        if self._script and self._script[0][0] <= self.now_ns + timeout_ns:
            time_ns, _, action = self._script.pop(0)
            self.now_ns = max(self.now_ns, time_ns)
            self.on_time()
            action()
        elif timeout_ns < 1 << 60:
            self.now_ns += timeout_ns
            self.on_time()
        else:
            self.at_end()


class Shown(NamedTuple):
    """Published message: connection, bytes and time [monotonic ns]; or withdrawn."""

    connection: int
    data: bytes
    now_ns: int
    withdrawn: bool = False

    @property
    def number(self) -> int:
        """The message's position in the recording."""
        return number_in(self.data)

    @property
    def stamp_ns(self) -> int:
        """The stamp in a numbered message."""
        seconds, nanoseconds = struct.unpack_from('<II', self.data, 4)
        return int(seconds) * 10 ** 9 + int(nanoseconds)


class Viewer:
    """Viewer that receives every message when due; publishing takes ``work_ns``.

    Sends as the real sender does. Messages of the connections LARGE are started ``begun_ns`` before
    they are due, once the earlier messages on their topic have been sent, and can then no longer be
    withdrawn. The same holds for messages that are sent at once, and for all messages given
    earlier.
    """

    def __init__(self, clock: ScriptedClock) -> None:
        self._clock = clock
        self.log: List[Shown] = []
        self.jumps: List[int] = []
        self.finished = 0
        self.ends = False  # at the end of the recording
        self.work_ns = 0
        self.watch: Callable[[], object] = lambda: None  # called at each message
        self.seen: Dict[int, int] = {}  # by connection: position of the message
        self.newest: Dict[str, int] = {}  # by topic
        self.path: List[int] = []
        self.latched: Dict[int, bytes] = {}  # by source, in this order, for later subscribers
        self.markers: List[str] = []  # their namespaces
        self.static: Dict[str, float] = {}
        self.begun_ns = 0
        self.restored_stamps: RestoredStamps = ()
        self._scheduled: List[Shown] = []
        self._kept_until_ns = 0  # messages due until then are not withdrawn
        clock.on_time = self.receive

    def publish(self, connection: int, pieces: Sequence[bytes], due_ns: int) -> None:
        self._schedule(Shown(connection, b''.join(pieces), due_ns))
        self._clock.now_ns += self.work_ns
        self.watch()
        self.receive()

    def withdraw(self, connection: int, due_ns: int) -> None:
        self._schedule(Shown(connection, b'', due_ns, withdrawn=True))
        self.receive()

    def _schedule(self, shown: Shown) -> None:
        self._note_begun()
        last_ns = self._scheduled[-1].now_ns if self._scheduled else 0
        due_ns = max(shown.now_ns, self._clock.now_ns, last_ns)
        if shown.now_ns <= self._clock.now_ns:
            self._kept_until_ns = due_ns
        self._scheduled.append(shown._replace(now_ns=due_ns))

    @property
    def waiting(self) -> int:
        """The number of messages that are not due yet."""
        return len(self._scheduled)

    def revoke(self, after_ns: int) -> int:
        self._note_begun()
        until_ns = max(after_ns, self._kept_until_ns)
        kept = [it for it in self._scheduled if it.now_ns <= until_ns]
        revoked = len(self._scheduled) - len(kept)
        self._scheduled = kept
        return revoked

    def _note_begun(self) -> None:
        topics_waiting = set()
        for it in self._scheduled:
            topic = CONNECTIONS[it.connection].topic
            begin_ns = it.now_ns - (self.begun_ns if it.connection in LARGE else 0)
            if begin_ns <= self._clock.now_ns and topic not in topics_waiting:
                self._kept_until_ns = max(self._kept_until_ns, it.now_ns)
            if it.now_ns > self._clock.now_ns:
                topics_waiting.add(topic)

    def receive(self) -> None:
        """Receive the messages that have become due."""
        while self._scheduled and self._scheduled[0].now_ns <= self._clock.now_ns:
            self._see(self._scheduled.pop(0))

    def _see(self, shown: Shown) -> None:
        self._latch(shown)
        if shown.withdrawn:
            return
        self.log.append(shown)
        connection, data = shown.connection, shown.data
        if connection in (STATIC, OTHER_STATIC):
            self.static.update(static_in(data))
        elif connection == MARKERS:
            marker = Marker().deserialize(data)
            self.markers = [] if marker.action == Marker.DELETEALL else [*self.markers, marker.ns]
        elif connection == PATH:
            self.path = [int(it.pose.position.x) for it in Path().deserialize(data).poses]
        else:
            self.seen[connection] = shown.number
            self.newest[CONNECTIONS[connection].topic] = shown.number

    def _latch(self, shown: Shown) -> None:
        self.latched.pop(SOURCES[shown.connection], None)
        if CONNECTIONS[shown.connection].latching and not shown.withdrawn:
            self.latched[SOURCES[shown.connection]] = shown.data

    def jump(self, bag_ns: int) -> None:
        self.jumps.append(bag_ns)

    def restored(self, stamps: RestoredStamps) -> None:
        self.restored_stamps = stamps

    def finish(self) -> bool:
        self.finished += 1
        return self.ends


class Stage:
    """A recording that is played to a viewer in fake time."""

    def __init__(self, messages: Sequence[Message], restamp: bool = True,
                 lead_bytes: int = 32 << 20, end_ms: Optional[int] = None,
                 skip_empty_ms: Optional[int] = None, pause_topics: Sequence[str] = (),
                 max_delay_ms: Optional[int] = None) -> None:
        self.messages = sorted(messages, key=lambda it: it.time_ms)
        self.clock = ScriptedClock()
        recording = MemoryRecording(self.messages)
        end_ns = recording.end_ns if end_ms is None else BEGIN_NS + end_ms * MS
        self.timeline = Timeline(recording.begin_ns, end_ns, self.clock)
        self.uneven_parts = UnevenParts(
            self.timeline,
            skip_empty_ms and skip_empty_ms * MS,
            pause_topics,
            max_delay_ms and max_delay_ms * MS,
        )
        self.viewer = Viewer(self.clock)
        self.playback = Playback(recording, self.timeline, self.viewer, restamp, self.clock,
                                 lead_bytes, self.uneven_parts)
        self.control = PlayerControl(self.timeline, self.playback)
        self.clock.at_end = self.playback.close

    def run(self) -> None:
        """Play until it is paused and the script is done."""
        self.playback.run()

    def numbers(self) -> List[int]:
        """Positions of the numbered messages in the order of publishing."""
        return [it.number for it in self.viewer.log if it.connection < STATIC]
