# SPDX-License-Identifier: BSD-3-Clause
"""Package index by which xacro 2 finds packages of ROS 1: see xacro_command."""
