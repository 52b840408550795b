# SPDX-License-Identifier: BSD-3-Clause
"""Machines and sensors: what publishes neither joints nor images, as devices."""
from __future__ import annotations

from typing import Collection, Dict, List, Sequence, Set

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.discovery.camera_device import add_inner_frames
from process_visualizer.discovery.cell_names import CellNames
from process_visualizer.discovery.draft import DraftDevice, DraftElement
from process_visualizer.discovery.evidence.frame_forest import FrameForest
from process_visualizer.discovery.evidence.seen import SeenTopic
from process_visualizer.discovery.names import is_frame
from process_visualizer.discovery.place import Places, top_frame
from process_visualizer.discovery.robot_device import add_topic
from process_visualizer.discovery.variables import candidates, left_out

ROOT_DEVICE = 'sensors'
"""What the device is called that gets the topics without a namespace."""
_VARIABLES = 'numbers that may be process variables: remove those that are none'
_CONSTANT = 'did not change while it was looked at'
_DRAWN = ('LaserScan', 'Path', 'Odometry', 'PointCloud', 'Polygon', 'PoseArray', 'GridCells',
          'Map', 'Marker', 'MarkerArray', 'PoseWithCovariance', 'PointStamped')
_DISPLAYS = {DISPLAY_TYPES[name].message_type: name for name in _DRAWN}


def by_namespace(topics: Sequence[SeenTopic]) -> Dict[str, List[SeenTopic]]:
    """Return topics by the first part of their namespace, '' where there is none."""
    found: Dict[str, List[SeenTopic]] = {}
    for topic in topics:
        first, slash, _ = topic.name.strip('/').partition('/')
        found.setdefault(first if slash else '', []).append(topic)
    return found


class Machines:
    """Adds machines and sensors to a configuration."""

    def __init__(self, names: CellNames, places: Places, forest: FrameForest,
                 known_frames: Collection[str], is_moment: bool = False) -> None:
        """``known_frames`` are those of models and devices; ``is_moment`` as in ``Seen``."""
        self._names, self._places, self._forest = names, places, forest
        self._known: Set[str] = {*known_frames, places.frame}
        self._color, self._is_moment = 0, is_moment

    def add_topics(self, device: DraftDevice, topics: Sequence[SeenTopic]) -> None:
        """Add topics with their variables and displays; a base frame where they need one."""
        for topic in topics:
            if not self._add_variables(device, topic):
                add_topic(device, topic)
                self._add_display(device, topic)
        self._add_display_frames(device, topics)

    def _add_variables(self, device: DraftDevice, topic: SeenTopic) -> bool:
        """Add the candidates of a topic; return whether one of them is a variable now."""
        found = candidates(topic, self._color, self._is_moment)
        self._color += len(found)
        frame = self._frame(device, topic) if found else ''
        comment = '' if device.first('variable') else _VARIABLES
        for it in found:
            device.add('variable', {'topic': topic.name.lstrip('/'), 'frame': frame,
                                    **it.attributes},
                       comment if it.likely else _CONSTANT, it.likely)
            comment = '' if it.likely else comment
        if left_out(topic):
            device.comments.append(f'{topic.name} has {left_out(topic)} more numbers.')
        return any(it.likely for it in found)

    def _frame(self, device: DraftDevice, topic: SeenTopic) -> str:
        """The frame at which an arrow stands: that of its messages, or the device's base frame."""
        known = [it for it in topic.frames if it in self._known and is_frame(it)]
        base = device.first('base')
        if known or base is not None:
            return known[0] if known else str(base.attributes['frame'] if base else '')
        free = [frame for frame in (*self._called_like(device), *topic.frames)
                if self._can_be_base(frame)]
        moved = [frame for frame in topic.frames if frame in self._forest.frames
                 and is_frame(frame)]
        if moved and not free:
            return moved[0]  # something else carries it, which only tf knows
        return self._add_base(device, free[0] if free else f'{device.name}/base')

    def _called_like(self, device: DraftDevice) -> List[str]:
        beginnings = (f'{device.name}/', f'{device.name}_')
        return [frame for frame in sorted(self._forest.children(self._places.frame))
                if frame == device.name or frame.startswith(beginnings)]

    def _can_be_base(self, frame: str) -> bool:
        """Return whether nobody has a frame, and nothing but the global frame carries it."""
        return (is_frame(frame) and self._names.is_free(frame)
                and self._forest.parent(frame) in (None, self._places.frame))

    def _add_base(self, device: DraftDevice, wanted: str) -> str:
        frame = self._names.frame(wanted)
        attributes, comment = self._places.base_attributes(frame)
        device.elements.insert(0, DraftElement('base', attributes, comment))
        self._known.add(frame)
        return frame

    def _add_display_frames(self, device: DraftDevice, topics: Sequence[SeenTopic]) -> None:
        """Add the frames that displays need: a machine's base, and what it carries."""
        frames = [frame for it in topics if it.type in _DISPLAYS for frame in it.frames
                  if is_frame(frame) and frame in self._forest.frames and frame not in self._known]
        tops = [top_frame(self._forest, frame, self._known) for frame in frames]
        own = [top for top, _ in tops if self._can_be_base(top)]
        if own and device.first('base') is None:
            self._add_base(device, own[0])
        base = device.first('base')
        ends = [base.attributes['frame']] if base is not None else [it for _, it in tops if it]
        if ends:
            add_inner_frames(device, frames, ends[0], self._names, self._forest)

    @staticmethod
    def _add_display(device: DraftDevice, topic: SeenTopic) -> None:
        display = _DISPLAYS.get(topic.type)
        if display is not None:
            device.add('rviz', {'type': display, 'topic': topic.name,
                                'name': topic.name.strip('/')})
