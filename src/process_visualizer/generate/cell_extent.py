# SPDX-License-Identifier: BSD-3-Clause
"""Decides what the initial view must show: the extent of the cell and of its models."""
from __future__ import annotations

import functools
import itertools
import math
import os
import random
import struct
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Set, Tuple
from xml.etree import ElementTree

import numpy as np
import rospkg

from process_visualizer.cell.model import Cell, Device, DeviceType, Pose
from process_visualizer.generate.processor_nodes import fixed_frames
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.kinematics import Kinematics, Placement, origin_of, urdf_root
from process_visualizer.robot.mesh_files import MeshError, check_mesh_file
from process_visualizer.robot.model_resources import resource_path
from process_visualizer.robot.rotations import matrix_from_quaternion, quaternion_from_ypr
from process_visualizer.robot.tool_frame import tool_frame


class CellFrames:
    """The global frame, base, tool and force frames, and the links at default joint positions."""

    def __init__(self, cell: Cell, devices: Tuple[Device, ...],
                 descriptions: Mapping[str, RobotDescription]) -> None:
        """Initialize with the devices, and the models of those that have one."""
        self._frame = cell.frame
        self._fixed: Dict[str, Tuple[str, Placement]] = {
            frame.child: (frame.parent, _placement(Pose(frame.xyz, frame.ypr)))
            for frame in fixed_frames(cell, devices)}
        packages = rospkg.RosPack()
        self.models: Dict[str, ModelExtent] = {
            name: ModelExtent(description.text, packages)
            for name, description in descriptions.items()}
        self._owners: Dict[str, str] = {link: name for name, description in descriptions.items()
                                        for link in description.links}

    @property
    def names(self) -> Set[str]:
        """The names of the known frames."""
        return {self._frame, *self._fixed, *self._owners}

    def place(self, frame: str) -> Optional[Placement]:
        """Return the pose of a frame in the global frame; None if it is unknown."""
        found, passed = Placement(), set()
        while frame != self._frame:
            step = self._step(frame)
            if step is None or frame in passed:
                return None
            passed.add(frame)
            frame, found = step[0], step[1].then(found)
        return found

    def _step(self, frame: str) -> Optional[Tuple[str, Placement]]:
        """Return the parent of a frame, and the pose of the frame in it."""
        owner = self._owners.get(frame)
        if owner is None or frame in self._fixed:
            return self._fixed.get(frame)
        model = self.models[owner]
        place = model.place(frame)
        return None if place is None or frame == model.root_link else (model.root_link, place)


def _placement(pose: Pose) -> Placement:
    x, y, z, w = np.asarray(quaternion_from_ypr(pose.ypr)).tolist()
    a, b, c = pose.xyz
    return Placement((a, b, c), (x, y, z, w))


_UNKNOWN_M = 0.5
"""Assumed extent around the base of a device without a readable model."""
_ARROW_M = 0.15
"""Room for a variable's arrow and number."""
_SIGHT_M = 1.5
"""Assumed range of a depth sensor in a cell that has nothing else."""
_SIGHT_SLOPE = 0.5
_CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def cell_extent(cell: Cell, devices: Tuple[Device, ...],
                descriptions: Mapping[str, RobotDescription]) -> Dict[str, np.ndarray]:
    """Return points (n, 3) in the global frame [m] around the visible part of each device, by name.

    These are robots with their reach, machines, regions of interest, and the positions of
    variables. A depth sensor itself counts only in a cell of depth sensors, because it views other
    devices from far away. Scenery (a model without data) counts only up to the height of the other
    devices; a mast, for example, is cut off.
    """
    extents = _Extents(cell, devices, descriptions)
    found = {device.name: extents.of_device(device) for device in devices}
    if not any(map(len, found.values())):
        found = {device.name: extents.sight(device) for device in devices}
    return _with_scenery(found, {it.name: extents.scenery(it) for it in devices})


