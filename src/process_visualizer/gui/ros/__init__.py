# SPDX-License-Identifier: BSD-3-Clause
"""The only room of the window that knows rospy."""
