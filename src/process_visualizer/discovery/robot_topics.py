# SPDX-License-Identifier: BSD-3-Clause
"""Assignment of topics to robots: by joint names, frames, namespaces and words."""
from __future__ import annotations

import re
from dataclasses import dataclass
from typing import (
    Callable,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.discovery.draft import words
from process_visualizer.discovery.seen import FrameForest, SeenTopic
from process_visualizer.discovery.topic_groups import CAMERA_TYPES
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.tool_frame import tool_frame, tool_name_rank
from process_visualizer.ros_names import (
    FLOAT_ARRAY,
    NAMED_JOINTS,
    POSE_STAMPED,
    TF_MESSAGE,
    TF_TOPIC,
    WRENCH_STAMPED,
)


@dataclass(frozen=True)
class FoundModel:
    """A model: ``namespace`` of its description, such as ``/arm``; ``name`` as in the URDF.

    The model is the file ``path`` of the ``package``; without a package its text has to be written
    beside the configuration. ``arguments`` are for xacro; ``prefix`` is to be put before its link
    names. ``reason`` says how it was found. The driver puts the ``joint_prefix`` before joint
    names.
    """

    namespace: str
    name: str
    description: RobotDescription
    package: str = ''
    path: str = ''
    reason: str = ''
    arguments: Tuple[Tuple[str, str], ...] = ()
    prefix: str = ''
    joint_prefix: str = ''

    @property
    def joints(self) -> FrozenSet[str]:
        """The names of the model's movable joints, as its driver sends them."""
        return frozenset(self.joint_prefix + name for name in self.description.joints)


_NONE: FrozenSet[str] = frozenset()
_JOINT_WORDS = frozenset({'q', 'joint', 'joints', 'jnt', 'angles'})
_POSE_WORDS = frozenset({'tcf', 'tcp', 'pose', 'tool', 'ee', 'eef', 'flange', 'cartesian'})
_WRENCH_WORDS = frozenset({'ft', 'force', 'forces', 'wrench', 'torque'})
_NOT_MEASURED = frozenset({
    'goal', 'target', 'desired', 'command', 'commands', 'cmd', 'set', 'setpoint', 'equilibrium',
    'reference', 'ref', 'initialpose', 'waypoint', 'planned', 'des'})
_NOT_POSITIONS = frozenset({'vel', 'velocity', 'speed', 'qd', 'acc', 'effort', 'current', 'temp'})
_NAMESPACE_SCORE = _FRAME_SCORE = 10


@dataclass
class RobotGroup:
    """A robot and its topics; every robot has a ``joint_topic``.

    ``other_joint_topics`` have more joints of its model, such as those of its gripper.
    """

    namespace: str
    joint_topic: SeenTopic
    model: Optional[FoundModel] = None
    other_joint_topics: Tuple[SeenTopic, ...] = ()
    pose_topic: Optional[SeenTopic] = None
    wrench_topic: Optional[SeenTopic] = None

    @property
    def words(self) -> FrozenSet[str]:
        """Return the words that distinguish the robot from others."""
        name = self.model.name if self.model is not None else ''
        return words(self.namespace) | words(name) | words(self.joint_topic.name.rpartition('/')[0])

    @property
    def links(self) -> FrozenSet[str]:
        """The links of its model."""
        return frozenset(self.model.description.links) if self.model is not None else _NONE

    @property
    def topics(self) -> List[SeenTopic]:
        """The topics of the robot."""
        found = (self.joint_topic, *self.other_joint_topics, self.pose_topic, self.wrench_topic)
        return [it for it in found if it is not None]


def robot_groups(topics: Sequence[SeenTopic], models: Sequence[FoundModel]) -> List[RobotGroup]:
    """Return the robots: a model with its joint topic, and joint topics without a model."""
    joint_topics = [topic for topic in topics if is_joints(topic)]
    groups = [RobotGroup(model.namespace, topic, model) for model in models
              for topic in _best_joints(model, joint_topics, models)]
    groups += [RobotGroup(topic.name.rpartition('/')[0], topic)
               for topic in without_model(joint_topics, [it.model for it in groups if it.model],
                                          [it.joint_topic for it in groups])]
    for group in groups:
        group.other_joint_topics = _other_joints(group, groups, joint_topics)
    _assign(groups, topics, _is_pose, _set_pose)
    _assign(groups, topics, _is_wrench, _set_wrench)
    return groups


def _other_joints(group: RobotGroup, groups: Sequence[RobotGroup],
                  joint_topics: Sequence[SeenTopic]) -> Tuple[SeenTopic, ...]:
    """Return the topics with joints of the robot's model that none of its earlier topics has."""
    if group.model is None:
        return ()
    known, found = set(group.joint_topic.joints), []
    taken = [it.joint_topic for it in groups]
    for topic in parts_of(group.joint_topic, joint_topics):
        if topic not in taken and group.model.joints.issuperset(topic.joints) \
                and not known.intersection(topic.joints):
            found.append(topic)
            known.update(topic.joints)
    return tuple(found)


def parts_of(topic: SeenTopic, joint_topics: Sequence[SeenTopic]) -> List[SeenTopic]:
    """Return the topics below a topic's namespace that share no joints with the topic."""
    below = f'{_namespace(topic)}/'
    return [it for it in joint_topics if it.joints and topic.joints and it is not topic
            and it.name.startswith(below) and not set(it.joints) & set(topic.joints)]


def without_model(joint_topics: Sequence[SeenTopic], models: Sequence[FoundModel],
                  taken: Sequence[SeenTopic]) -> List[SeenTopic]:
    """Return the topics with joints that neither a model nor an earlier topic has.

    Args:
        joint_topics: topics with joints.
        models: the known models.
        taken: topics that belong to these models.
    """
    known = [_Known(it.joints, words(it.namespace)) for it in models]
    arrays = [words(_namespace(it)) for it in taken if not it.joints]
    found = []
    for topic in sorted(joint_topics, key=lambda it: (-len(it.joints), len(it.name), it.name)):
        own = _Known(frozenset(topic.joints), words(_namespace(topic)))
        is_known = _is_covered(own, known) if topic.joints else own.words in arrays
        if topic not in taken and not is_known:
            found.append(topic)
            if topic.joints:
                known.append(own)
            else:
                arrays.append(own.words)
    return found


class _Known(NamedTuple):
    """Joints that are already assigned, and the words of their namespace."""

    joints: FrozenSet[str]
    words: FrozenSet[str]


def _is_covered(own: _Known, known: Sequence[_Known]) -> bool:
    """Return whether all joints are known and not those of a twin robot in another namespace."""
    others = [it for it in known if it.joints & own.joints]
    is_twin = bool(own.words) and any(it.joints == own.joints for it in others) and all(
        it.words and it.words != own.words for it in others)
    return own.joints <= _NONE.union(*(it.joints for it in others)) and not is_twin


def _namespace(topic: SeenTopic) -> str:
    return topic.name.rpartition('/')[0]


def is_joints(topic: SeenTopic) -> bool:
    """Return whether a topic carries measured joint angles."""
    parts = _parts(topic.name)
    if parts & _NOT_MEASURED:
        return False
    if topic.type in NAMED_JOINTS:
        return bool(topic.joints)
    return (topic.type == FLOAT_ARRAY and bool(_last_parts(topic) & _JOINT_WORDS)
            and not parts & _NOT_POSITIONS and topic.length in (None, *range(2, 9)))


def _best_joints(model: FoundModel, topics: Sequence[SeenTopic],
                 models: Sequence[FoundModel]) -> List[SeenTopic]:
    """Return the topic that suits a model best, if there is one."""
    others = [it for it in models if it is not model and it.joints]
    own = _own_words(model, others)

    def rank(topic: SeenTopic) -> Tuple[int, int, int]:
        return (len(model.joints & set(topic.joints)), _affinity(model.namespace, own, topic),
                -len(topic.name))

    suitable = [topic for topic in topics if model.joints and (
        model.joints & set(topic.joints) if topic.type in NAMED_JOINTS
        else topic.length in (None, len(model.joints)) and (not others or rank(topic)[1] > 0))]
    return [max(suitable, key=rank)] if suitable else []


def _own_words(model: FoundModel, others: Sequence[FoundModel]) -> FrozenSet[str]:
    own = words(model.namespace) | words(model.name)
    return own - frozenset(
        word for other in others for word in words(other.namespace) | words(other.name))


def _affinity(namespace: str, own_words: FrozenSet[str], topic: SeenTopic) -> int:
    inside = bool(namespace.strip('/')) and topic.name.startswith(f'/{namespace.strip("/")}/')
    return len(own_words & words(topic.name)) + (_NAMESPACE_SCORE if inside else 0)


_Kind = Callable[[SeenTopic], bool]


def _assign(groups: Sequence[RobotGroup], topics: Sequence[SeenTopic], is_kind: _Kind,
            take: Callable[[RobotGroup, SeenTopic], None]) -> None:
    """Assign to each robot the topic of a kind that suits it better than any other robot."""
    candidates = [topic for topic in topics if is_kind(topic)]
    for group in groups:
        ranked = [(_score(group, topic, groups), -len(topic.name), topic.name, topic)
                  for topic in candidates if _owner(topic, groups) is group]
        if ranked:
            take(group, max(ranked, key=lambda it: it[:3])[3])


def _owner(topic: SeenTopic, groups: Sequence[RobotGroup]) -> Optional[RobotGroup]:
    """Return the robot that a topic suits best; None if it suits two equally, or none."""
    if len(groups) == 1:
        return groups[0]
    scores = [_score(group, topic, groups) for group in groups]
    best = max(scores)
    return groups[scores.index(best)] if best > 0 and scores.count(best) == 1 else None


def _score(group: RobotGroup, topic: SeenTopic, groups: Sequence[RobotGroup]) -> int:
    others = [it for it in groups if it is not group]
    own = group.words - _NONE.union(*(it.words for it in others))
    links = group.links - _NONE.union(*(it.links for it in others))
    link_words = _words_of(group.links) - _words_of(_NONE.union(*(it.links for it in others)))
    score = _affinity(group.namespace, own, topic)
    if links & set(topic.frames):
        return score + _FRAME_SCORE
    return score + len(link_words & _words_of(topic.frames))


def _words_of(frames: Iterable[str]) -> FrozenSet[str]:
    return _NONE.union(*(words(frame) for frame in frames))


def _is_pose(topic: SeenTopic) -> bool:
    if _parts(topic.name) & (_NOT_MEASURED | _NOT_POSITIONS):
        return False
    return topic.type == POSE_STAMPED or (
        topic.type == FLOAT_ARRAY and bool(_last_parts(topic) & _POSE_WORDS)
        and not _last_parts(topic) & _WRENCH_WORDS and topic.length in (None, 3, 6, 7))


def _is_wrench(topic: SeenTopic) -> bool:
    if _parts(topic.name) & _NOT_MEASURED:
        return False
    return topic.type == WRENCH_STAMPED or (
        topic.type == FLOAT_ARRAY and bool(_last_parts(topic) & _WRENCH_WORDS)
        and topic.length in (None, 3, 6))


def _set_pose(group: RobotGroup, topic: SeenTopic) -> None:
    group.pose_topic = topic


def _set_wrench(group: RobotGroup, topic: SeenTopic) -> None:
    group.wrench_topic = topic


def _parts(name: str) -> FrozenSet[str]:
    return frozenset(part.lower() for part in re.split('[/_.-]+', name))


def _last_parts(topic: SeenTopic) -> FrozenSet[str]:
    return _parts(topic.name.rpartition('/')[2])


# The tool frame of a robot on tf: many drivers send the tool's pose as a transform.

_CONTROLLER = '_controller'
"""Ending of a frame reported by the controller if the model has a frame of the same name."""
_NO_TOOL = re.compile(
    r'(^|[/_.-])(cam|camera|rgb|colou?r|depth|ir|infra|optical|lens|eye|image|imager|sensor|ft|'
    r'force|wrench|torque|imu|laser|lidar|scan|scanner|marker|tag|aruco|object|workpiece|'
    r'goal|target|desired|command|cmd|setpoint|reference|ref|planned)\d*([/_.-]|$)', re.IGNORECASE)
_SEEING = (*CAMERA_TYPES, 'sensor_msgs/LaserScan', 'sensor_msgs/Range')
_NOWHERE = Location('', 0)


def tool_link(model: FoundModel) -> str:
    """Return the link that the program uses as the tool."""
    return tool_frame(Device(DeviceType.ROBOT, 'robot', _NOWHERE), model.description).frame


class ToolTransform(NamedTuple):
    """A frame on tf that is a robot's tool, or only a guess unless ``is_sure``.

    ``chain`` is the frame and its ancestors, up to the first whose parent is a link.
    """

    frame: str
    chain: Tuple[str, ...]
    is_sure: bool
    comment: str = ''


@dataclass(frozen=True)
class _Candidate:
    """A frame below a ``link`` of the robot; ``rank`` is that of its name (``tool_name_rank``)."""

    chain: Tuple[str, ...]
    link: str
    moves: bool
    is_sent: bool  # repeatedly, as by a driver
    rank: Optional[int]

    @property
    def frame(self) -> str:
        return self.chain[0]

    @property
    def order(self) -> Tuple[bool, bool, bool, int]:
        """The sort key; the likeliest tool comes first."""
        return self.rank is None, not self.is_sent, not self.moves, self.rank or 0


class ToolTransforms:
    """Finds the robots' tools among the frames observed on tf."""

    def __init__(self, forest: FrameForest, models: Sequence[FoundModel], prefixes: Sequence[str],
                 topics: Sequence[SeenTopic]) -> None:
        """Initialize with all models, the prefixes of their links, and all topics."""
        self._forest, self._models, self._prefixes = forest, models, prefixes
        self._links = {prefix + link for model, prefix in zip(models, prefixes)
                       for link in model.description.links}
        self._names = self._links.union(*(model.description.links for model in models))
        self._seeing = {frame for topic in topics if topic.type in _SEEING
                        for frame in topic.frames}
        self._is_read = any(it.name == TF_TOPIC and it.type == TF_MESSAGE for it in topics)

    def of(self, model: Optional[FoundModel]) -> Optional[ToolTransform]:
        """Return the tool of the robot with this model, or None."""
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
                             'by its name: it did not move while it was observed')

    def _doubt(self, found: List[_Candidate], number: int) -> str:
        """Return why the first candidate is only a guess; '' if it is certain."""
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
        """Yield the frames that may be the tool of a robot, including guesses."""
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
        """Yield chains of frames below links, and the links; without sensors and the like."""
        for frame in sorted(self._forest.frames - self._names):
            path = self._forest.path(frame)
            end = next((i for i, it in enumerate(path) if it in self._links), None)
            if end is not None and path[end] in own \
                    and not any(map(self._is_no_tool, path[:end])):
                yield tuple(path[:end]), path[end]

    def _is_no_tool(self, frame: str) -> bool:
        return frame in self._seeing or bool(_NO_TOOL.search(frame))

    def _may_be_tool(self, it: _Candidate, arm_moves: bool) -> bool:
        if it.rank is None:  # only the last frame of a chain sent by a driver
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
