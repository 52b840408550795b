# SPDX-License-Identifier: BSD-3-Clause
"""The velocity arrow points along the true motion of the tool, for any driver convention."""
from __future__ import annotations

import sys
from pathlib import Path
from typing import List, Tuple

import numpy as np
import pytest
from robot_stage import RobotStage, direction
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from process_visualizer.robot.rotations import matrix_from_quaternion

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'bench'))

from arrow_truth import (  # noqa: E402
    CONVENTIONS,
    DATA,
    MODELS,
    RATE_HZ,
    SLOWEST_M_PER_S,
    Convention,
    Model,
    ToolPath,
    report,
)

from process_visualizer.robot.kinematics import Kinematics, Placement  # noqa: E402

SETTLED_S, DURATION_S = 1.5, 3.0


def row(robot: RobotStage, path: ToolPath, convention: Convention, belongs_s: float
        ) -> List[Tuple[float, float]]:
    """Compare RViz's current arrow with the path: angle [deg] and distance [m]; none while slow."""
    arrow = robot.markers().get(('velocity', 0))
    wanted = path.velocity(belongs_s, convention.tool)
    if arrow is None or arrow.action != Marker.ADD or np.linalg.norm(wanted) < SLOWEST_M_PER_S:
        return []
    now_s, foot = robot.node.now_s, arrow.pose.position
    frame = path.kinematics.placement(arrow.header.frame_id, path.model.base,
                                      path.positions(now_s))
    drawn = matrix_from_quaternion(frame.quaternion) @ direction(arrow)
    angle = np.arctan2(np.linalg.norm(np.cross(drawn, wanted)), np.dot(drawn, wanted))
    begins = frame.then(Placement((foot.x, foot.y, foot.z))).position
    return [(float(np.degrees(angle)), float(np.linalg.norm(np.subtract(
        begins, path.tool(now_s, convention.tool).position))))]


@pytest.mark.parametrize('convention', CONVENTIONS, ids=lambda it: it.title)
@pytest.mark.parametrize('model', MODELS, ids=lambda it: it.file)
def test_every_model_with_poses_turned_and_untouched(model: Model, convention: Convention) -> None:
    text = (DATA / f'{model.file}.urdf').read_text()
    robot = RobotStage({'base_frame': model.base, 'tool_frame': model.tool, 'topics': {
        'joint_states': {'name': 'q_act'}, 'tool_center_frame': {'name': 'tcf'}}}, 'arm', text)
    path = ToolPath(model, Kinematics(text), robot.node.now_s)
    found: List[Tuple[float, float]] = []

    def drive(time_s: float) -> None:
        now_s = robot.node.now_s
        positions = path.positions(now_s)
        robot.send('/arm/joint_states', JointState(
            header=Header(stamp=robot.node.now()), name=list(positions),
            position=list(positions.values())))
        robot.send('/arm/tcf', report(convention, path.tool(now_s, convention.tool), now_s))
        if time_s > SETTLED_S and round(time_s * RATE_HZ) % 2:
            found.extend(row(robot, path, convention, robot.twists[-1].header.stamp.to_sec()))
            robot.node.sent('marker_array')[:-8] = []
    robot.run(SETTLED_S + DURATION_S, drive, hz=RATE_HZ)
    angles_deg, feet_m = np.array(found).T
    assert len(angles_deg) > 100
    # The tool turns by 1 rad/s, and arrows are redrawn 30 times per second.
    assert np.median(angles_deg) < 1.0 and np.max(angles_deg) < 5.0
    assert np.max(feet_m) < 0.01
