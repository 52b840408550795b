# SPDX-License-Identifier: BSD-3-Clause
"""Search for the models of observed robots: a file in a package, or the description itself."""
from __future__ import annotations

import os
import re
import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from itertools import chain
from typing import (
    Collection,
    Dict,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Pattern,
    Sequence,
    Set,
    Tuple,
)
from xml.etree import ElementTree

import numpy as np
import rospkg

from process_visualizer.discovery.draft import words
from process_visualizer.discovery.moving_frames import FrameMotion
from process_visualizer.discovery.robot_topics import (
    FoundModel,
    is_joints,
    parts_of,
    robot_groups,
    without_model,
)
from process_visualizer.discovery.seen import Seen, SeenDescription, SeenTopic, SeenTransform
from process_visualizer.discovery.topic_groups import device_topics
from process_visualizer.robot.description import (
    ModelError,
    RobotDescription,
    load_robot_description,
)
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.tool_learning import rigid_residuals

# The model files of all packages; a robot's file is found by its name or its joints.

_ROBOT = re.compile(r'<robot\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_JOINT = re.compile(r'<joint\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_ARGUMENT = re.compile(r'<xacro:arg\b[^>]*?\bname\s*=\s*["\']([^"\']*)["\']')
_EXPRESSION = re.compile(r'\$\{[^}]*\}|\$\([^)]*\)')
_ENDINGS = ('.urdf', '.xacro')
_DEEPEST, _MAX_BYTES = 4, 2 << 20
_NO_MODELS = ('test', 'tests', 'bench', 'build')
_SAFE_PATH = re.compile(r'[\w. /+-]+\Z')


@dataclass(frozen=True)
class ModelFile:
    """A URDF or xacro file that may be a whole robot; ``name`` is from its <robot>.

    ``arguments`` are the names of its xacro arguments.
    """

    package: str
    path: str
    name: str
    folder: str
    arguments: Tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """The absolute path of the file."""
        return os.path.join(self.folder, self.path)

    @property
    def stem(self) -> str:
        """The name of the file without its endings."""
        return os.path.basename(self.path).partition('.')[0]


class ModelFiles:
    """The model files of the packages that ROS finds; each package is searched once."""

    def __init__(self, packages: Optional[rospkg.RosPack] = None) -> None:
        self._packages = packages or rospkg.RosPack()
        self._files: Optional[List[ModelFile]] = None
        self._joints: Dict[str, List[Pattern[str]]] = {}

    def all(self) -> List[ModelFile]:
        """Return the files of all packages, sorted by package name."""
        if self._files is None:
            self._files = [file for package in sorted(self._packages.list())
                           for file in self._look_into(package)]
        return self._files

    def count_of(self, package: str, joints: Collection[str]) -> int:
        """Return the number of these joints that match joint names in the files of a package."""
        patterns = self._joints.get(package, [])
        return sum(any(pattern.fullmatch(joint) for pattern in patterns) for joint in joints)

    def _look_into(self, package: str) -> Iterator[ModelFile]:
        folder = str(self._packages.get_path(package))
        for path in _model_paths(folder):
            text = _text(os.path.join(folder, path))
            self._joints.setdefault(package, []).extend(_patterns(text))
            robot = _ROBOT.search(text)
            # a name with an expression needs arguments that only a launch file knows
            if robot is not None and '$' not in robot.group(1) and _SAFE_PATH.match(path):
                arguments = tuple(dict.fromkeys(_ARGUMENT.findall(text)))
                yield ModelFile(package, path, robot.group(1), folder, arguments)


def _patterns(text: str) -> List[Pattern[str]]:
    """Return patterns of a file's joint names, with any prefix, and any text for an expression."""
    names = {_EXPRESSION.sub('*', name) for name in _JOINT.findall(text)}
    return [re.compile('.*' + '.*'.join(map(re.escape, name.split('*'))))
            for name in sorted(names)]


def _model_paths(folder: str) -> Iterator[str]:
    for top, folders, names in os.walk(folder):
        below = os.path.relpath(top, folder)
        is_deep = below.count(os.sep) + 1 >= _DEEPEST
        folders[:] = [] if is_deep else sorted(
            it for it in folders if not it.startswith('.') and it not in _NO_MODELS
            and not os.path.isfile(os.path.join(top, it, 'package.xml')))
        for name in sorted(names):
            if name.endswith(_ENDINGS):
                yield os.path.normpath(os.path.join(below, name))


def _text(file: str) -> str:
    """Return the text of a file, '' if it cannot be read."""
    try:
        with open(file, encoding='utf-8', errors='replace') as stream:
            return stream.read(_MAX_BYTES)
    except OSError:
        return ''


_MIN_LENGTHS = 3  # many models share one or two lengths, such as base and flange
_KEEP_DISTANCE = ('revolute', 'continuous')


class ModelFit:
    """Fit of a model to the observations; distances are RMS values in m, None if not comparable."""

    def __init__(self, model: FoundModel) -> None:
        self._description, self._prefix = model.description, model.joint_prefix
        self._kinematics = Kinematics(model.description.text)

    def lengths_m(self, transforms: Sequence[SeenTransform]) -> Optional[float]:
        """Return the distance between link positions on tf and in the model, each in its parent."""
        zeros = {name: 0.0 for name, kind in self._description.joints.items()
                 if kind in _KEEP_DISTANCE}
        away = []
        for it in transforms:
            child, parent = self._own(it.child), self._own(it.parent)
            if self._description.parents.get(child) == parent:
                place = self._kinematics.placement(child, parent, zeros)
                if place is not None:
                    away.append(np.subtract(place.position, it.placement.position))
        return _rms(np.array(away)) if len(away) >= _MIN_LENGTHS else None

    def tool_m(self, motion: FrameMotion) -> Optional[float]:
        """Return the distance between a moving frame and the moving link closest to it."""
        bases = self._places(motion.parent, motion)
        if not bases:
            return None
        reported = np.array([base.then(sample.place).position
                             for base, sample in zip(bases, motion.samples)])
        return min((_rms(np.array([place.position for place in places]) - reported)
                    for places in self._moving(motion).values()), default=None)

    def free_tool_m(self, motion: FrameMotion) -> Optional[float]:
        """Return ``tool_m`` with a free base pose or a free constant offset of tool to link."""
        moving = self._moving(motion).values()
        tools = np.array([sample.place.position for sample in motion.samples])
        residuals = [rigid_residuals(np.array([place.position for place in places]), tools)
                     for places in moving]
        bases = self._places(motion.parent, motion)
        if bases:
            reported = [base.then(sample.place) for base, sample in zip(bases, motion.samples)]
            residuals += [_offset_residuals(places, reported) for places in moving]
        return min(map(_rms, residuals), default=None)

    def _moving(self, motion: FrameMotion) -> Dict[str, List[Placement]]:
        """Return the poses in the root link of all links that move relative to it."""
        found = {link: self._places(link, motion) for link in self._description.links
                 if self._kinematics.moves(link, self._description.root_link)}
        return {link: places for link, places in found.items() if places}

    def _places(self, frame: str, motion: FrameMotion) -> List[Placement]:
        """Return a frame's poses in the root link, one per sample; empty if one is unknown."""
        places = [self._kinematics.connection(
            self._own(frame), self._description.root_link,
            {self._own(name): position for name, position in sample.positions.items()})
            for sample in motion.samples]
        return [place for place in places if place is not None] if None not in places else []

    def _own(self, name: str) -> str:
        """Return a link or joint name without the prefix that the driver adds."""
        return name[len(self._prefix):] if name.startswith(self._prefix) else name


def _offset_residuals(places: Sequence[Placement], reported: Sequence[Placement]) -> np.ndarray:
    """Return the residuals of reported positions at the best constant offset from a moving link."""
    offsets = np.array([place.inverse().then(it).position
                        for place, it in zip(places, reported)])
    residuals: np.ndarray = offsets - offsets.mean(axis=0)
    return residuals


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=1))))


