# SPDX-License-Identifier: BSD-3-Clause
"""Topics that belong together: those of this program, and those of one camera."""
from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Optional, Sequence, Set, Tuple

from process_visualizer.discovery.seen import SeenTopic
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CELL_FRAMES,
    DEVICE_NODES,
    FINDER_OUTPUTS,
    GHOST,
    OBJECTS_MARKERS,
    OWN_TOPICS,
    PACKAGE,
    ROBOT_OUTPUTS,
    ROI_FILTER,
    RVIZ,
    SCENE_WATCH,
    STATIC_TF_TOPIC,
    TF_TOPIC,
    VIEW_RELAY,
)

# Topics of cameras and depth sensors, which publish images, camera infos and clouds together.

CLOUD, IMAGE, INFO = 'sensor_msgs/PointCloud2', 'sensor_msgs/Image', 'sensor_msgs/CameraInfo'
CAMERA_TYPES = (CLOUD, IMAGE, INFO, 'sensor_msgs/CompressedImage')
_BELOW = re.compile(r'depth.*|rgb|color|colour|ir|infra\d*|left|right|driver|aligned_depth.*|'
                    r'[hqs]+d|points.*|cloud|stereo|mono')
_DEPTH = re.compile(r'(^|[/_])depth')
_REGISTERED = ('depth_registered', 'aligned_depth', 'depth_to_color', 'depth_to_rgb')


@dataclass
class CameraGroup:
    """A camera: its namespace and its topics."""

    namespace: str
    topics: List[SeenTopic] = field(default_factory=list)

    @property
    def cloud(self) -> Optional[SeenTopic]:
        """The cloud to show; among several, one with colors."""
        clouds = [it for it in self.topics if it.type == CLOUD]
        return max(clouds, key=_cloud_rank) if clouds else None

    @property
    def depth_image(self) -> Optional[SeenTopic]:
        """The depth image; among several, one that is registered to the color image."""
        images = [it for it in self.topics if it.type == IMAGE and _DEPTH.search(it.name)
                  and self.info_of(it) is not None]
        return max(images, key=lambda it: (is_registered(it), -len(it.name))) if images else None

    @property
    def color_image(self) -> Optional[SeenTopic]:
        """The color image."""
        images = [it for it in self.topics if it.type == IMAGE and not _DEPTH.search(it.name)
                  and self.info_of(it) is not None and re.search('rgb|colou?r', it.name)]
        return min(images, key=lambda it: len(it.name)) if images else None

    @property
    def is_depth_sensor(self) -> bool:
        """Return whether the camera measures distances."""
        return self.cloud is not None or self.depth_image is not None

    @property
    def frames(self) -> List[str]:
        """The frames of the camera's messages, those of the cloud and the depth image first."""
        main = [it for it in (self.cloud, self.depth_image) if it is not None]
        return list(dict.fromkeys(frame for topic in [*main, *self.topics]
                                  for frame in topic.frames))

    def info_of(self, image: SeenTopic) -> Optional[SeenTopic]:
        """Return the camera info beside an image, or None."""
        name = image.name.rpartition('/')[0] + '/camera_info'
        return next((it for it in self.topics if it.name == name and it.type == INFO), None)


def is_registered(image: SeenTopic) -> bool:
    """Return whether a depth image or cloud is registered to the color camera, by its name."""
    return any(word in image.name for word in _REGISTERED)


def camera_groups(topics: Sequence[SeenTopic]) -> List[CameraGroup]:
    """Return the cameras, each with the topics of its namespace."""
    groups: Dict[str, CameraGroup] = {}
    for topic in topics:
        if topic.type in CAMERA_TYPES:
            namespace = _namespace(topic.name)
            groups.setdefault(namespace, CameraGroup(namespace)).topics.append(topic)
    return [groups[name] for name in sorted(groups)]


def _namespace(topic: str) -> str:
    """Return the namespace of a camera, above the namespaces of its parts."""
    parts = topic.strip('/').split('/')[:-1]
    for number, part in enumerate(parts):
        if number and _BELOW.fullmatch(part):
            return '/'.join(parts[:number])
    return '/'.join(parts)


def _cloud_rank(topic: SeenTopic) -> 'tuple[bool, bool, int]':
    return is_registered(topic), 'color' in topic.name, -len(topic.name)


