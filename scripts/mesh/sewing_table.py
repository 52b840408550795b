# SPDX-License-Identifier: BSD-3-Clause
"""The sewing machine's table, stand, drive and thread stand, in the frame sewing_machine/base.

The table lies only at the -x and -y sides of the bed: the side where covers come from (+y) is
left to the robots.
"""

from __future__ import annotations

from .outline import rounded_polygon
from .primitives import box, cylinder, extrude, lathe
from .surface import Parts, moved

#: Height of the floor in sewing_machine/base.
FLOOR_Z_M = -1.05
#: Just below the sewing plane, so that the lower cover lies above the table.
TABLE_TOP_Z_M = -0.012
TABLE_THICKNESS_M = 0.030


def table() -> Parts:
    """The L-shaped table plate around the bed, with a light edge."""
    corners = [
        (-0.72, -0.62),
        (0.32, -0.62),
        (0.32, -0.163),
        (-0.503, -0.163),
        (-0.503, 0.03),
        (-0.72, 0.03),
    ]
    radii = [0.05, 0.05, 0.03, 0.004, 0.02, 0.05]
    bottom = TABLE_TOP_Z_M - TABLE_THICKNESS_M
    plate = extrude(rounded_polygon(corners, radii), bottom + 0.004, TABLE_TOP_Z_M, 0.003)
    base = extrude(rounded_polygon(corners, radii), bottom, bottom + 0.006, 0.001)
    return [("table", plate), ("frame_grey", base)]


def stand() -> Parts:
    """Two legs with feet on the floor, a beam between them, and a bracket below the bed."""
    bracket = box((0.46, 0.05, 0.020), (-0.25, -0.09, -0.145), 0.004)
    arms = [box((0.05, 0.30, 0.030), (x, -0.24, -0.155), 0.004) for x in (-0.44, -0.06)]
    beam = box((0.88, 0.040, 0.070), (-0.20, -0.40, -0.70), 0.004)
    rail = box((0.96, 0.05, 0.045), (-0.20, -0.40, -0.150), 0.004)
    pieces = [("frame_grey", piece) for piece in (bracket, *arms, beam, rail)]
    return [*_leg(-0.66, -0.60, 0.02), *_leg(0.26, -0.60, -0.18), *pieces]


def _leg(x: float, back: float, front: float) -> Parts:
    """A leg at `x` whose foot and head reach from y = `back` to y = `front`, in meters."""
    middle, depth = (back + front) / 2, front - back
    top = TABLE_TOP_Z_M - TABLE_THICKNESS_M
    foot = box((0.070, depth, 0.045), (x, middle, FLOOR_Z_M + 0.0425), 0.006)
    post = box((0.050, 0.080, 0.95), (x, -0.40, top - 0.475), 0.005)
    head = box((0.050, depth, 0.040), (x, middle, top - 0.020), 0.004)
    pads = [
        cylinder(0.028, FLOOR_Z_M, FLOOR_Z_M + 0.022, 0.003).moved(x, y)
        for y in (back + 0.04, front - 0.04)
    ]
    return [
        ("frame_grey", foot),
        ("frame_grey", post),
        ("frame_grey", head),
        *(("rubber", pad) for pad in pads),
    ]


def drive() -> Parts:
    """The motor, its control box and the pedal."""
    motor = cylinder(0.065, 0, 0.20, 0.008).along("x").moved(-0.60, -0.40, -0.25)
    fins = [
        cylinder(0.070, 0, 0.008, 0.002).along("x").moved(-0.57 + 0.03 * i, -0.40, -0.25)
        for i in range(5)
    ]
    control = box((0.12, 0.16, 0.24), (0.16, -0.40, -0.30), 0.008)
    switch = box((0.003, 0.050, 0.035), (0.2205, -0.38, -0.24), 0.001)
    pedal = box((0.30, 0.20, 0.016), (-0.30, -0.28, FLOOR_Z_M + 0.078), 0.003)
    socket = box((0.34, 0.06, 0.075), (-0.30, -0.28, FLOOR_Z_M + 0.0375), 0.004)
    rod = cylinder(0.006, FLOOR_Z_M + 0.08, -0.25, 0.001).moved(-0.42, -0.36)
    return [
        ("green_grey", motor),
        *(("frame_grey", fin) for fin in fins),
        ("enamel", control),
        ("orange", switch),
        ("rubber", pedal),
        ("frame_grey", socket),
        ("steel", rod),
    ]


def thread_stand() -> Parts:
    """A pole at the back of the table with two cones of thread and their guide."""
    pole = cylinder(0.006, TABLE_TOP_Z_M, 0.48, 0.002)
    guide = box((0.20, 0.008, 0.008), (0, 0, 0.475), 0.002)
    tray = box((0.24, 0.10, 0.008), (0, 0, TABLE_TOP_Z_M + 0.02), 0.003)
    steel: Parts = [("steel", piece) for piece in (pole, guide, tray)]
    cones = [*moved(_cone("thread_red"), x=-0.065), *moved(_cone("thread_cream"), x=0.065)]
    return moved(steel + cones, x=-0.58, y=-0.30)


def _cone(material: str) -> Parts:
    low = TABLE_TOP_Z_M + 0.024
    spool = [(0, low), (0.045, low), (0.048, low + 0.01), (0.026, low + 0.15), (0, low + 0.15)]
    return [(material, lathe(spool, 0.004)), ("black", cylinder(0.012, low, low + 0.175, 0.003))]
