"""The frame publisher: every device's base frame and force frame on /tf_static."""
from __future__ import annotations

import sys
import threading
from dataclasses import dataclass, replace
from typing import Any, Dict, Iterable, List, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from tf2_msgs.msg import TFMessage

from process_visualizer.motion.rotations import quaternion_from_ypr
from process_visualizer.nodes.parameters import ParameterError, Parameters
from process_visualizer.srv import SetFrame, SetFrameRequest, SetFrameResponse

Triple = Tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """A fixed frame: its pose in its parent, xyz [m] and yaw pitch roll [rad]."""

    parent: str
    child: str
    xyz: Triple = (0.0, 0.0, 0.0)
    ypr: Triple = (0.0, 0.0, 0.0)

    def transform(self, stamp: rospy.Time) -> TransformStamped:
        """Return the frame as a message."""
        message = TransformStamped()
        message.header.stamp = stamp
        message.header.frame_id = self.parent
        message.child_frame_id = self.child
        message.transform.translation = Vector3(*self.xyz)
        message.transform.rotation = Quaternion(*quaternion_from_ypr(self.ypr))
        return message


class FrameTree:
    """The frames by name; every change that would make tf2 fail is refused."""

    def __init__(self, frames: Iterable[Frame]) -> None:
        """Take the frames.

        Raises:
            ValueError: a frame is there twice, has no name or parent, or is its own ancestor.
        """
        self._frames: Dict[str, Frame] = {}
        for frame in frames:
            if frame.child in self._frames:
                raise ValueError(f'the frame {frame.child} is there twice')
            self._put(frame)

    def frames(self) -> List[Frame]:
        """Return all frames."""
        return list(self._frames.values())

    def move(self, parent: str, child: str, xyz: Triple, ypr: Triple) -> Frame:
        """Move a frame, to another parent unless that is ''; return the frame as it is now.

        Raises:
            ValueError: the frame is not known, the numbers are not finite, or it would be its
                own ancestor. Nothing is changed then.
        """
        known = self._frames.get(child)
        if known is None:
            raise ValueError(f"the frame '{child}' is not known; known are: "
                             f'{", ".join(sorted(self._frames)) or "none"}')
        if not np.isfinite([*xyz, *ypr]).all():
            raise ValueError(f'the pose of {child} holds NaN or infinity')
        moved = replace(known, parent=parent or known.parent, xyz=xyz, ypr=ypr)
        self._put(moved)
        return moved

    def _put(self, frame: Frame) -> None:
        if not frame.parent or not frame.child:
            raise ValueError('a frame needs a parent and a child, '
                             f"not parent '{frame.parent}' and child '{frame.child}'")
        ancestor = frame.parent
        while ancestor != frame.child and ancestor in self._frames:
            ancestor = self._frames[ancestor].parent
        if ancestor == frame.child:
            raise ValueError(f'the frame {frame.child} would be its own ancestor '
                             f'with the parent {frame.parent}')
        self._frames[frame.child] = frame


class FramePublisher:
    """Publishes the frames, latched and all in one message, and moves them by a service."""

    def __init__(self, tree: FrameTree) -> None:
        """Advertise, and publish the frames."""
        self._tree = tree
        self._lock = threading.Lock()  # each service call has a thread of its own
        self._publisher = rospy.Publisher('/tf_static', TFMessage, latch=True, queue_size=10)
        self._publish()
        self._service = rospy.Service('~set_frame', SetFrame, self._on_set_frame)

    def _publish(self) -> None:
        now = rospy.Time.now()
        self._publisher.publish(TFMessage([frame.transform(now) for frame in self._tree.frames()]))

    def _on_set_frame(self, request: SetFrameRequest) -> SetFrameResponse:
        with self._lock:
            try:
                frame = self._tree.move(request.parent.lstrip('/'), request.child.lstrip('/'),
                                        tuple(request.xyz), tuple(request.ypr))
            except ValueError as error:
                return SetFrameResponse(False, str(error))
            self._publish()
        return SetFrameResponse(True, f'{frame.child} is at {list(frame.xyz)} m, '
                                      f'yaw pitch roll {list(frame.ypr)} rad in {frame.parent}')


def read_frames(entries: Any, path: str) -> List[Frame]:
    """Return the frames of a parameter: a list of dictionaries parent, child, xyz, ypr.

    Raises:
        ParameterError: the parameter is not such a list.
    """
    if not isinstance(entries, list):
        raise ParameterError(f'parameter {path}: a list of frames is expected, not {entries!r}')
    groups = [Parameters(entry, f'{path}[{index}]') for index, entry in enumerate(entries)]
    zero = (0.0, 0.0, 0.0)
    return [Frame(group.frame('parent', ''), group.frame('child', ''),
                  group.vector('xyz', zero), group.vector('ypr', zero)) for group in groups]


def main() -> None:
    """Run the node; it ends with status 1 when its frames are wrong."""
    rospy.init_node('cell_frames')
    path = rospy.resolve_name('~frames')
    try:
        FramePublisher(FrameTree(read_frames(rospy.get_param('~frames', []), path)))
    except ValueError as error:
        rospy.logfatal('%s: %s', path, error)
        sys.exit(1)
    rospy.spin()