# Choice among several models with the same joints: by lengths, motion and observed names.

_FIT_M = 0.01  # maximum residual; large enough for an uncalibrated arm
_NOISE_M = 0.002
_CLEAR = 3.0  # minimum ratio of the next model's residual to the best


class ModelChoice(NamedTuple):
    """The number of the chosen model, and the reason."""

    number: int
    reason: str


class ModelEvidence:
    """Observations that may distinguish models."""

    def __init__(self, seen: Seen, motions: Sequence[FrameMotion] = ()) -> None:
        """Initialize with all observations, and the moving frames of a recording."""
        self._seen, self._motions = seen, motions

    def choose(self, topic: SeenTopic, models: Sequence[FoundModel]) -> ModelChoice:
        """Return the choice among models that all have the joints of a topic."""
        fits = [ModelFit(it) for it in models]
        lengths = [it.lengths_m(self._seen.transforms) for it in fits]
        return (_decided(models, lengths, 'its links are as far apart as on tf')
                or self._by_motion(topic, models, fits) or self._by_names(topic, models)
                or ModelChoice(0, f'nothing observed distinguishes it from {_files(models[1:])}, '
                               'which have the same joints: is this the right model?'))

    def _by_motion(self, topic: SeenTopic, models: Sequence[FoundModel],
                   fits: Sequence[ModelFit]) -> Optional[ModelChoice]:
        """Compare motions: first of the frame and a link, then with a free base or tool offset."""
        motions = [motion for motion in self._motions if motion.joint_topic == topic.name]
        exact = ((motion, [fit.tool_m(motion) for fit in fits], '') for motion in motions)
        free = ((motion, [fit.free_tool_m(motion) for fit in fits], ', up to a constant offset')
                for motion in motions)
        choices = (_decided(models, misfits, f'its joints bring it to {motion.name}{more}')
                   for motion, misfits, more in chain(exact, free))
        return next((choice for choice in choices if choice is not None), None)

    def _by_names(self, topic: SeenTopic, models: Sequence[FoundModel]) -> Optional[ModelChoice]:
        """Choose the only model whose name was observed; names near the topic are tried first."""
        names = [words(model.path.rpartition('/')[2].partition('.')[0]) | words(model.name)
                 for model in models]
        common = frozenset.intersection(*names)
        for seen in self._words(topic):
            named = [i for i, own in enumerate(names) if (own - common) & seen]
            if len(named) == 1:
                word = sorted((names[named[0]] - common) & seen)[0]
                others = _files([it for it in models if it is not models[named[0]]])
                return ModelChoice(
                    named[0],
                    f'"{word}" is in the names that were seen; {others} have '
                    'the same joints: is this the right model?',
                )
        return None

    def _words(self, topic: SeenTopic) -> Iterable[FrozenSet[str]]:
        yield _all_words((topic.name, *topic.publishers, *topic.frames))
        yield _all_words(name for other in self._seen.topics
                         for name in (other.name, *other.publishers, *other.frames))
        yield _all_words(name for transform in self._seen.transforms
                         for name in (transform.parent, transform.child))
        yield words(self._seen.where.replace(' ', '_'))


