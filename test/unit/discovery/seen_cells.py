# SPDX-License-Identifier: BSD-3-Clause
"""Observed cells for the tests."""
from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterable, List, Sequence, Tuple

from hypothesis import strategies as st

from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.discovery.draft import draft_text
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.robot_topics import FoundModel
from process_visualizer.discovery.seen import Seen, SeenNumber, SeenTopic, SeenTransform
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.kinematics import Placement

FLOATS, JOINTS = 'std_msgs/Float32MultiArray', 'sensor_msgs/JointState'
POSE, WRENCH = 'geometry_msgs/PoseStamped', 'geometry_msgs/WrenchStamped'
TF_MESSAGE = 'tf2_msgs/TFMessage'
IMAGE, INFO, CLOUD = 'sensor_msgs/Image', 'sensor_msgs/CameraInfo', 'sensor_msgs/PointCloud2'


def urdf(links: Sequence[str], joints: Sequence[str]) -> str:
    """A chain of links, connected by the joints and then by fixed ones."""
    parts = [f'<link name="{link}" />' for link in links]
    names = [*joints, *(f'fixed_{number}' for number in range(len(links)))]
    for number, (parent, child) in enumerate(zip(links, links[1:])):
        kind = 'continuous' if number < len(joints) else 'fixed'
        parts.append(f'<joint name="{names[number]}" type="{kind}"><parent link="{parent}" />'
                     f'<child link="{child}" /></joint>')
    return f'<robot name="r">{"".join(parts)}</robot>'


def model(namespace: str, name: str, links: Sequence[str], joints: Sequence[str]) -> FoundModel:
    """A model that belongs next to the configuration."""
    return FoundModel(namespace, name, RobotDescription(
        urdf(links, joints), tuple(links), {joint: 'continuous' for joint in joints},
        dict(zip(links[1:], links)), frozenset(links)))


def transform(parent: str, child: str, *xyz: float) -> SeenTransform:
    """A transform without a rotation."""
    x, y, z = xyz or (0.0, 0.0, 0.0)
    return SeenTransform(parent, child, Placement((x, y, z)))


def sent(parent: str, child: str, changes: bool = False) -> SeenTransform:
    """A transform that came on /tf."""
    return transform(parent, child)._replace(topic='/tf', changes=changes)


def number(path: str = 'data', low: float = 0.0, high: float = 1.0) -> SeenNumber:
    """A number that changes."""
    return SeenNumber(path, low, high)


def written(seen: Seen, models: Sequence[FoundModel], folder: Path) -> Tuple[str, Cell]:
    """The generated text, and the result of parsing it."""
    made = make_draft(seen, models)
    for name, text in made.models.items():
        (folder / name).write_text(text, encoding='utf-8')
    path = folder / 'cell.xml'
    text = draft_text(made.draft)
    path.write_text(text, encoding='utf-8')
    return text, XmlParser().parse(str(path))


_PARTS = st.sampled_from(['arm', 'left', 'right', 'camera', 'depth', 'rgb', 'joint_states', 'tcf',
                          'ft', 'points', 'image_raw', 'camera_info', 'data', 'q', 'pose', 'oven',
                          'marker_array', 'tool_velocity', 'sensors', 'robot', 'world', '2d', 'ä',
                          'a b', 'x&<y', '', 'goal'])
_NAMES = st.lists(_PARTS, min_size=1, max_size=4).map(lambda parts: '/' + '/'.join(parts))
_TYPES = st.sampled_from([
    FLOATS, JOINTS, POSE, WRENCH, IMAGE, INFO, CLOUD, 'std_msgs/Float64', 'sensor_msgs/Temperature',
    'sensor_msgs/LaserScan', 'visualization_msgs/MarkerArray', 'my_msgs/Oven', 'std_msgs/String',
    'nav_msgs/Path', 'sensor_msgs/CompressedImage', TF_MESSAGE, 'x', ''])
_FRAMES = st.sampled_from(['world', 'map', 'base', 'tool', 'arm/base', 'camera_link', 'optical',
                           'oven', 'oven/base', 'sensors/base', 'tool0_controller', 'arm_EE', 'ä',
                           'a b', '-->', '"', '$(x)'])
_JOINT_NAMES = st.sampled_from(['j1', 'j2', 'j3', 'finger'])
_NUMBERS = st.builds(
    lambda path, ends: SeenNumber(path, min(ends), max(ends)),
    st.sampled_from(['data', 'temperature', 'a.b', 'data[0]', 'x-y', 'seq', '$(arg z)', 'state']),
    st.tuples(*2 * [st.floats(allow_nan=False, allow_infinity=False)]))
_TOPICS = st.builds(
    SeenTopic, _NAMES, _TYPES, st.sampled_from([(), ('/driver',), ('/arm/robot_proc',), ('/é"',)]),
    st.lists(_FRAMES, max_size=2, unique=True).map(tuple),
    st.lists(_JOINT_NAMES, max_size=3, unique=True).map(tuple),
    st.sampled_from([None, 3, 6, 7, 50]), st.lists(_NUMBERS, max_size=9).map(tuple))
_TRANSFORMS = st.one_of(st.builds(transform, _FRAMES, _FRAMES, *3 * [st.floats(-9, 9)]),
                        st.builds(sent, _FRAMES, _FRAMES, st.booleans()))
_TF = SeenTopic('/tf', TF_MESSAGE)
_MODELS = st.builds(model, st.sampled_from(['', '/arm', '/left', '/right/ä', '/a b']),
                    st.sampled_from(['arm', 'ur', 'ä', '']),
                    st.lists(_FRAMES, min_size=1, max_size=4, unique=True),
                    st.lists(_JOINT_NAMES, max_size=3, unique=True))


def _one_of_each(topics: Iterable[SeenTopic]) -> Tuple[SeenTopic, ...]:
    found: Dict[str, SeenTopic] = {it.name: it for it in topics}
    return tuple(found.values())


cells: 'st.SearchStrategy[Tuple[Seen, List[FoundModel]]]' = st.tuples(
    st.builds(Seen, st.sampled_from(['a.bag', 'ö--"<&>.bag', 'x\n\x00--->']),
              st.lists(_TOPICS, max_size=12).map(lambda it: _one_of_each([_TF, *it])),
              st.lists(_TRANSFORMS, max_size=8).map(tuple), st.just(()),
              st.lists(st.text(max_size=30), max_size=2).map(tuple)),
    st.lists(_MODELS, max_size=3))
"""Any observed cell, and models for it."""
