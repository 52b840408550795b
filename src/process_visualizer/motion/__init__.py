# SPDX-License-Identifier: BSD-3-Clause
"""Rotations, velocity estimation and arrows (pure: numpy only, no ROS node, no Qt)."""
