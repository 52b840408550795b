# SPDX-License-Identifier: BSD-3-Clause
"""Services of player, recorder, RViz and ROS as methods, for the window and commands (rospy)."""
