# SPDX-License-Identifier: BSD-3-Clause
"""The models: their kinematics against the thesis' DH table, their meshes, and their generation."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.visuals import ShapeKind, link_visuals
from process_visualizer.robot.xacro_file import expand_xacro
from sewing_cell.scene import ROBOT_MESHES

SEWING_CELL = Path(__file__).resolve().parents[2]
URDF = SEWING_CELL / "urdf"
REPOSITORY = SEWING_CELL.parent
URDFS = (URDF, REPOSITORY / "urdf")
MESHES = {f"package://{package}/meshes/{path.name}": path
          for package, folder in (("process_visualizer", REPOSITORY), ("sewing_cell", SEWING_CELL))
          for path in sorted((folder / "meshes").iterdir())}
ROBOTS = ("ur_rt_upper", "ur_rt_lower")
STATIC_MODELS = {
    "sewing_machine": "sewing_machine/base",
    "cell_stand": "cell_stand/base",
    "kinect": "camera_link",
}
DRIVEN_JOINTS = ("joint_0_1", "joint_1_2", "joint_2_3", "joint_4_5", "joint_5_6", "joint_6_7")
FIXED_JOINTS = ("joint_3_4", "joint_7_tool")
#: a [m], alpha [rad], d [m]: rows 1 to 6 of table 6.1.
DH_TABLE = (
    (0, math.pi / 2, 0.0892),
    (-0.425, 0, 0),
    (-0.39243, 0, 0),
    (0, math.pi / 2, 0.109),
    (0, -math.pi / 2, 0.093),
    (0, 0, 0.082),
)
HOME = (0, -math.pi / 2, 0, -math.pi / 2, 0, 0)
SIZE_LIMIT_BYTES = 3_000_000

COLLADA = "{http://www.collada.org/2005/11/COLLADASchema}"

Bounds = Tuple[np.ndarray, np.ndarray]
Models = Dict[str, ElementTree.Element]


@pytest.fixture(scope="session")
def robots() -> Models:
    """The expanded URDF of both robots, with $(find …) answered from this tree."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_PACKAGE_PATH", f"{SEWING_CELL.parent}{os.pathsep}{SEWING_CELL}")
        texts = {name: expand_xacro(str(URDF / f"{name}.urdf.xacro")) for name in ROBOTS}
    return {name: ElementTree.fromstring(text) for name, text in texts.items()}


@pytest.fixture(scope="session")
def models(robots: Models) -> Models:
    """Every model of the cell by its name."""
    paths = {path.stem: path for folder in URDFS for path in folder.glob("*.urdf")}
    static = {name: ElementTree.parse(paths[name]).getroot() for name in STATIC_MODELS}
    return {**robots, **static}


# --- small matrices: 4x4 homogeneous transforms, meters and radians ---


def turn_x(angle: float) -> np.ndarray:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0, 0], [0, cosine, -sine, 0], [0, sine, cosine, 0], [0, 0, 0, 1]])


def turn_y(angle: float) -> np.ndarray:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, 0, sine, 0], [0, 1, 0, 0], [-sine, 0, cosine, 0], [0, 0, 0, 1]])


