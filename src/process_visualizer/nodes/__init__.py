# SPDX-License-Identifier: BSD-3-Clause
"""The ROS nodes (rospy), one class per module; the executables in nodes/ call their main."""
