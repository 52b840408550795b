# SPDX-License-Identifier: BSD-3-Clause
"""The only folder of the window that imports rospy."""