def _all_words(names: Iterable[str]) -> FrozenSet[str]:
    return frozenset().union(*map(words, names))


def _files(models: Sequence[FoundModel]) -> str:
    """Return the files of models in words, each once."""
    names = list(dict.fromkeys(map(_file, models)))
    return ' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _file(model: FoundModel) -> str:
    return model.path.rpartition('/')[2]


def _decided(models: Sequence[FoundModel], misfits: Sequence[Optional[float]],
             reason: str) -> Optional[ModelChoice]:
    """Return the model that fits, if it fits clearly better than all others."""
    known = sorted((misfit, number) for number, misfit in enumerate(misfits) if misfit is not None)
    if not known or known[0][0] > _FIT_M:
        return None
    best, number = known[0]
    if any(misfit < _CLEAR * max(best, _NOISE_M) for misfit, _ in known[1:]):
        return None
    others = ', '.join(f'{_file(models[i])} {_millimeters(misfit)}' for misfit, i in known[1:])
    why = f'chosen of those with the same joints, as {reason}: {_millimeters(best)} off'
    return ModelChoice(number, f'{why}; the others: {others}' if others else why)


def _millimeters(distance_m: float) -> str:
    return f'{1e3 * distance_m:.1f} mm'


_MAX_TRIES = 24
"""Maximum number of files expanded for one robot."""
_MIN_JOINTS = 3
"""Minimum number of joints that a topic and a model share, unless the model has fewer.

Other joints on the topic may be those of a gripper or a track.
"""
_DIGITS = 5
_HANDS = ('hand', 'gripper')
_PREFIX, _NUMBER = re.compile('prefix$'), re.compile('[0-9]+')
_Arguments = Tuple[Tuple[str, str], ...]


