# SPDX-License-Identifier: BSD-3-Clause
"""The frame publisher: publishes each device's base frame and force frame on /tf_static."""
from __future__ import annotations

import sys
import threading
from contextlib import suppress
from typing import Any, Dict, Mapping, Optional

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from tf2_msgs.msg import TFMessage

from process_visualizer.health.node_pulse import SILENT, Connect, MasterLookup, Pulses, connecting
from process_visualizer.launching.ros_api import Master, MasterClient
from process_visualizer.nodes.common.complaints import SilentNode, SilentNodes
from process_visualizer.nodes.common.node_handle import NodeHandle, spin_to_end, start_node
from process_visualizer.parameters.cell_parameters import read_frames
from process_visualizer.robot.frames import Frame, FrameTree
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.rotations import quaternion_from_ypr
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH, STATIC_TF_TOPIC
from process_visualizer.srv import SetFrame, SetFrameRequest, SetFrameResponse

_WATCH = f'/{SCENE_WATCH}'
_PERIOD_S, _LISTEN_S = 0.2, 0.1


class FramePublisher:
    """Publishes all frames in one latched message; a service moves them."""

    def __init__(self, node: NodeHandle, tree: FrameTree, master: Optional[Master] = None,
                 connect: Connect = connecting) -> None:
        """Advertise and publish the frames; watch ``scene_watch``, which watches all other nodes.

        See `Pulses` for ``connect``.
        """
        self._node = node
        self._silent = SilentNodes(node)
        self._lookup = MasterLookup(master or MasterClient(node.name))
        self._pulses = Pulses(self._lookup, connect)
        self._pulses.watch([_WATCH])
        self._tree = tree
        self._lock = threading.Lock()  # each service call has a thread of its own
        self._publisher = node.publisher(STATIC_TF_TOPIC, TFMessage, latch=True)
        self._publish()
        node.serve('~set_frame', SetFrame, self._on_set_frame)
        node.worker(self._look, 'watch').wake()

    def _publish(self) -> None:
        now = self._node.now()
        frames = [transform_message(frame, now) for frame in self._tree.frames()]
        self._publisher.publish(TFMessage(frames))

    def _look(self) -> float:
        """Ask ``scene_watch``; return the time until the next question [s]."""
        self._lookup.is_silent = False
        self._pulses.step(self._node.monotonic_s(), _LISTEN_S)
        watch = self._pulses.nodes[_WATCH]
        self._silent.tell({_WATCH: SilentNode('', 'nodes that hang are not reported',
                                              watch.problem_since_s)}
                          if watch.problem == SILENT else {})
        return _PERIOD_S

    def _on_set_frame(self, request: SetFrameRequest) -> SetFrameResponse:
        with self._lock:
            try:
                parent = request.parent.lstrip('/')
                links = model_links(self._node.param('/', {})) if parent else {}
                frame = self._tree.move(parent, request.child.lstrip('/'), tuple(request.xyz),
                                        tuple(request.ypr), links)
            except ValueError as error:
                return SetFrameResponse(False, str(error))
            self._publish()
        return SetFrameResponse(True, f'{frame.child} is at {list(frame.xyz)} m, '
                                      f'yaw pitch roll {list(frame.ypr)} rad in {frame.parent}')


def model_links(parameters: Mapping[str, Any]) -> Dict[str, str]:
    """Return the parent of each link in all robot descriptions among the parameters."""
    links: Dict[str, str] = {}
    for group in parameters.values():
        text = group.get('robot_description') if isinstance(group, dict) else None
        with suppress(ValueError):  # the frames of an invalid model are not published
            links.update(Kinematics(str(text or '<robot/>')).parents)
    return links


def transform_message(frame: Frame, stamp: rospy.Time) -> TransformStamped:
    """Return a frame as a message."""
    message = TransformStamped()
    message.header.stamp = stamp
    message.header.frame_id = frame.parent
    message.child_frame_id = frame.child
    message.transform.translation = Vector3(*frame.xyz)
    message.transform.rotation = Quaternion(*quaternion_from_ypr(frame.ypr))
    return message


def main() -> None:
    """Run the node; it ends with status 1 when its frames are wrong."""
    start_node(CELL_FRAMES)
    try:
        FramePublisher(NodeHandle(), FrameTree(read_frames(rospy.get_param('~frames', []))))
    except ValueError as error:
        rospy.logfatal('parameter %s: %s', rospy.resolve_name('~frames'), error)
        sys.exit(1)
    spin_to_end()
