# SPDX-License-Identifier: BSD-3-Clause
"""The UR-6-85-5-A (the early UR5): one list of parts per link, each in its link's frame.

A UR joint is a round housing on the joint's axis: a blue cap at one end, the moving flange at the
other, and a tube or a second housing leaving at right angles. The thesis' table 6.1 sums the
robot's sideways offsets up into d_4 = 0.109 m; the links are drawn at their true offsets along
the shoulder's axis: the upper arm 0.136 m beside the base, the forearm 0.016 m.
"""

from __future__ import annotations

import math
from typing import Callable, Dict

from .outline import rectangle
from .primitives import band, box, cylinder, extrude, lathe
from .surface import Parts, along, moved

SHOULDER_HEIGHT_M = 0.0892
UPPER_ARM_LENGTH_M = 0.425
FOREARM_LENGTH_M = 0.39243
WRIST_1_OFFSET_M = 0.109
WRIST_2_OFFSET_M = 0.093
FLANGE_OFFSET_M = 0.082

UPPER_ARM_OFFSET_M = 0.136
FOREARM_OFFSET_M = 0.016
#: Half the height of a joint: from the middle of its housing to the face that meets the next one.
LARGE_HALF_M = 0.060
SMALL_HALF_M = 0.0465

SHOULDER_RADIUS_M = 0.060
ELBOW_RADIUS_M = 0.053
WRIST_RADIUS_M = 0.0385


def housing(radius: float, face: float, top: float) -> Parts:
    """A joint housing about z: the moving face at height `face`, the blue cap ending at `top`."""
    cap_height = 0.30 * radius
    rim = top - cap_height
    dome = [(0, rim), (radius, rim), (0.985 * radius, top - 0.004), (0.55 * radius, top), (0, top)]
    return [
        ("seal", band(0.94 * radius, face, face + 0.006)),
        ("aluminium", cylinder(radius, face + 0.003, rim - 0.003, 0.004)),
        ("seal", band(0.95 * radius, rim - 0.006, rim + 0.003)),
        ("blue_cap", lathe(dome, 0.006)),
    ]


def limb(radius: float, end_radius: float, start: float, end: float) -> Parts:
    """A tube about z from `start` to `end`, with a collar and a seam where it meets a housing."""
    collar = 0.028
    first, last = start + collar, end - collar
    return [
        ("aluminium", cylinder(1.10 * radius, start - 0.03, first, 0.004)),
        ("seal", cylinder(1.04 * radius, first - 0.002, first + 0.003, 0.001)),
        ("aluminium", lathe([(0, first), (radius, first), (end_radius, last), (0, last)], 0.002)),
        ("seal", cylinder(1.04 * end_radius, last - 0.003, last + 0.002, 0.001)),
        ("aluminium", cylinder(1.10 * end_radius, last, end + 0.03, 0.004)),
    ]


def base() -> Parts:
    """Link 0: the mounting flange with its four bolts and the cable's connector."""
    profile = [(0, 0), (0.0745, 0), (0.0745, 0.022), (0.060, 0.027), (0.060, 0.043), (0, 0.043)]
    parts: Parts = [("aluminium", lathe(profile, 0.003))]
    for quarter in range(4):
        angle = math.pi / 4 + quarter * math.pi / 2
        bolt = cylinder(0.006, 0.02, 0.029, 0.001)
        parts.append(("seal", bolt.moved(0.0672 * math.cos(angle), 0.0672 * math.sin(angle))))
    plug = cylinder(0.011, 0.055, 0.092, 0.002).along("x").moved(z=0.031)
    return parts + [("black", plug)]


def shoulder() -> Parts:
    """Link 1: the upright housing, with the stub towards the upper arm along -y."""
    stub = cylinder(SHOULDER_RADIUS_M, 0, UPPER_ARM_OFFSET_M - LARGE_HALF_M, 0.003)
    upright = housing(SHOULDER_RADIUS_M, 0.041, SHOULDER_HEIGHT_M + 0.070)
    return upright + [("aluminium", stub.along("-y").moved(z=SHOULDER_HEIGHT_M))]


