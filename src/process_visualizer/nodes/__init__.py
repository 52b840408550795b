# SPDX-License-Identifier: BSD-3-Clause
"""The nodes: robot_proc, depth_proc, variable_proc, cell_frames, ghost, scene_watch, view_relay."""