class _Extents:
    def __init__(self, cell: Cell, devices: Tuple[Device, ...],
                 descriptions: Mapping[str, RobotDescription]) -> None:
        self._descriptions = descriptions
        self._frames = CellFrames(cell, devices, descriptions)

    def of_device(self, device: Device) -> np.ndarray:
        """Return the points around the device's data."""
        parts = [self._around(variable.frame, _ARROW_M * _CUBE) for variable in device.variables]
        if device.roi is not None:
            corners = np.array(device.roi.center) + 0.5 * _CUBE * np.array(device.roi.size)
            parts.append(self._around(device.roi.frame, corners))
        if device.type is not DeviceType.DEPTH_SENSOR and not _is_scenery(device):
            parts.append(self._machine(device))
        return np.concatenate([np.empty((0, 3)), *parts])

    def scenery(self, device: Device) -> np.ndarray:
        """Return the model of a device that has nothing else."""
        return self._machine(device) if _is_scenery(device) else np.empty((0, 3))

    def sight(self, device: Device) -> np.ndarray:
        """Return a depth sensor and the space in front of it."""
        if device.base is None or device.type is not DeviceType.DEPTH_SENSOR:
            return np.empty((0, 3))
        depth, side = _SIGHT_M, _SIGHT_SLOPE * _SIGHT_M
        cone = np.array([(0, 0, 0), *((depth, y, z) for y in (-side, side) for z in (-side, side))])
        if device.base.frame.endswith('optical_frame'):  # REP 103: z forward there
            cone = cone[:, [1, 2, 0]]
        return self._around(device.base.frame, cone)

    def _machine(self, device: Device) -> np.ndarray:
        if device.base is None:
            return np.empty((0, 3))
        model = self._frames.models.get(device.name)
        body = np.empty((0, 3)) if model is None else model.body()
        if not len(body):
            body = _UNKNOWN_M * _CUBE
        if model is not None and device.type is DeviceType.ROBOT:
            tool = tool_frame(device, self._descriptions[device.name]).parent
            body = np.concatenate([body, model.reach(tool)])
        return self._around(device.base.frame, body)

    def _around(self, frame: str, points: np.ndarray) -> np.ndarray:
        place = self._frames.place(frame)
        return np.empty((0, 3)) if place is None else moved(place, points)


def _is_scenery(device: Device) -> bool:
    return (device.type is DeviceType.OTHER and device.model is not None
            and not device.topics and not device.variables)


def _with_scenery(found: Dict[str, np.ndarray],
                  scenery: Dict[str, np.ndarray]) -> Dict[str, np.ndarray]:
    """Add the scenery, cut off above everything else."""
    rest = np.concatenate([np.empty((0, 3)), *found.values()])
    top = rest.max(axis=0) if len(rest) else np.full(3, np.inf)
    top[:2] = np.inf
    return {name: np.concatenate([points, np.minimum(scenery[name], top)])
            for name, points in found.items()}


_STL_HEADER_BYTES = 84
_STL_FACE_BYTES = 50
_IDENTITY = np.eye(4)


def mesh_corners(path: str) -> Optional[np.ndarray]:
    """Return the lowest and the highest corner (2, 3) of a mesh, in the units of its file.

    The unit of a Collada file is applied, so its corners are in m. None if the file cannot be read
    or parsed.
    """
    try:
        return _corners(path, os.stat(path).st_mtime_ns)
    except (OSError, ValueError):  # a zero byte in the path
        return None


@functools.lru_cache(maxsize=256)
def _corners(path: str, _changed_ns: int) -> Optional[np.ndarray]:
    read = _READERS.get(os.path.splitext(path)[1].lower())
    if read is None:
        return None
    try:
        check_mesh_file(path)
        points = read(path)
    except (MeshError, ValueError, KeyError, IndexError, ElementTree.ParseError, struct.error):
        return None
    points = points[np.isfinite(points).all(axis=1)]
    return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else None


