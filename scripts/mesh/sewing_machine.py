# SPDX-License-Identifier: BSD-3-Clause
"""The industrial sewing machine, in the frame sewing_machine/base.

The frame is the (+x, +y) top corner of the bed; z = 0 is the sewing plane. Covers are fed along
-y, so the operator's side is +y and the handwheel is at -x.
"""

from __future__ import annotations

from .outline import rounded_polygon
from .primitives import box, cylinder, extrude, lathe
from .sewing_table import drive, stand, table, thread_stand
from .surface import Parts, Surface, moved

NEEDLE_X_M, NEEDLE_Y_M = -0.08, -0.08


def sewing_machine() -> Parts:
    """The whole machine on its table."""
    parts = bed() + arm() + head() + needle() + handwheel() + panel() + edge_sensors()
    return parts + table() + stand() + drive() + thread_stand()


def bed() -> Parts:
    """The bed with its needle plate, slide plate, feed dogs and oil pan."""
    feed_dogs = [
        ("black", box((0.004, 0.024, 0.003), (NEEDLE_X_M + x, NEEDLE_Y_M, 0.001), 0.0005))
        for x in (-0.009, 0.009)
    ]
    return [
        ("enamel", box((0.50, 0.16, 0.075), (-0.25, -0.08, -0.0375), 0.006)),
        ("green_grey", box((0.46, 0.13, 0.065), (-0.25, -0.08, -0.105), 0.008)),
        ("chrome", box((0.060, 0.080, 0.004), (NEEDLE_X_M, NEEDLE_Y_M, -0.001), 0.0008)),
        ("steel", box((0.050, 0.150, 0.004), (-0.027, -0.08, -0.0012), 0.0008)),
        ("black", cylinder(0.003, 0, 0.0016, 0.0005).moved(NEEDLE_X_M, NEEDLE_Y_M)),
        *feed_dogs,
    ]


def arm() -> Parts:
    """Column, arm and head as one casting, with its cover plates and the machine's name plate."""
    corners = [
        (-0.475, -0.002),
        (-0.335, -0.002),
        (-0.350, 0.185),
        (-0.135, 0.178),
        (-0.128, 0.112),
        (-0.032, 0.112),
        (-0.030, 0.285),
        (-0.120, 0.305),
        (-0.475, 0.300),
    ]
    radii = [0.008, 0.030, 0.045, 0.030, 0.012, 0.012, 0.035, 0.060, 0.035]
    casting = extrude(rounded_polygon(corners, radii), -0.052, 0.052, 0.008).along("-y")
    return [
        ("enamel", casting.moved(y=NEEDLE_Y_M)),
        ("green_grey", box((0.20, 0.003, 0.055), (-0.245, -0.028, 0.243), 0.001)),
        ("chrome", box((0.09, 0.003, 0.018), (-0.275, -0.027, 0.248), 0.001)),
        ("green_grey", box((0.004, 0.080, 0.130), (-0.0305, NEEDLE_Y_M, 0.200), 0.0015)),
        ("steel", _knob(0.026, 0.016, -0.405, 0.215)),
        ("black", _knob(0.012, 0.024, -0.405, 0.215)),
        ("steel", _knob(0.018, 0.010, -0.410, 0.090)),
    ]


def _knob(radius: float, height: float, x: float, z: float) -> Surface:
    """A round knob on the operator's face of the casting."""
    return cylinder(radius, 0, height, 0.002).along("y").moved(x, NEEDLE_Y_M + 0.051, z)


def head() -> Parts:
    """The parts below the head: needle bar, presser bar, thread tension and take-up lever."""
    front_y = NEEDLE_Y_M + 0.050
    tension = cylinder(0.013, 0, 0.008, 0.002).along("y").moved(-0.095, front_y, 0.165)
    tension_knob = cylinder(0.007, 0.006, 0.020, 0.002).along("y").moved(-0.095, front_y, 0.165)
    lever = box((0.006, 0.022, 0.005), (-0.065, front_y + 0.010, 0.235), 0.0015)
    slot = box((0.008, 0.003, 0.075), (-0.065, front_y + 0.002, 0.215), 0.001)
    bushing = cylinder(0.010, 0.104, 0.118, 0.002).moved(NEEDLE_X_M, NEEDLE_Y_M)
    return [
        ("chrome", tension),
        ("steel", tension_knob),
        ("chrome", lever),
        ("black", slot),
        ("steel", bushing),
    ]


