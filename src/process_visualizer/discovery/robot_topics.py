# SPDX-License-Identifier: BSD-3-Clause
"""Assignment of topics to robots: by names of joints, frames, namespaces, and by words."""
from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Callable, FrozenSet, Iterable, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.discovery.evidence.seen import SeenTopic
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.names import words
from process_visualizer.ros_names import FLOAT_ARRAY, JOINT_STATE, POSE_STAMPED, WRENCH_STAMPED

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
    """A robot and its topics; ``joint_topic`` is there, or else there is no robot.

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
        """Return what tells it from others."""
        name = self.model.name if self.model is not None else ''
        return words(self.namespace) | words(name) | words(self.joint_topic.name.rpartition('/')[0])

    @property
    def links(self) -> FrozenSet[str]:
        """The links of its model."""
        return frozenset(self.model.description.links) if self.model is not None else _NONE

    @property
    def topics(self) -> List[SeenTopic]:
        """All of its topics."""
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
    """The topics with joints of the robot's model that none of its topics before them has."""
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
    """Return the topics below a topic's namespace with joints that it does not have."""
    below = f'{_namespace(topic)}/'
    return [it for it in joint_topics if it.joints and topic.joints and it is not topic
            and it.name.startswith(below) and not set(it.joints) & set(topic.joints)]


def without_model(joint_topics: Sequence[SeenTopic], models: Sequence[FoundModel],
                  taken: Sequence[SeenTopic]) -> List[SeenTopic]:
    """Return the topics with joints that no model has, and that none before them has.

    Args:
        joint_topics: with joints.
        models: those that are known.
        taken: topics that belong to these.
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
    """Joints that are spoken for, and the words of the namespace in which they are."""

    joints: FrozenSet[str]
    words: FrozenSet[str]


def _is_covered(own: _Known, known: Sequence[_Known]) -> bool:
    """Return whether all of the joints are known, and not those of a twin in another namespace."""
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
    if topic.type == JOINT_STATE:
        return bool(topic.joints)
    return (topic.type == FLOAT_ARRAY and bool(_last_parts(topic) & _JOINT_WORDS)
            and not parts & _NOT_POSITIONS and topic.length in (None, *range(2, 9)))


def _best_joints(model: FoundModel, topics: Sequence[SeenTopic],
                 models: Sequence[FoundModel]) -> List[SeenTopic]:
    """The topic that suits a model best, if there is one."""
    others = [it for it in models if it is not model and it.joints]
    own = _own_words(model, others)

    def rank(topic: SeenTopic) -> Tuple[int, int, int]:
        return (len(model.joints & set(topic.joints)), _affinity(model.namespace, own, topic),
                -len(topic.name))

    suitable = [topic for topic in topics if model.joints and (
        model.joints & set(topic.joints) if topic.type == JOINT_STATE
        else topic.length in (None, len(model.joints)) and (not others or rank(topic)[1] > 0))]
    return [max(suitable, key=rank)] if suitable else []


def _own_words(model: FoundModel, others: Sequence[FoundModel]) -> FrozenSet[str]:
    own = words(model.namespace) | words(model.name)
    return own - frozenset(word for it in others for word in words(it.namespace) | words(it.name))


def _affinity(namespace: str, own_words: FrozenSet[str], topic: SeenTopic) -> int:
    inside = bool(namespace.strip('/')) and topic.name.startswith(f'/{namespace.strip("/")}/')
    return len(own_words & words(topic.name)) + (_NAMESPACE_SCORE if inside else 0)


_Kind = Callable[[SeenTopic], bool]


def _assign(groups: Sequence[RobotGroup], topics: Sequence[SeenTopic], is_kind: _Kind,
            take: Callable[[RobotGroup, SeenTopic], None]) -> None:
    """Give each robot the topic of a kind that suits it better than any other robot."""
    candidates = [topic for topic in topics if is_kind(topic)]
    for group in groups:
        ranked = [(_score(group, topic, groups), -len(topic.name), topic.name, topic)
                  for topic in candidates if _owner(topic, groups) is group]
        if ranked:
            take(group, max(ranked, key=lambda it: it[:3])[3])


def _owner(topic: SeenTopic, groups: Sequence[RobotGroup]) -> Optional[RobotGroup]:
    """The robot that a topic suits best; nobody where two suit alike, or none does."""
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