def _stl(path: str) -> np.ndarray:
    """Return the vertices of an STL file; a binary one is recognized by its size."""
    with open(path, 'rb') as file:
        content = file.read()
    if len(content) >= _STL_HEADER_BYTES:
        count = struct.unpack_from('<I', content, _STL_HEADER_BYTES - 4)[0]
        if len(content) == _STL_HEADER_BYTES + count * _STL_FACE_BYTES:
            face = np.dtype([('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('note', '<u2')])
            faces = np.frombuffer(content, face, count, _STL_HEADER_BYTES)
            return np.asarray(faces['corners'].reshape(-1, 3), dtype=float)
    return _numbered_lines(content, b'vertex')


def _obj(path: str) -> np.ndarray:
    with open(path, 'rb') as file:
        return _numbered_lines(file.read(), b'v')


def _numbered_lines(content: bytes, word: bytes) -> np.ndarray:
    """Return the three numbers of each line that begins with a given word."""
    lines = (line.split() for line in content.splitlines())
    rows = [[float(number) for number in words[1:4]] for words in lines
            if len(words) > 3 and words[0] == word]
    return np.array(rows, dtype=float).reshape(-1, 3)


def _collada(path: str) -> np.ndarray:
    """Return the vertices of all geometries in the scene, with the transforms of its nodes."""
    root = ElementTree.parse(path).getroot()
    for element in root.iter():
        element.tag = element.tag.rpartition('}')[2]
    unit = root.find('asset/unit')
    scale = 1.0 if unit is None else float(unit.get('meter', '1'))
    shapes = {geometry.get('id', ''): _vertices(geometry)
              for geometry in root.iterfind('library_geometries/geometry')}
    library = {node.get('id', ''): node for node in root.iterfind('library_nodes/node')}
    found: List[np.ndarray] = []
    for scene in root.iterfind('library_visual_scenes/visual_scene'):
        for node in scene.findall('node'):
            found += _placed(node, _IDENTITY, shapes, library)
    return scale * np.concatenate(found or list(shapes.values()) or [np.empty((0, 3))])


def _vertices(geometry: ElementTree.Element) -> np.ndarray:
    """Return the positions (n, 3) of a geometry; normals and colors are other sources."""
    sources = {f'#{source.get("id")}': source for source in geometry.iter('source')}
    rows = [np.empty((0, 3))]
    for place in geometry.iterfind('mesh/vertices/input[@semantic="POSITION"]'):
        numbers = sources[place.get('source', '')].find('float_array')
        if numbers is not None:
            rows.append(np.array((numbers.text or '').split(), dtype=float).reshape(-1, 3))
    return np.concatenate(rows)


def _placed(node: ElementTree.Element, parent: np.ndarray, shapes: Dict[str, np.ndarray],
            library: Dict[str, ElementTree.Element], depth: int = 0) -> Iterator[np.ndarray]:
    """Yield the vertices below a node, in the frame of the scene."""
    if depth > len(library) + 100:
        raise ValueError('nodes contain each other')
    place = parent @ _transform(node)
    for shown in node.findall('instance_geometry'):
        yield shapes[_name(shown)] @ place[:3, :3].T + place[:3, 3]
    below = node.findall('node') + [library[_name(it)] for it in node.findall('instance_node')]
    for child in below:
        yield from _placed(child, place, shapes, library, depth + 1)


def _name(instance: ElementTree.Element) -> str:
    return instance.get('url', '').lstrip('#')


def _transform(node: ElementTree.Element) -> np.ndarray:
    """Return the matrix (4, 4) of a node: the product of its transforms."""
    matrix = _IDENTITY
    for element in node:
        make = _TRANSFORMS.get(element.tag)
        if make is not None:
            matrix = matrix @ make(np.array((element.text or '').split(), dtype=float))
    return matrix


def _translation(values: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = values
    return matrix


def _rotation(values: np.ndarray) -> np.ndarray:
    """Return the matrix (4, 4) of axis and angle in degrees (Rodrigues' formula)."""
    x, y, z = values[:3] / (np.linalg.norm(values[:3]) or 1.0)
    angle = np.radians(values[3])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return matrix


_TRANSFORMS: Dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'matrix': lambda values: values.reshape(4, 4),
    'translate': _translation,
    'rotate': _rotation,
    'scale': lambda values: np.diag([*values, 1.0]),
}
_READERS: Dict[str, Callable[[str], np.ndarray]] = {'.stl': _stl, '.dae': _collada, '.obj': _obj}


_SAMPLES = 120
"""Number of random joint positions: they fill the reach of an arm except for its rim."""
_TURN_RAD = math.pi
"""Maximum rotation of joints without limits, or with wider ones."""
_THROUGH = 0.1
"""Maximum share of a standing model below its base plane (a plate, a cable)."""
_CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3)))


