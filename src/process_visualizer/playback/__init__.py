# SPDX-License-Identifier: BSD-3-Clause
"""Playback: timeline, scene at a time, stamp mapping, steps, engine (pure: no ROS)."""
