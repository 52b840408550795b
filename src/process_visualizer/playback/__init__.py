# SPDX-License-Identifier: BSD-3-Clause
"""The playback engine: timeline, scene, stamps, events (pure: no ROS node, no Qt)."""