_OWN_NODES = frozenset({*DEVICE_NODES, CELL_FRAMES, SCENE_WATCH, GHOST, BAG_RECORDER, PACKAGE,
                        VIEW_RELAY})
_OTHER_NODES = re.compile(r'rviz(_.*)?|rosout|record_\d+|rqt.*|cell_(new|record).*')
_OF_ROS = frozenset({'/rosout', '/rosout_agg', '/clock', TF_TOPIC, STATIC_TF_TOPIC, '/statistics'})
_DESCRIPTION = '/robot_description'
_PREFIXES = (OWN_TOPICS, *(f'/{name}/' for name in (BAG_PLAYER, BAG_RECORDER, GHOST, RVIZ)))
_PACKAGES = frozenset({'actionlib_msgs', 'bond', 'diagnostic_msgs', 'dynamic_reconfigure',
                       PACKAGE, 'rosgraph_msgs', 'theora_image_transport'})
_TYPES = re.compile(r'.*Action(Goal|Feedback|Result)|visualization_msgs/InteractiveMarker.*')
_CROPPED, _SHOWN = '/roi_points', ('/points', '/points_age')
_COMPRESSED = re.compile(r'(.+)/(compressed|compressedDepth|theora)')


def device_topics(topics: Iterable[SeenTopic]) -> Tuple[SeenTopic, ...]:
    """Return the topics that devices may have published.

    A cloud cropped by this program represents its sensor if nothing else from the sensor was
    observed: images and whole clouds are often too large to be recorded.
    """
    given = tuple(topics)
    names = {topic.name for topic in given}
    own = _robots_outputs(names) | _crops_outputs(names) | _finders_outputs(names)
    kept = [topic for topic in given if topic.name not in own and not _is_other(topic, names)]
    cropped = [topic for topic in given if topic.name in own and topic.name.endswith(_CROPPED)]
    cameras = camera_groups(kept) if cropped else ()
    kept += [topic for topic in cropped if not any(_is_source(group, topic) for group in cameras)]
    chosen = set(map(id, kept))  # comparing the topics themselves would take quadratic time
    return tuple(topic for topic in given if id(topic) in chosen)


def _is_other(topic: SeenTopic, names: Set[str]) -> bool:
    compressed = _COMPRESSED.fullmatch(topic.name)
    return (topic.name in _OF_ROS or topic.name.endswith(_DESCRIPTION)
            or topic.name.startswith(_PREFIXES) or bool(_TYPES.fullmatch(topic.type))
            or topic.type.partition('/')[0] in _PACKAGES
            or bool(compressed and compressed.group(1) in names)
            or bool(topic.publishers) and all(map(_is_other_node, topic.publishers)))


def _is_other_node(name: str) -> bool:
    last = name.rpartition('/')[2]
    return last in _OWN_NODES or bool(_OTHER_NODES.fullmatch(last))


def _robots_outputs(names: Set[str]) -> Set[str]:
    """Return outputs of robot processors, by topic names: not every bag names the publishers."""
    robots = {name[:-len('/tool_velocity')] for name in names if name.endswith('/tool_velocity')}
    return {f'{robot}/{output}' for robot in robots if f'{robot}/marker_array' in names
            for output in ROBOT_OUTPUTS}


def _crops_outputs(names: Set[str]) -> Set[str]:
    """Return outputs of depth sensors' crops, by topic names: their manager may have any name."""
    outline = f'/{ROI_FILTER}/outline'
    sensors = {name[:-len(outline)] for name in names if name.endswith(outline)}
    return {f'{sensor}{output}' for sensor in sensors for output in (outline, _CROPPED, *_SHOWN)}


def _is_source(group: CameraGroup, cloud: SeenTopic) -> bool:
    """Return whether a cropped cloud may come from a camera."""
    is_near = group.namespace.split('/')[0] == cloud.name.strip('/').split('/')[0]
    return group.is_depth_sensor and (is_near or bool(set(group.frames) & set(cloud.frames)))


def _finders_outputs(names: Set[str]) -> Set[str]:
    """Return outputs of depth sensors' object finders, by topic names."""
    sensors = [name[:-len(OBJECTS_MARKERS)] for name in names
               if name.endswith(f'/{OBJECTS_MARKERS}')]
    return {f'{sensor}{output}' for sensor in sensors for output in FINDER_OUTPUTS}
