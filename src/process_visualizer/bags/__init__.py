# SPDX-License-Identifier: BSD-3-Clause
"""Bags: index, timeline, stamps and playback (pure: no ROS node, no Qt)."""
