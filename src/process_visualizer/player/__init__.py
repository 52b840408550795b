# SPDX-License-Identifier: BSD-3-Clause
"""The player as a node: the engine with its publishers, services and state (rospy)."""
