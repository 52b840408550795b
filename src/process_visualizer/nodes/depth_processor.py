# SPDX-License-Identifier: BSD-3-Clause
"""The depth data processor (thesis section 5.4): a depth sensor's clouds with current stamps.

RViz discards old data, such as the clouds of another program's recording. Current stamps are kept,
so that RViz draws a cloud at the pose that its frame had when the cloud was taken. The clouds are
republished as the received bytes; only their header is rewritten.
"""
from __future__ import annotations

import io
import struct
import sys
from typing import BinaryIO, Callable, ClassVar, Optional

import rospy
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Float32, Header

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    required_name,
    spin_to_end,
    start_node,
)
from process_visualizer.ros_names import DEPTH_PROC

MAX_AGE_NS = 1_000_000_000
"""Maximum age of a stamp when its message arrives [ns]; an older one is from another clock. tf2
forgets transforms after 10 s."""


class KeptStamps:
    """Keeps the stamps of one topic, or shifts all by the same time if they are from another clock.

    A shift preserves the differences between the sensor's stamps; it assumes that the fastest
    message arrived without delay. No stamp is later than its arrival or more than ``MAX_AGE_NS``
    earlier, so RViz and tf2 accept all of them.
    """

    def __init__(self) -> None:
        self._shift_ns = 0

    def stamp(self, stamp_ns: int, arrival_ns: int) -> int:
        """Return the stamp to publish [ns] for the stamp of a message (0: none) and its arrival."""
        if stamp_ns == 0:
            return arrival_ns
        if not _is_plausible(stamp_ns + self._shift_ns, arrival_ns):
            is_same_clock = _is_plausible(stamp_ns, arrival_ns)
            self._shift_ns = 0 if is_same_clock else arrival_ns - stamp_ns
        return stamp_ns + self._shift_ns


def _is_plausible(stamp_ns: int, arrival_ns: int) -> bool:
    return 0 <= arrival_ns - stamp_ns <= MAX_AGE_NS


# std_msgs/Header on the wire: seq, stamp (s, ns), and the length of frame_id, which follows.
_HEADER = struct.Struct('<4I')
# Clouds are read from the socket in pieces of at most this many bytes.
_BUFFER_SIZE = 1 << 24
SILENT_AFTER_S = 10.0
AGE_PERIOD_S = 0.2


def restamp(message: bytes, new_stamp: Callable[[rospy.Time], rospy.Time]
            ) -> tuple[bytes, memoryview]:
    """Return a new header for a serialized message that begins with one, and the rest of it.

    ``new_stamp`` maps the old stamp to the new one. The new header's frame_id has no leading slash,
    because tf2 rejects one. The rest is a view of ``message``, not a copy.

    Raises:
        ValueError: the message is shorter than its header.
    """
    if len(message) < _HEADER.size:
        raise ValueError(f'{len(message)} bytes are not a message with a header')
    seq, secs, nsecs, length = _HEADER.unpack_from(message)
    end = _HEADER.size + length
    if len(message) < end:
        raise ValueError(f'{len(message)} bytes are not a message with a frame_id of {length} '
                         'bytes')
    frame_id = message[_HEADER.size:end].lstrip(b'/')
    stamp = new_stamp(rospy.Time(secs, nsecs))
    return (_HEADER.pack(seq, stamp.secs, stamp.nsecs, len(frame_id)) + frame_id,
            memoryview(message)[end:])


class SerializedPointCloud2(rospy.AnyMsg):
    """A sensor_msgs/PointCloud2 that is published as the received bytes."""

    _type: ClassVar[str] = PointCloud2._type
    _md5sum: ClassVar[str] = PointCloud2._md5sum
    _full_text: ClassVar[str] = PointCloud2._full_text
    # rospy must not write a new header.seq.
    _has_header: ClassVar[bool] = False

    __slots__ = ('_parts',)

    def __init__(self, *parts: bytes | memoryview) -> None:
        super().__init__()
        self._parts = parts

    def serialize(self, buff: BinaryIO) -> None:
        """Write the message to ``buff``."""
        for part in self._parts:
            buff.write(part)


