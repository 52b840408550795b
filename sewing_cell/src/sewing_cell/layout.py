# SPDX-License-Identifier: BSD-3-Clause
"""Places of the objects in the simulated sewing cell: frame ``world``, z up, lengths in m."""

from __future__ import annotations

import numpy as np

FLOOR_Z = -1.0

#: Origin of sewing_machine/base: the (+x, +y) top corner of the machine's bed.
MACHINE_BASE = np.array([-0.667, -0.499, 0.05])
SEWING_PLANE_Z = 0.05
NEEDLE = MACHINE_BASE + np.array([-0.08, -0.08, 0.0])

#: The covers' extent about the point under the grippers: x_min, x_max, y_min, y_max.
COVER_BOX = (-0.14, 0.26, -0.84, 0.04)
COVER_THICKNESS = 0.003

#: Points at which the grippers fetch the next covers, and at which the seam starts and ends.
FETCH_XY = (-0.54, 0.45)
SEAM_START_XY = (-0.62, 0.25)
SEAM_END_XY = (-0.62, -0.25)

#: The tools' height above the sewing plane while they hold a cover, and their lift when free of it.
GRIP_HEIGHT = 0.11
LIFT_HEIGHT = 0.08

#: The Kinect: camera_link, its pitch [rad], and the color camera in camera_link (as in openni).
CAMERA_XYZ = np.array([-0.53, 0.09, 1.90])
CAMERA_PITCH = 1.55
#: camera_2_link of a second Kinect, with the orientation of the first one.
SECOND_CAMERA_XYZ = np.array([-0.53, -0.45, 1.90])
COLOR_CAMERA_OFFSET = np.array([0.0, -0.045, 0.0])
