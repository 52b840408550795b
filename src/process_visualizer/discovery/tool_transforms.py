# SPDX-License-Identifier: BSD-3-Clause
"""The frame on tf that is a robot's tool: many drivers send its pose there, as a transform."""
from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Iterable, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.descriptions.tool_frame import tool_frame, tool_name_rank
from process_visualizer.discovery.evidence.camera_groups import CAMERA_TYPES
from process_visualizer.discovery.evidence.frame_forest import FrameForest
from process_visualizer.discovery.evidence.seen import SeenTopic
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.motion.kinematics import Kinematics
from process_visualizer.ros_names import TF_MESSAGE, TF_TOPIC

_CONTROLLER = '_controller'
"""How a frame ends that the controller reports, where the model has one of the same name."""
_NO_TOOL = re.compile(
    r'(^|[/_.-])(cam|camera|rgb|colou?r|depth|ir|infra|optical|lens|eye|image|imager|sensor|ft|'
    r'force|wrench|torque|imu|laser|lidar|scan|scanner|marker|tag|aruco|object|workpiece|'
    r'goal|target|desired|command|cmd|setpoint|reference|ref|planned)\d*([/_.-]|$)', re.IGNORECASE)
_SEEING = (*CAMERA_TYPES, 'sensor_msgs/LaserScan', 'sensor_msgs/Range')
_NOWHERE = Location('', 0)


def tool_link(model: FoundModel) -> str:
    """Return the link that the program takes for the tool."""
    return tool_frame(Device(DeviceType.ROBOT, 'robot', _NOWHERE), model.description).frame


class ToolTransform(NamedTuple):
    """A frame on tf that is a robot's tool, or may be: then it is not ``is_sure``.

    ``chain`` is that frame and those that carry it, up to the first that a link carries.
    """

    frame: str
    chain: Tuple[str, ...]
    is_sure: bool
    comment: str = ''


@dataclass(frozen=True)
class _Candidate:
    """A frame behind a ``link`` of the robot; ``rank`` of its name as of ``tool_name_rank``."""

    chain: Tuple[str, ...]
    link: str
    moves: bool
    is_sent: bool  # again and again, as a driver does
    rank: Optional[int]

    @property
    def frame(self) -> str:
        return self.chain[0]

    @property
    def order(self) -> Tuple[bool, bool, bool, int]:
        """The least is the likeliest tool."""
        return self.rank is None, not self.is_sent, not self.moves, self.rank or 0


class ToolTransforms:
    """Finds the robots' tools among what was seen on tf."""

    def __init__(self, forest: FrameForest, models: Sequence[FoundModel], prefixes: Sequence[str],
                 topics: Sequence[SeenTopic]) -> None:
        """Take all models with the prefixes of their links, and all topics."""
        self._forest, self._models, self._prefixes = forest, models, prefixes
        self._links = {prefix + link for model, prefix in zip(models, prefixes)
                       for link in model.description.links}
        self._names = self._links.union(*(model.description.links for model in models))
        self._seeing = {frame for it in topics if it.type in _SEEING for frame in it.frames}
        self._is_read = any(it.name == TF_TOPIC and it.type == TF_MESSAGE for it in topics)

    def of(self, model: Optional[FoundModel]) -> Optional[ToolTransform]:
        """Return the tool of the robot with a model, or None."""
        number = next((i for i, it in enumerate(self._models) if it is model), None)
        if number is None or not self._is_read:
            return None
        found = sorted(self._candidates(number), key=lambda it: (it.order, it.frame))
        return self._judged(found, number) if found else None

    def _judged(self, found: List[_Candidate], number: int) -> ToolTransform:
        best = found[0]
        comment = self._doubt(found, number)
        if comment:
            return ToolTransform(best.frame, best.chain, False, f'a guess: {comment}')
        return ToolTransform(best.frame, best.chain, True, '' if best.moves else
                             'by its name: it did not move while it was looked at')

    def _doubt(self, found: List[_Candidate], number: int) -> str:
        """Return why the first is only a guess; '' if it is none."""
        best = found[0]
        if best.rank is None:
            return f'is this frame its tool? It moves in tf, behind {best.link}'
        if not best.is_sent:
            return f'is this frame its tool? It is fixed to {best.link}'
        if any(best.link in it.description.links for i, it in enumerate(self._models)
               if i != number):
            return f'several models have the link {best.link}; whose tool is this frame?'
        equal = [it.frame for it in found if it.order == best.order]
        return f'which of {" and ".join(equal)} is its tool?' if len(equal) > 1 else ''

    def _candidates(self, number: int) -> Iterator[_Candidate]:
        """The frames that may be the tool of a robot, guesses too."""
        model, prefix = self._models[number], self._prefixes[number]
        description = model.description
        kinematics = Kinematics(description.text)
        end = tool_link(model)
        arm_moves = self._has_moved([prefix + it for it in (end, *description.ancestors(end))])
        for chain, link in self._chains({prefix + it for it in description.links}):
            moves = self._has_moved(chain) or kinematics.moves(link[len(prefix):],
                                                               description.root_link)
            it = _Candidate(chain, link, moves, self._is_sent(chain), _rank(chain[0]))
            if self._may_be_tool(it, arm_moves):
                yield it

    def _chains(self, own: Set[str]) -> Iterator[Tuple[Tuple[str, ...], str]]:
        """Frames behind links with those between, unless what carries them is a sensor or so."""
        for frame in sorted(self._forest.frames - self._names):
            path = self._forest.path(frame)
            end = next((i for i, it in enumerate(path) if it in self._links), None)
            if end is not None and path[end] in own \
                    and not any(map(self._is_no_tool, path[:end])):
                yield tuple(path[:end]), path[end]

    def _is_no_tool(self, frame: str) -> bool:
        return frame in self._seeing or bool(_NO_TOOL.search(frame))

    def _may_be_tool(self, it: _Candidate, arm_moves: bool) -> bool:
        if it.rank is None:  # the end of what a driver sends, if anything
            return it.is_sent and it.moves and not self._forest.children(it.frame)
        return it.moves or (it.is_sent and not arm_moves)

    def _is_sent(self, chain: Sequence[str]) -> bool:
        return any(self._forest.transform(it).topic == TF_TOPIC for it in chain)

    def _has_moved(self, frames: Iterable[str]) -> bool:
        return any(self._forest.transform(it).changes for it in frames
                   if self._forest.parent(it) is not None)


def _rank(frame: str) -> Optional[int]:
    is_reported = frame.lower().endswith(_CONTROLLER)
    return tool_name_rank(frame[:-len(_CONTROLLER)] if is_reported else frame)
