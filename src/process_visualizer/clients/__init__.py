# SPDX-License-Identifier: BSD-3-Clause
"""The services of player, recorder, RViz and ROS as methods, for window and commands (rospy)."""