def needle() -> Parts:
    """Needle bar, clamp and needle, and the presser foot whose two toes straddle the needle."""
    bar = cylinder(0.0045, 0.046, 0.112, 0.001)
    clamp = cylinder(0.0075, 0.036, 0.054, 0.0015)
    tip = lathe([(0, -0.006), (0.0012, 0.004), (0.0016, 0.040), (0, 0.040)], 0.0003)
    presser_bar = cylinder(0.005, 0.020, 0.112, 0.001).moved(y=-0.026)
    ankle = box((0.012, 0.016, 0.018), (0, -0.024, 0.018), 0.002)
    toes = [box((0.007, 0.048, 0.005), (x, -0.002, 0.0085), 0.0015) for x in (-0.008, 0.008)]
    sole = box((0.023, 0.016, 0.005), (0, -0.022, 0.0085), 0.0015)
    foot = [("steel", piece) for piece in (presser_bar, ankle, sole, *toes)]
    pins: Parts = [("chrome", bar), ("steel", clamp), ("chrome", tip)]
    return moved(pins + foot, NEEDLE_X_M, NEEDLE_Y_M)


def handwheel() -> Parts:
    """The handwheel at the machine's -x end, and the belt guard behind it."""
    rim = [
        (0.036, 0.004),
        (0.058, 0.000),
        (0.064, 0.006),
        (0.064, 0.020),
        (0.056, 0.026),
        (0.040, 0.020),
        (0.018, 0.022),
        (0.016, 0.034),
        (0, 0.034),
    ]
    wheel = lathe([(0, 0.004), *rim], 0.003).along("-x").moved(-0.485, NEEDLE_Y_M, 0.232)
    ring = cylinder(0.0655, 0.009, 0.016, 0.001).along("-x").moved(-0.485, NEEDLE_Y_M, 0.232)
    hub = cylinder(0.045, 0, 0.016, 0.003).along("-x").moved(-0.473, NEEDLE_Y_M, 0.232)
    return [("black", wheel), ("chrome", ring), ("green_grey", hub)]


def panel() -> Parts:
    """The control panel on top of the arm, leaning towards the operator."""
    case = box((0.130, 0.026, 0.080), (-0.250, -0.060, 0.365), 0.006)
    screen = box((0.080, 0.003, 0.050), (-0.262, -0.0465, 0.370), 0.001)
    keys = [box((0.012, 0.003, 0.010), (-0.205, -0.0465, z), 0.001) for z in (0.350, 0.370, 0.390)]
    foot = box((0.030, 0.016, 0.040), (-0.250, -0.062, 0.315), 0.003)
    return [
        ("frame_grey", case),
        ("screen", screen),
        ("frame_grey", foot),
        *(("orange", key) for key in keys),
    ]


def edge_sensors() -> Parts:
    """The optical sensors in front of the needle: one above the covers, one below."""
    arm_up = box((0.010, 0.012, 0.085), (-0.110, -0.022, 0.085), 0.002)
    upper = box((0.034, 0.018, 0.024), (-0.100, -0.018, 0.040), 0.003)
    upper_eye = cylinder(0.005, 0.022, 0.029, 0.001).moved(-0.093, -0.018)
    lower = box((0.034, 0.018, 0.030), (-0.100, 0.012, -0.045), 0.003)
    lower_eye = cylinder(0.005, -0.031, -0.024, 0.001).moved(-0.093, 0.012)
    return [
        ("frame_grey", arm_up),
        ("black", upper),
        ("lens", upper_eye),
        ("black", lower),
        ("lens", lower_eye),
    ]
