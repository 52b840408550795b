# SPDX-License-Identifier: BSD-3-Clause
"""Models as markers: the visual shapes of robot descriptions, and meshes drawn by nodes."""
from __future__ import annotations

from typing import Iterable, List

import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.visuals import LinkVisual, ShapeKind, link_visuals

KINDS = {ShapeKind.MESH: Marker.MESH_RESOURCE, ShapeKind.BOX: Marker.CUBE,
         ShapeKind.CYLINDER: Marker.CYLINDER, ShapeKind.SPHERE: Marker.SPHERE}
_DRAWN_WITHIN_S = 1.0


def set_shape(marker: Marker, visual: LinkVisual, place: Placement) -> None:
    """Give a marker the shape of a link, at a pose in the marker's frame."""
    marker.type = KINDS[visual.kind]
    marker.mesh_resource = visual.mesh
    marker.scale.x, marker.scale.y, marker.scale.z = visual.size
    marker.pose = Pose(Point(*place.position), Quaternion(*place.quaternion))


def models_of(devices: Iterable[Device]) -> List[Marker]:
    """Return the models of running devices, from their descriptions or the meshes that they draw.

    Invalid descriptions are left out, as in RViz.
    """
    found: List[Marker] = []
    for device in devices:
        if device.model is not None:
            found += _described(rospy.get_param(f'/{device.name}/robot_description', ''))
        elif device.type is DeviceType.OTHER:
            found += _drawn(f'/{device.name}/marker_array')
    return found


def _described(urdf: object) -> List[Marker]:
    try:
        visuals = link_visuals(str(urdf))
    except ValueError:
        return []
    return [_link_marker(visual) for visual in visuals]


def _link_marker(visual: LinkVisual) -> Marker:
    marker = Marker()
    marker.header.frame_id = visual.link
    set_shape(marker, visual, visual.place)
    return marker


def _drawn(topic: str) -> List[Marker]:
    """Return the meshes that a node draws on a topic."""
    if topic not in {name for name, _ in rospy.get_published_topics()}:
        return []
    try:
        array = rospy.wait_for_message(topic, MarkerArray, _DRAWN_WITHIN_S)
    except rospy.ROSException:
        return []  # the node draws nothing now
    return [it for it in array.markers
            if it.type == Marker.MESH_RESOURCE and it.action == Marker.ADD]
