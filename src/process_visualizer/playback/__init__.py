# SPDX-License-Identifier: BSD-3-Clause
"""Time: timeline, scene at a time, stamps moved, steps, the engine (pure: no ROS)."""
