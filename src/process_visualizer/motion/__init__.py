# SPDX-License-Identifier: BSD-3-Clause
"""Rotations, velocity, kinematics, arrows (pure: numpy only, no ROS node, no Qt)."""
