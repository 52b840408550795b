# SPDX-License-Identifier: BSD-3-Clause
"""Lets xacro 2 find packages of ROS 1: see xacro_child."""
