# SPDX-License-Identifier: BSD-3-Clause
"""A camera or depth sensor as a device of the configuration."""
from __future__ import annotations

from typing import Collection, Dict, Iterable, List, Optional, Tuple

from process_visualizer.discovery.cell_names import CellNames
from process_visualizer.discovery.draft import DraftDevice, DraftElement
from process_visualizer.discovery.evidence.camera_groups import (
    CLOUD,
    CameraGroup,
    is_registered,
)
from process_visualizer.discovery.evidence.frame_forest import FrameForest
from process_visualizer.discovery.evidence.seen import SeenTopic
from process_visualizer.discovery.names import is_frame
from process_visualizer.discovery.place import Places, top_frame
from process_visualizer.discovery.robot_device import add_topic


def camera_device(group: CameraGroup, name: str, names: CellNames, places: Places,
                  forest: FrameForest, links: Collection[str]) -> DraftDevice:
    """Return the device of a camera; ``links`` are those of robots, which may carry it."""
    device = DraftDevice('depth_sensor' if group.is_depth_sensor else 'other', name)
    _add_base(device, group, names, places, forest, links)
    cloud = group.cloud
    is_computed = group.depth_image is not None
    for topic in group.topics:
        if topic is cloud:
            _add_cloud(device, topic, is_computed)
        elif topic.type == CLOUD:
            add_topic(device, topic, '', 'one more cloud: large, so it is not recorded',
                      record='False')
        else:
            add_topic(device, topic)
    if group.depth_image is not None:
        _add_cloud_node(device, group, group.depth_image, cloud)
    return device


def _add_base(device: DraftDevice, group: CameraGroup, names: CellNames, places: Places,
              forest: FrameForest, links: Collection[str]) -> None:
    frames = [frame for frame in group.frames if is_frame(frame)]
    tops = [top_frame(forest, frame, {places.frame, *links}) for frame in frames]
    base, carrier = tops[0] if tops else (f'{device.name}/base', None)
    end = base
    if carrier is not None and carrier in links:
        device.comments.append(f'{device.name} is fixed to {carrier}.')
        end = carrier
    elif is_frame(base) and base != places.frame and names.is_free(base):
        attributes, comment = places.base_attributes(names.frame(base))
        device.add('base', attributes, comment)
    add_inner_frames(device, frames, end, names, forest)


def add_inner_frames(device: DraftDevice, frames: Iterable[str], end: str, names: CellNames,
                     forest: FrameForest) -> None:
    """Publish the frames between ``end`` and others in playback, where their driver is not there.

    Those that something else has stay out.
    """
    done: Dict[str, None] = {}
    for frame in frames:
        path = forest.path(frame)
        done.update(dict.fromkeys(path[:path.index(end)] if end in path else ()))
    begin = sum(it.tag == 'node' for it in device.elements) + 1
    for number, child in enumerate((it for it in done if names.is_free(it)), begin):
        it = forest.transform(names.frame(child))
        values = ' '.join(f'{value:.9g}' for value in (*it.placement.position,
                                                       *it.placement.quaternion))
        device.add('node', {'ifstate': 'playback', 'pkg': 'tf2_ros',
                            'type': 'static_transform_publisher', 'name': f'frame_{number}',
                            'args': f'{values} {it.parent} {child}'},
                   'moved while it was looked at, which a fixed transform does not' * it.changes,
                   active=not it.changes)


def _add_cloud(device: DraftDevice, cloud: SeenTopic, is_computed: bool) -> None:
    if is_computed:
        add_topic(device, cloud, 'pointcloud', 'not recorded: in playback it is computed from the '
                  'images', record='False')
    else:
        add_topic(device, cloud, 'pointcloud')


def _add_cloud_node(device: DraftDevice, group: CameraGroup, depth: SeenTopic,
                    cloud: Optional[SeenTopic]) -> None:
    """Compute the cloud from the images: in playback, or always if nobody does it."""
    output = f'/{device.name}/cloud' if cloud is None else cloud.name
    if cloud is None:
        device.add('topic', {'ns': device.name, 'name': 'cloud', 'type': 'pointcloud',
                             'record': 'False'}, 'computed from the images by the node below')
    mode = {} if cloud is None else {'ifstate': 'playback'}
    nodelet, remaps = _nodelet(group, depth)
    children = tuple(DraftElement('remap', {'from': name, 'to': to})
                     for name, to in [*remaps, (_output(nodelet), output)])
    device.add('node', {**mode, 'pkg': 'nodelet', 'type': 'nodelet', 'name': 'cloud_of_images',
                        'args': f'standalone depth_image_proc/{nodelet}'}, children=children)


def _nodelet(group: CameraGroup, depth: SeenTopic) -> Tuple[str, List[Tuple[str, str]]]:
    """The nodelet of depth_image_proc for these images, and the topics that it takes."""
    color, info = group.color_image, group.info_of(depth)
    color_info = group.info_of(color) if color is not None else None
    if color is not None and color_info is not None and is_registered(depth):
        return 'point_cloud_xyzrgb', [('rgb/image_rect_color', color.name),
                                      ('rgb/camera_info', color_info.name),
                                      ('depth_registered/image_rect', depth.name)]
    return 'point_cloud_xyz', [('image_rect', depth.name),
                               ('camera_info', info.name if info is not None else '')]


def _output(nodelet: str) -> str:
    return 'depth_registered/points' if nodelet.endswith('rgb') else 'points'
