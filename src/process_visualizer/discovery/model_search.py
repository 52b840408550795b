# SPDX-License-Identifier: BSD-3-Clause
"""Finds the models of what was seen: the file of a package, or the description itself."""
from __future__ import annotations

import os
import re
import tempfile
from collections import Counter
from dataclasses import replace
from typing import Dict, Iterator, List, Optional, Sequence, Set, Tuple
from xml.etree import ElementTree

from process_visualizer.descriptions.robot_description import (
    ModelError,
    RobotDescription,
    load_robot_description,
)
from process_visualizer.discovery.evidence.moving_frames import Motion
from process_visualizer.discovery.evidence.own_topics import device_topics
from process_visualizer.discovery.evidence.seen import Seen, SeenDescription, SeenTopic
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.model_evidence import ModelEvidence
from process_visualizer.discovery.model_files import ModelFile, ModelFiles
from process_visualizer.discovery.names import words
from process_visualizer.discovery.robot_topics import (
    is_joints,
    parts_of,
    robot_groups,
    without_model,
)

_MOST_TRIES = 24
"""Files that are expanded for one robot."""
_FEWEST_JOINTS = 3
"""That a topic and a model have in common, unless the model has fewer; what else is on the topic
may be a gripper or a track."""
_DIGITS = 5
_HANDS = ('hand', 'gripper')
_PREFIX, _NUMBER = re.compile('prefix$'), re.compile('[0-9]+')
_Arguments = Tuple[Tuple[str, str], ...]