class DepthProcessor:
    """Republishes the clouds of ``~input`` on ``points``, with current stamps (see `KeptStamps`).

    ``points_age`` carries the age of the last cloud [s]; the age of a played cloud does not
    increase while playback is paused.

    The private parameter ``~topic`` names another input topic. Until the first cloud arrives, each
    subscriber receives an empty one in the frame ``~frame``, if that is set: what RViz still shows
    was sent by an earlier process, perhaps before the change to playback. If another recording is
    played, an empty cloud clears the last one, which is not from this recording.
    """

    def __init__(self, node: NodeHandle, device: str) -> None:
        """Subscribe, advertise, and start the timers.

        Raises:
            ValueError: the parameter is not the name of a topic.
        """
        self._node = node
        self._complaints = Complaints(node, device)
        self._playback = PlaybackFollower(node)
        self._stamps = KeptStamps()
        self._last_s: Optional[float] = None
        self._age = node.publisher('points_age', Float32, queue_size=1)
        self._frame = str(node.param('~frame', '')).lstrip('/')
        self._received = False
        self._publisher = node.publisher('points', SerializedPointCloud2, queue_size=1,
                                         greeting=self._nothing_yet)
        topic = node.param('~topic', '~input')
        if not isinstance(topic, str):
            raise ValueError(f"parameter {node.resolve('~topic')}: a topic is expected, "
                             f'not {topic!r:.100}')
        self._topic = node.resolve(required_name(topic))
        node.subscribe(self._topic, rospy.AnyMsg, self._republish, queue_size=1,
                       buff_size=_BUFFER_SIZE)
        node.every(AGE_PERIOD_S, self._publish_age)
        self._silence = node.every(SILENT_AFTER_S, self._report_silence)

    def _nothing_yet(self) -> Optional[SerializedPointCloud2]:
        """Return an empty cloud; None without a frame, or after the first cloud."""
        return None if self._received or not self._frame else self._empty()

    def _empty(self) -> SerializedPointCloud2:
        # RViz chooses the coloring by the fields of the first cloud, and keeps it.
        names = 'x', 'y', 'z', 'rgb', 'intensity'
        fields = [PointField(name, 4 * row, PointField.FLOAT32, 1)
                  for row, name in enumerate(names)]
        cloud = PointCloud2(Header(0, self._node.now(), self._frame), 1, 0, fields, False,
                            4 * len(names), 0, b'', True)
        written = io.BytesIO()
        cloud.serialize(written)
        return SerializedPointCloud2(written.getvalue())

    def _republish(self, message: rospy.AnyMsg) -> None:
        self._received = True
        self._last_s = self._playback.data_time_s()
        connection = message._connection_header
        if connection['md5sum'] != PointCloud2._md5sum:
            self._complain(f"{self._topic} carries {connection['type']} (published by "
                           f"{connection['callerid']}), but the clouds must be "
                           f"{PointCloud2._type}")
            return
        try:
            parts = restamp(message._buff, self._kept)
        except ValueError as error:
            self._complain(f'{self._topic}: {error}')
            return
        self._complaints.note_good(self._topic)
        self._publisher.publish(SerializedPointCloud2(*parts))

    def _kept(self, stamp: rospy.Time) -> rospy.Time:
        stamp_ns = self._stamps.stamp(stamp.to_nsec(), self._node.now().to_nsec())
        return rospy.Time(*divmod(stamp_ns, 10 ** 9))

    def _publish_age(self) -> None:
        if self._last_s is not None and self._frame \
                and self._playback.is_from_before(self._last_s):
            self._last_s = None
            self._publisher.publish(self._empty())
        if self._last_s is not None:
            self._age.publish(self._playback.age_s(self._last_s))

    def _report_silence(self) -> None:
        self._silence.shutdown()  # once
        if not self._received:
            self._complaints.state(self._topic, f'No cloud has been received on {self._topic} yet')

    def _complain(self, problem: str) -> None:
        self._complaints.add(self._topic, problem, is_error=True)


def main() -> None:
    """Run the node until ROS shuts it down."""
    start_node(DEPTH_PROC)
    try:
        DepthProcessor(NodeHandle(), rospy.get_namespace().strip('/'))
    except ValueError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    spin_to_end()
