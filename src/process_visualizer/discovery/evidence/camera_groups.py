# SPDX-License-Identifier: BSD-3-Clause
"""Topics of cameras and depth sensors, which publish images, camera infos and clouds together."""
from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Dict, List, Optional, Sequence

from process_visualizer.discovery.evidence.seen import SeenTopic

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
        """The cloud to be shown: one with colours where there are several."""
        clouds = [it for it in self.topics if it.type == CLOUD]
        return max(clouds, key=_cloud_rank) if clouds else None

    @property
    def depth_image(self) -> Optional[SeenTopic]:
        """The depth image, one that is registered to the colours where there is one."""
        images = [it for it in self.topics if it.type == IMAGE and _DEPTH.search(it.name)
                  and self.info_of(it) is not None]
        return max(images, key=lambda it: (is_registered(it), -len(it.name))) if images else None

    @property
    def color_image(self) -> Optional[SeenTopic]:
        """The image with the colours."""
        images = [it for it in self.topics if it.type == IMAGE and not _DEPTH.search(it.name)
                  and self.info_of(it) is not None and re.search('rgb|colou?r', it.name)]
        return min(images, key=lambda it: len(it.name)) if images else None

    @property
    def is_depth_sensor(self) -> bool:
        """Return whether it measures distances."""
        return self.cloud is not None or self.depth_image is not None

    @property
    def frames(self) -> List[str]:
        """The frames of its messages, that of the cloud or the depth image first."""
        main = [it for it in (self.cloud, self.depth_image) if it is not None]
        return list(dict.fromkeys(frame for it in [*main, *self.topics] for frame in it.frames))

    def info_of(self, image: SeenTopic) -> Optional[SeenTopic]:
        """The camera info beside an image, or None."""
        name = image.name.rpartition('/')[0] + '/camera_info'
        return next((it for it in self.topics if it.name == name and it.type == INFO), None)


def is_registered(image: SeenTopic) -> bool:
    """Return whether a depth image is seen from the colour camera."""
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
    """The namespace above those that cameras have for their parts."""
    parts = topic.strip('/').split('/')[:-1]
    for number, part in enumerate(parts):
        if number and _BELOW.fullmatch(part):
            return '/'.join(parts[:number])
    return '/'.join(parts)


def _cloud_rank(topic: SeenTopic) -> 'tuple[bool, bool, int]':
    return is_registered(topic), 'color' in topic.name, -len(topic.name)