def upper_arm() -> Parts:
    """Link 2: the shoulder's lift housing, the tube along -x and the elbow's first housing."""
    face, top = UPPER_ARM_OFFSET_M - LARGE_HALF_M, UPPER_ARM_OFFSET_M + LARGE_HALF_M
    lift = housing(SHOULDER_RADIUS_M, face, top + 0.003)
    elbow = moved(housing(ELBOW_RADIUS_M, face, top - 0.003), x=-UPPER_ARM_LENGTH_M)
    tube = limb(0.0445, 0.0415, 0.058, UPPER_ARM_LENGTH_M - 0.050)
    return lift + elbow + moved(along(tube, "-x"), z=UPPER_ARM_OFFSET_M)


def elbow() -> Parts:
    """Link 3: the elbow's second housing, whose cap looks away from the upper arm."""
    reach = UPPER_ARM_OFFSET_M - LARGE_HALF_M - FOREARM_OFFSET_M
    return moved(along(housing(ELBOW_RADIUS_M, -reach, 0.055), "-z"), z=FOREARM_OFFSET_M)


def forearm() -> Parts:
    """Link 4, fixed to link 3: the tube along -x and the housing of the first wrist."""
    tube = limb(0.0395, 0.0345, 0.050, FOREARM_LENGTH_M - 0.034)
    wrist = along(housing(WRIST_RADIUS_M, -SMALL_HALF_M, 0.050), "-z")
    return moved(along(tube, "-x") + moved(wrist, x=-FOREARM_LENGTH_M), z=FOREARM_OFFSET_M)


def wrist_1() -> Parts:
    """Link 5: a stub on the axis of wrist 1 and the housing across it, which opens along -y."""
    return _wrist(WRIST_1_OFFSET_M, "y")


def wrist_2() -> Parts:
    """Link 6: a stub on the axis of wrist 2 and the housing across it, which opens along y."""
    return _wrist(WRIST_2_OFFSET_M, "-y")


def _wrist(offset: float, cap_direction: str) -> Parts:
    stub = cylinder(WRIST_RADIUS_M, offset - SMALL_HALF_M, offset, 0.003)
    across = along(housing(WRIST_RADIUS_M, -SMALL_HALF_M, 0.050), cap_direction)
    return [("aluminium", stub), *moved(across, z=offset)]


def wrist_3() -> Parts:
    """Link 7: the last, short housing with the tool flange and the tool's connector."""
    body = [(0, SMALL_HALF_M), (0.0375, SMALL_HALF_M), (0.0375, 0.074), (0, 0.074)]
    connector = cylinder(0.008, 0.030, 0.046, 0.002).along("y")
    return [
        ("aluminium", lathe(body, 0.003)),
        ("steel", cylinder(0.0315, 0.070, FLANGE_OFFSET_M, 0.001)),
        ("black", connector.moved(z=0.061)),
    ]


def gripper() -> Parts:
    """The tool: a force sensor, and two padded paddles that press on a leather cover.

    It reaches 0.106 m along z; the paddles lie side by side along x.
    """
    paddles = [paddle for x in (-0.045, 0.045) for paddle in _paddle(x)]
    return [
        ("seal", cylinder(0.0375, 0, 0.008, 0.001)),
        ("black", cylinder(0.040, 0.007, 0.034, 0.003)),
        ("steel", cylinder(0.0402, 0.018, 0.022, 0.0005)),
        ("steel", cylinder(0.030, 0.033, 0.042, 0.002)),
        ("frame_grey", cylinder(0.016, 0.040, 0.072, 0.002)),
        ("frame_grey", box((0.130, 0.030, 0.014), (0, 0, 0.075))),
        *paddles,
    ]


def _paddle(x: float) -> Parts:
    plate, pad = rectangle(0.080, 0.070, 0.012), rectangle(0.076, 0.066, 0.011)
    return [
        ("steel", cylinder(0.007, 0.080, 0.092, 0.001).moved(x=x)),
        ("orange", extrude(plate, 0.090, 0.099, 0.0015).moved(x=x)),
        ("rubber", extrude(pad, 0.098, 0.106, 0.0015).moved(x=x)),
    ]


#: File name without extension -> the function that builds its parts.
ROBOT_MESHES: Dict[str, Callable[[], Parts]] = {
    "ur-link0": base,
    "ur-link1": shoulder,
    "ur-link2": upper_arm,
    "ur-link3": elbow,
    "ur-link4": forearm,
    "ur-link5": wrist_1,
    "ur-link6": wrist_2,
    "ur-link7": wrist_3,
    "ur-tool": gripper,
}