class ModelExtent:
    """The extent of one model, in the frame of its root link [m]."""

    def __init__(self, urdf: str, packages: Optional[rospkg.RosPack] = None) -> None:
        """Read a checked URDF; ``packages`` saves a new search for packages of meshes.

        Raises:
            ValueError: the URDF has an invalid number.
        """
        self._packages = packages or rospkg.RosPack()
        self._body: Optional[np.ndarray] = None
        self._root = urdf_root(urdf)
        self._kinematics = Kinematics(urdf)
        self._limits = {joint.get('name', ''): _limits(joint)
                        for joint in self._root.findall('joint')}
        self.positions = {name: 0.0 if low <= 0.0 <= high else 0.5 * (low + high)
                          for name, (low, high) in self._limits.items()}
        children = {child.get('link') for child in self._root.findall('joint/child')}
        self.root_link = next((link for link in self._kinematics.links if link not in children), '')

    def place(self, link: str) -> Optional[Placement]:
        """Return a link's pose at default joint positions: zero if possible, else the middle."""
        return self._kinematics.placement(link, self.root_link, self.positions)

    def body(self) -> np.ndarray:
        """Return corners (n, 3) of the visual, or else collision, geometry at default positions."""
        if self._body is None:
            self._body = self._corners()
        return self._body

    def _corners(self) -> np.ndarray:
        corners = [np.empty((0, 3))]
        for link in self._root.findall('link'):
            place = self.place(link.get('name', ''))
            shapes = link.findall('visual') or link.findall('collision')
            if place is not None:
                corners += [moved(place, self._shape_corners(shape)) for shape in shapes]
        return np.concatenate(corners)

    def reach(self, tool: str) -> np.ndarray:
        """Return positions (n, 3) of a link at random joint positions within the joints' ranges.

        An arm that stands on its base plane does not reach through that plane.
        """
        chance = random.Random(1)  # for reproducible results
        found: List[Tuple[float, float, float]] = []
        is_moved = any(joint.get('type') != 'fixed' for joint in self._root.findall('joint'))
        for _ in range(_SAMPLES if is_moved else 0):
            positions = {name: chance.uniform(low, high)
                         for name, (low, high) in self._limits.items()}
            place = self._kinematics.placement(tool, self.root_link, positions)
            if place is not None:
                found.append(place.position)
        points = np.array(found, dtype=float).reshape(-1, 3)
        return points[points[:, 2] >= 0.0] if self._stands_on_base() else points

    def _stands_on_base(self) -> bool:
        body = self.body()
        return bool(len(body)) and bool(
            -body[:, 2].min() <= _THROUGH * np.ptp(body, axis=0).max())

    def _shape_corners(self, shape: ElementTree.Element) -> np.ndarray:
        """Return the corners (8, 3) of a shape's box in its link; no rows for an unknown shape."""
        ends = self._ends(shape.find('geometry'))
        if ends is None:
            return np.empty((0, 3))
        corners = ends[0] + _CORNERS * (ends[1] - ends[0])
        return moved(origin_of(shape), corners)

    def _ends(self, geometry: Optional[ElementTree.Element]) -> Optional[np.ndarray]:
        """Return the lowest and the highest corner (2, 3) of a geometry."""
        shape = None if geometry is None or not len(geometry) else geometry[0]
        if shape is None:
            return None
        if shape.tag == 'mesh':
            corners = mesh_corners(resource_path(shape.get('filename', ''), self._packages))
            return None if corners is None else corners * _numbers(shape.get('scale', '1 1 1'))
        radius, length = float(shape.get('radius', '0')), float(shape.get('length', '0'))
        halves: Dict[str, Callable[[], np.ndarray]] = {
            'box': lambda: 0.5 * _numbers(shape.get('size', '0 0 0')),
            'sphere': lambda: np.full(3, radius),
            'cylinder': lambda: np.array([radius, radius, 0.5 * length])}
        half = halves.get(shape.tag)
        return None if half is None else np.array([-half(), half()])


def _limits(joint: ElementTree.Element) -> Tuple[float, float]:
    limit, kind = joint.find('limit'), joint.get('type')
    if kind == 'continuous' or (limit is None and kind != 'prismatic'):
        return -_TURN_RAD, _TURN_RAD
    if limit is None:
        return 0.0, 0.0  # URDF requires limits for it, so its travel in m is unknown
    low, high = float(limit.get('lower', '0')), float(limit.get('upper', '0'))
    if kind == 'revolute' and low <= 0.0 <= high:
        return max(low, -_TURN_RAD), min(high, _TURN_RAD)
    return low, high


def moved(place: Placement, points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) [m] of a frame, expressed in the outer frame."""
    return points @ matrix_from_quaternion(place.quaternion).T + np.array(place.position)


def _numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=float)
