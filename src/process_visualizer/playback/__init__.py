# SPDX-License-Identifier: BSD-3-Clause
"""Playback: timeline, scene at a time, mapping of stamps, steps, the engine (pure: no ROS)."""
