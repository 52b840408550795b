# SPDX-License-Identifier: BSD-3-Clause
"""Where xacro 2 finds packages of ROS 1: see xacro_child."""
