# SPDX-License-Identifier: BSD-3-Clause
"""The window's connection to ROS: the only folder of the window that imports rospy."""
