# SPDX-License-Identifier: BSD-3-Clause
"""New configurations from a running cell or a recording; imports neither rospy nor Qt."""
