# SPDX-License-Identifier: BSD-3-Clause
"""A configuration made from what runs or was recorded; imports neither rospy nor Qt."""