def turn_z(angle: float) -> np.ndarray:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine, 0, 0], [sine, cosine, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def shift(x: float, y: float, z: float) -> np.ndarray:
    transform = np.eye(4)
    transform[:3, 3] = x, y, z
    return transform


def dh_product(angles: Sequence[float]) -> np.ndarray:
    """The tool in link 0: the product of Rz(theta) Tz(d) Tx(a) Rx(alpha) over the table's rows."""
    result = np.eye(4)
    for theta, (a, alpha, d) in zip(angles, DH_TABLE):
        result = result @ turn_z(theta) @ shift(a, 0, d) @ turn_x(alpha)
    return result


def numbers(text: Optional[str]) -> List[float]:
    return [float(word) for word in (text or "").split()]


def child(element: ElementTree.Element, path: str) -> ElementTree.Element:
    """The child at `path`, which must exist."""
    found = element.find(path)
    assert found is not None, f"<{element.tag}> lacks {path}"
    return found


def joint_transform(joint: ElementTree.Element, angle: float) -> np.ndarray:
    """The child link of a URDF joint in its parent link."""
    origin = child(joint, "origin")
    roll, pitch, yaw = numbers(origin.get("rpy"))
    fixed = shift(*numbers(origin.get("xyz"))) @ turn_z(yaw) @ turn_y(pitch) @ turn_x(roll)
    if joint.get("type") == "fixed":
        return fixed
    assert numbers(child(joint, "axis").get("xyz")) == [0, 0, 1]
    return fixed @ turn_z(angle)


def tool_in_base(robot: ElementTree.Element, angles: Sequence[float]) -> np.ndarray:
    """The tool in link 0, found by walking the URDF's joints from the tool to the base."""
    name = robot.get("name")
    positions = {f"{name}/{joint}": angle for joint, angle in zip(DRIVEN_JOINTS, angles)}
    by_child = {child(joint, "child").get("link"): joint for joint in robot.iter("joint")}
    link: Optional[str] = f"{name}/tool"
    result = np.eye(4)
    while link in by_child:
        joint = by_child[link]
        result = joint_transform(joint, positions.get(joint.get("name", ""), 0.0)) @ result
        link = child(joint, "parent").get("link")
    assert link == f"{name}/link0"
    return result


def angle_between(first: np.ndarray, second: np.ndarray) -> float:
    """The angle of the rotation that leads from one transform to the other (exact when small)."""
    turn = first[:3, :3].T @ second[:3, :3]
    sine = np.linalg.norm(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    return math.atan2(sine / 2, (np.trace(turn) - 1) / 2)


# --- kinematics and names ---


@given(st.lists(st.floats(-2 * math.pi, 2 * math.pi), min_size=6, max_size=6))
def test_forward_kinematics_equal_the_dh_table(robots: Models, angles: List[float]) -> None:
    expected = dh_product(angles)
    for robot in robots.values():
        found = tool_in_base(robot, angles)
        assert np.linalg.norm(found[:3, 3] - expected[:3, 3]) < 1e-6
        assert angle_between(found, expected) < 1e-6


def test_home_pose_stands_upright(robots: Models) -> None:
    """Equation 6.1: the wrist's first two axes are above the base, the tool points sideways."""
    tool = tool_in_base(robots["ur_rt_upper"], HOME)
    assert tool[:3, 3] == pytest.approx([0, -0.109 - 0.082, 0.0892 + 0.425 + 0.39243 + 0.093])
    assert tool[:3, 2] == pytest.approx([0, -1, 0], abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_links_and_joints_have_the_names_of_the_thesis(robots: Models, name: str) -> None:
    links = [link.get("name", "") for link in robots[name].iter("link")]
    assert sorted(links) == sorted([f"{name}/link{i}" for i in range(8)] + [f"{name}/tool"])
    types = {joint.get("name"): joint.get("type") for joint in robots[name].iter("joint")}
    driven = {f"{name}/{joint}": "continuous" for joint in DRIVEN_JOINTS}
    fixed = {f"{name}/{joint}": "fixed" for joint in FIXED_JOINTS}
    assert types == {**driven, **fixed}


@pytest.mark.parametrize("name", STATIC_MODELS)
def test_static_model_is_one_link(models: Models, name: str) -> None:
    assert [link.get("name") for link in models[name].iter("link")] == [STATIC_MODELS[name]]
    assert not list(models[name].iter("joint"))


@pytest.mark.parametrize("name", (*ROBOTS, *STATIC_MODELS))
def test_check_urdf_accepts_the_model(models: Models, name: str, tmp_path: Path) -> None:
    check_urdf = shutil.which("check_urdf")
    assert check_urdf, "install liburdfdom-tools"
    file = tmp_path / f"{name}.urdf"
    file.write_text(ElementTree.tostring(models[name], encoding="unicode"), encoding="utf-8")
    answer = subprocess.run([check_urdf, str(file)], capture_output=True, text=True, timeout=30)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert f"robot name is: {name}" in answer.stdout


# --- meshes ---


def mesh_files(model: ElementTree.Element) -> List[str]:
    return [mesh.get("filename", "") for mesh in model.iter("mesh")]


def collada_points(path: Path) -> np.ndarray:
    """All points (n, 3) of a mesh, in meters."""
    root = ElementTree.parse(path).getroot()
    arrays = [
        a for a in root.iter(f"{COLLADA}float_array") if a.get("id", "").endswith("-points-array")
    ]
    return np.vstack([np.array(numbers(array.text)).reshape(-1, 3) for array in arrays])


def mesh_path(name: str) -> Path:
    return next(path for path in MESHES.values() if path.stem == name)


def bounds(name: str) -> Bounds:
    points = collada_points(mesh_path(name))
    return points.min(axis=0), points.max(axis=0)


def test_every_mesh_of_a_model_exists_and_every_mesh_is_used(models: Models) -> None:
    named = {file for model in models.values() for file in mesh_files(model)}
    assert named == set(MESHES)


def test_every_visual_has_a_mesh_and_every_link_a_collision(models: Models) -> None:
    for model in models.values():
        for link in model.iter("link"):
            child(link, "visual/geometry/mesh")
            child(link, "collision/geometry/*")


@pytest.mark.parametrize("name", ROBOTS)
def test_the_simulator_draws_the_robots_as_their_models(robots: Models, name: str) -> None:
    """The mesh of each link, in its frame."""
    visuals = link_visuals(ElementTree.tostring(robots[name], encoding="unicode"))
    links = [f"{name}/{link}" for link in (*(f"link{i}" for i in range(8)), "tool")]
    assert sorted(links) == sorted(it.link for it in visuals)
    for visual in visuals:
        mesh = ROBOT_MESHES[links.index(visual.link)]
        assert visual[1:] == (Placement(), ShapeKind.MESH, (1.0, 1.0, 1.0),
                              f"package://process_visualizer/meshes/{mesh}.dae", None)


def test_meshes_together_stay_small() -> None:
    assert sum(path.stat().st_size for path in MESHES.values()) < SIZE_LIMIT_BYTES


@pytest.mark.parametrize("path", list(MESHES.values()), ids=lambda path: path.stem)
def test_mesh_is_sound(path: Path) -> None:
    """Points, normals and triangles agree in number; normals are unit and point outwards."""
    for mesh in ElementTree.parse(path).getroot().iter(f"{COLLADA}mesh"):
        arrays = [a.text for a in mesh.iter(f"{COLLADA}float_array")]
        points, normals = (np.array(numbers(text)).reshape(-1, 3) for text in arrays)
        indices = child(mesh, f"{COLLADA}triangles/{COLLADA}p").text
        triangles = np.array(numbers(indices), dtype=int).reshape(-1, 3)
        assert points.shape == normals.shape
        assert triangles.min() == 0 and triangles.max() == len(points) - 1
        assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=0.02)
        assert_outward(points, normals, triangles)


def assert_outward(points: np.ndarray, normals: np.ndarray, triangles: np.ndarray) -> None:
    """The winding of nearly the whole area agrees with the normals (slivers may be rounded)."""
    a, b, c = (points[triangles[:, column]] for column in range(3))
    areas = np.cross(b - a, c - a)
    agreement = np.einsum("ij,ij->i", areas, normals[triangles].mean(axis=1))
    size = np.linalg.norm(areas, axis=1)
    assert size[agreement <= 0].sum() < 1e-3 * size.sum()


def test_sewing_machine_has_the_dimensions_of_the_cell() -> None:
    low, high = bounds("sewing_machine")
    assert low[2] == pytest.approx(-1.05, abs=1e-3), "it stands on the floor"
    assert high[2] < 0.55
    assert high[1] < 0.05, "the lower robot's space begins at y = 0.05"
    assert low[0] > -0.8 and low[1] > -0.7 and high[0] < 0.4


def test_needle_of_the_sewing_machine_is_at_its_frame() -> None:
    """Around (-0.08, -0.08) only needle, foot and plate are between 0 and 0.1 m."""
    points = collada_points(mesh_path("sewing_machine"))
    near = points[(np.hypot(points[:, 0] + 0.08, points[:, 1] + 0.08) < 0.0025)]
    assert near[:, 2].max() > 0.1 and np.any(np.abs(near[:, 2]) < 0.01)


def test_robot_links_reach_their_joints() -> None:
    assert bounds("ur-link2")[0][0] == pytest.approx(-0.425 - 0.053, abs=2e-3)
    assert bounds("ur-link4")[0][0] == pytest.approx(-0.39243 - 0.0385, abs=2e-3)
    assert bounds("ur-link7")[1][2] == pytest.approx(0.082, abs=1e-3)
    assert 0.10 < bounds("ur-tool")[1][2] < 0.11
    for index in range(8):
        low, high = bounds(f"ur-link{index}")
        assert np.all(high - low > 0.03) and np.all(high - low < 0.6)


def test_stand_carries_the_robots_and_stands_on_the_floor() -> None:
    low, high = bounds("cell_stand")
    assert low[2] == pytest.approx(-1.0, abs=1e-3)
    assert 1.9 < high[2] < 2.1


def test_making_the_meshes_again_gives_the_same_files(tmp_path: Path) -> None:
    script = REPOSITORY / "scripts" / "make_meshes.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, timeout=120)
    made = {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.dae")}
    assert made == {path.relative_to(REPOSITORY): path.read_bytes() for path in MESHES.values()}
