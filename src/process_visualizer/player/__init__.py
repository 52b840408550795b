# SPDX-License-Identifier: BSD-3-Clause
"""The player node: the engine with its publishers, services and state (rospy)."""