class ModelSearch:
    """Finds models; what cannot be used is told by ``remarks``."""

    def __init__(self, files: Optional[ModelFiles] = None, motions: Sequence[Motion] = ()) -> None:
        """Take the files of the packages, and what a recording has of frames that move."""
        self._files = files or ModelFiles()
        self._motions = motions
        self._expanded: Dict[Tuple[str, _Arguments],
                             Optional[RobotDescription]] = {}
        self.remarks: List[str] = []

    def find(self, seen: Seen, known: Sequence[FoundModel] = ()) -> List[FoundModel]:
        """Return the models of the descriptions, then those for joints that none of these has.

        Those that are ``known`` already come first.
        """
        models = [*known, *(model for it in seen.descriptions
                            for model in self._of_description(it))]
        joint_topics = [it for it in device_topics(seen.topics) if is_joints(it)]
        frames = {name for it in seen.transforms for name in (it.parent, it.child)}
        taken = [group.joint_topic for group in robot_groups(joint_topics, models) if group.model]
        evidence = ModelEvidence(seen, self._motions)
        for topic in without_model(joint_topics, models, taken):
            if not topic.joints or not _joints_of(models).issuperset(topic.joints):
                models += (self._for_parts(topic, joint_topics, frames, evidence)
                           or self._for_topic(topic, frames, evidence))
        return models

    def _for_parts(self, topic: SeenTopic, joint_topics: Sequence[SeenTopic], frames: Set[str],
                   evidence: ModelEvidence) -> List[FoundModel]:
        """Models for the joints of an arm and of others below its namespace, such as its gripper.

        None if these are no joints of the same models.
        """
        parts = parts_of(topic, joint_topics)
        more = {joint for it in parts for joint in it.joints}
        if not more:
            return []
        whole = replace(topic, joints=(*topic.joints, *sorted(more)))
        models = self._for_topic(whole, frames, evidence)
        return models if _joints_of(models) & more else []

    def _for_topic(self, topic: SeenTopic, frames: Set[str],
                   evidence: ModelEvidence) -> List[FoundModel]:
        """Models for a topic with joints: several where it has those of several robots.

        Together they have most of its joints.
        """
        models: List[FoundModel] = []
        rest = topic
        while len(rest.joints) >= _FEWEST_JOINTS or not models:
            model = self._for_joints(rest, evidence, list(self._fitting(rest, frames)))
            if model is None:
                break
            models.append(model)
            rest = replace(rest, joints=tuple(it for it in rest.joints if it not in model.joints))
        return models if 2 * len(rest.joints) < len(topic.joints) or not topic.joints else []

    def _of_description(self, seen: SeenDescription) -> List[FoundModel]:
        try:
            description = _loaded(seen.text)
        except ModelError as error:
            self.remarks.append(f'The description {seen.namespace}/robot_description cannot be '
                                f'used: {error}')
            return []
        name = ElementTree.fromstring(seen.text).get('name', '')
        for file in self._named(name, description):
            for arguments in ((), *_with_hand(file)):
                found = self._expand(file, arguments)
                if found is not None and _same(found.text, description.text):
                    return [FoundModel(seen.namespace, name, found, file.package, file.path,
                                       arguments=arguments)]
        return [FoundModel(seen.namespace, name, description,
                           reason=f'{seen.namespace}/robot_description as it was seen')]

    def _named(self, name: str, description: RobotDescription) -> List[ModelFile]:
        """Files that may be the description of that name, the likeliest first."""
        joints = list(description.joints)
        named = [it for it in self._files.all() if it.name == name]
        others = [it for it in self._files.all() if it.name != name and joints
                  and self._files.count_of(it.package, joints) == len(joints)]
        others.sort(key=lambda it: -len(words(it.stem) & words(name)))
        return [*named, *others][:_MOST_TRIES]

    @staticmethod
    def _for_joints(topic: SeenTopic, evidence: ModelEvidence,
                    fitting: Sequence[FoundModel]) -> Optional[FoundModel]:
        """The model with the most joints of a topic, which nobody has described: not its hand.

        Of those the one with the fewest others.
        """
        if not fitting:
            return None
        most = max(_rank(it, topic) for it in fitting)
        best: List[FoundModel] = []
        for model in fitting:
            if _rank(model, topic) == most \
                    and not any(_same(model.description.text, it.description.text) for it in best):
                best.append(model)
        if len(best) == 1:
            return best[0]
        choice = evidence.choose(topic, best)
        return replace(best[choice.number], reason=choice.reason)

    def _fitting(self, topic: SeenTopic, frames: Set[str]) -> Iterator[FoundModel]:
        """The models that suit the joints of a topic, from the likeliest files."""
        reason = 'the names of its joints' if topic.joints else \
            'its name and the number of its joints'
        for file in self._likely(topic)[:_MOST_TRIES]:
            fitting = [it for it in self._variants(file, topic) if _fits(it, topic, frames)]
            if fitting:
                best = max(fitting, key=lambda it: _rank(it, topic))
                yield replace(best, reason=f'found by {reason}: is it the one?')

    def _variants(self, file: ModelFile, topic: SeenTopic) -> Iterator[FoundModel]:
        """A file with different arguments, and with the prefix that its driver may have."""
        for arguments in self._arguments(file, topic):
            found = self._expand(file, arguments)
            if found is not None:
                model = FoundModel(topic.name.rpartition('/')[0], file.name, found, file.package,
                                   file.path, arguments=arguments)
                yield model
                prefix = _common_prefix(found, topic)
                if prefix and not _has_siblings(found, topic, prefix):
                    yield replace(model, prefix=prefix, joint_prefix=prefix)

    def _likely(self, topic: SeenTopic) -> List[ModelFile]:
        namespace = topic.name.rpartition('/')[0]
        own = words(namespace)
        likely = [it for it in self._files.all()
                  if own & words(it.stem) or own & words(it.name) or topic.joints]
        likely.sort(key=lambda it: -len(own & (words(it.stem) | words(it.name))))
        if not topic.joints:
            return [it for it in likely if namespace.rpartition('/')[2] in (it.stem, it.name)]
        counts = {it.package: self._files.count_of(it.package, topic.joints) for it in likely}
        least = min(_FEWEST_JOINTS, (len(topic.joints) + 1) // 2)
        return sorted((it for it in likely if counts[it.package] >= least),
                      key=lambda it: -counts[it.package])

    def _arguments(self, file: ModelFile, topic: SeenTopic) -> List[_Arguments]:
        """Return what to try: with a hand if there are more joints, with a common prefix, bare."""
        bare = self._expand(file)
        if bare is None or not topic.joints:
            return [()]
        prefix = _common_prefix(bare, topic)
        prefixes: List[_Arguments] = [((name, prefix),) for name in file.arguments
                                      if prefix and _PREFIX.search(name)] or [()]
        hands = _with_hand(file) if len(topic.joints) > len(bare.joints) else []
        return [(*first, *second) for first in prefixes for second in (*hands, ())]

    def _expand(self, file: ModelFile,
                arguments: _Arguments = ()) -> Optional[RobotDescription]:
        key = (file.file, arguments)
        if key not in self._expanded:
            try:
                self._expanded[key] = load_robot_description(file.file, arguments)
            except ModelError:
                self._expanded[key] = None  # it needs other arguments, or is no whole robot
        return self._expanded[key]


def _joints_of(models: Sequence[FoundModel]) -> Set[str]:
    return {joint for it in models for joint in it.joints}


def _with_hand(file: ModelFile) -> List[_Arguments]:
    return [((name, 'true'),) for name in file.arguments if name in _HANDS]


def _loaded(text: str) -> RobotDescription:
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        path = os.path.join(folder, 'robot_description.urdf')
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
        return load_robot_description(path)


def _fits(model: FoundModel, topic: SeenTopic, frames: Set[str]) -> bool:
    """Return whether most joints of a model are on a topic, or an array has as many numbers."""
    joints = model.joints
    if topic.joints:
        common = len(joints & set(topic.joints))
        return common >= min(_FEWEST_JOINTS, max(len(joints), 1)) and 2 * common > len(joints)
    return len(joints) == topic.length or (topic.length is None and bool(
        frames & set(model.description.links)))


def _rank(model: FoundModel, topic: SeenTopic) -> Tuple[int, int]:
    """Return a model's rank for a topic: by the joints of both, then by the model's extra ones."""
    seen = set(topic.joints)
    return len(model.joints & seen), -len(model.joints - seen)


def _common_prefix(description: RobotDescription, topic: SeenTopic) -> str:
    """Return the prefix of most joints of a model in a topic; '' if there is none."""
    prefixes = Counter(joint[:-len(name)] for name in description.joints for joint in topic.joints
                       if joint.endswith(name))
    prefix, count = max(prefixes.items(), key=lambda it: it[1], default=('', 0))
    return prefix if 2 * count > len(description.joints) else ''


def _has_siblings(description: RobotDescription, topic: SeenTopic, prefix: str) -> bool:
    """Return whether there are more numbered joints than the model has: another model's."""
    kinds = {_NUMBER.sub('#', name) for name in description.joints}
    others = (it[len(prefix):] for it in topic.joints if it.startswith(prefix))
    return any(it not in description.joints and _NUMBER.sub('#', it) in kinds for it in others)


_Shape = Tuple[Tuple[object, ...], ...]


def _same(text: str, other: str) -> bool:
    """Return whether two descriptions have the same joints at the same places."""
    return _shape(text) == _shape(other)


def _shape(text: str) -> _Shape:
    root = ElementTree.fromstring(text)
    return tuple(sorted(_joint_shape(joint) for joint in root.findall('joint')))


def _joint_shape(joint: ElementTree.Element) -> Tuple[object, ...]:
    parent, child, origin = (joint.find(tag) for tag in ('parent', 'child', 'origin'))
    return (joint.get('name', ''), joint.get('type', ''),
            '' if parent is None else parent.get('link', ''),
            '' if child is None else child.get('link', ''),
            *(_numbers(origin, name) for name in ('xyz', 'rpy')))


def _numbers(origin: Optional[ElementTree.Element], name: str) -> Tuple[float, ...]:
    text = '0 0 0' if origin is None else origin.get(name, '0 0 0')
    return tuple(round(float(word), _DIGITS) + 0.0 for word in text.split())