class ModelSearch:
    """Finds models; ``remarks`` report descriptions that cannot be used."""

    def __init__(
        self, files: Optional[ModelFiles] = None, motions: Sequence[FrameMotion] = ()
    ) -> None:
        """Initialize with the files of the packages, and the moving frames of a recording."""
        self._files = files or ModelFiles()
        self._motions = motions
        self._expanded: Dict[Tuple[str, _Arguments],
                             Optional[RobotDescription]] = {}
        self.remarks: List[str] = []

    def find(self, seen: Seen, known: Sequence[FoundModel] = ()) -> List[FoundModel]:
        """Return the ``known`` models, those of the descriptions, and those for other joints."""
        models = [*known, *(model for description in seen.descriptions
                            for model in self._of_description(description))]
        joint_topics = [it for it in device_topics(seen.topics) if is_joints(it)]
        frames = {name for transform in seen.transforms
                  for name in (transform.parent, transform.child)}
        taken = [group.joint_topic for group in robot_groups(joint_topics, models) if group.model]
        evidence = ModelEvidence(seen, self._motions)
        for topic in without_model(joint_topics, models, taken):
            if not topic.joints or not _joints_of(models).issuperset(topic.joints):
                models += (self._for_parts(topic, joint_topics, frames, evidence)
                           or self._for_topic(topic, frames, evidence))
        return models

    def _for_parts(self, topic: SeenTopic, joint_topics: Sequence[SeenTopic], frames: Set[str],
                   evidence: ModelEvidence) -> List[FoundModel]:
        """Return models for an arm's joints and others below its namespace, such as a gripper's.

        The list is empty if these models do not have the other joints, too.
        """
        parts = parts_of(topic, joint_topics)
        more = {joint for part in parts for joint in part.joints}
        if not more:
            return []
        whole = replace(topic, joints=(*topic.joints, *sorted(more)))
        models = self._for_topic(whole, frames, evidence)
        return models if _joints_of(models) & more else []

    def _for_topic(self, topic: SeenTopic, frames: Set[str],
                   evidence: ModelEvidence) -> List[FoundModel]:
        """Return models for a topic with joints: several if it has joints of several robots.

        Together these models have most of the topic's joints; otherwise the list is empty.
        """
        models: List[FoundModel] = []
        rest = topic
        while len(rest.joints) >= _MIN_JOINTS or not models:
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
        """Return files that may contain the description with that name, the likeliest first."""
        joints = list(description.joints)
        named = [it for it in self._files.all() if it.name == name]
        others = [it for it in self._files.all() if it.name != name and joints
                  and self._files.count_of(it.package, joints) == len(joints)]
        others.sort(key=lambda it: -len(words(it.stem) & words(name)))
        return [*named, *others][:_MAX_TRIES]

    @staticmethod
    def _for_joints(topic: SeenTopic, evidence: ModelEvidence,
                    fitting: Sequence[FoundModel]) -> Optional[FoundModel]:
        """Return the model with the most joints of a topic: an arm rather than its hand alone.

        Among equal ones, the model with the fewest other joints is preferred.
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
        """Yield the models that suit the joints of a topic, from the likeliest files."""
        reason = 'the names of its joints' if topic.joints else \
            'its name and the number of its joints'
        for file in self._likely(topic)[:_MAX_TRIES]:
            fitting = [it for it in self._variants(file, topic) if _fits(it, topic, frames)]
            if fitting:
                best = max(fitting, key=lambda it: _rank(it, topic))
                yield replace(best, reason=f'found by {reason}: is this the right model?')

    def _variants(self, file: ModelFile, topic: SeenTopic) -> Iterator[FoundModel]:
        """Yield a file's models with different arguments and the prefix that the driver may add."""
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
        least = min(_MIN_JOINTS, (len(topic.joints) + 1) // 2)
        return sorted((it for it in likely if counts[it.package] >= least),
                      key=lambda it: -counts[it.package])

    def _arguments(self, file: ModelFile, topic: SeenTopic) -> List[_Arguments]:
        """Return arguments to try: with a hand if there are more joints, a common prefix, none."""
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
                self._expanded[key] = None  # needs other arguments, or is not a whole robot
        return self._expanded[key]


def _joints_of(models: Sequence[FoundModel]) -> Set[str]:
    return {joint for model in models for joint in model.joints}


def _with_hand(file: ModelFile) -> List[_Arguments]:
    return [((name, 'true'),) for name in file.arguments if name in _HANDS]


def _loaded(text: str) -> RobotDescription:
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        path = os.path.join(folder, 'robot_description.urdf')
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
        return load_robot_description(path)


def _fits(model: FoundModel, topic: SeenTopic, frames: Set[str]) -> bool:
    """Return whether most joints of a model are on a topic, or its array has as many numbers."""
    joints = model.joints
    if topic.joints:
        common = len(joints & set(topic.joints))
        return common >= min(_MIN_JOINTS, max(len(joints), 1)) and 2 * common > len(joints)
    return len(joints) == topic.length or (topic.length is None and bool(
        frames & set(model.description.links)))


def _rank(model: FoundModel, topic: SeenTopic) -> Tuple[int, int]:
    """Return a model's rank for a topic: most common joints, then fewest extra joints."""
    seen = set(topic.joints)
    return len(model.joints & seen), -len(model.joints - seen)


def _common_prefix(description: RobotDescription, topic: SeenTopic) -> str:
    """Return the prefix that a topic adds to most joints of a model, '' if there is none."""
    prefixes = Counter(joint[:-len(name)] for name in description.joints for joint in topic.joints
                       if joint.endswith(name))
    prefix, count = max(prefixes.items(), key=lambda it: it[1], default=('', 0))
    return prefix if 2 * count > len(description.joints) else ''


def _has_siblings(description: RobotDescription, topic: SeenTopic, prefix: str) -> bool:
    """Return whether a topic has joints that differ from the model's only in their numbers."""
    kinds = {_NUMBER.sub('#', name) for name in description.joints}
    others = (it[len(prefix):] for it in topic.joints if it.startswith(prefix))
    return any(it not in description.joints and _NUMBER.sub('#', it) in kinds for it in others)


_Shape = Tuple[Tuple[object, ...], ...]


def _same(text: str, other: str) -> bool:
    """Return whether two descriptions have the same joints at the same poses."""
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
