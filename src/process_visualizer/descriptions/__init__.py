# SPDX-License-Identifier: BSD-3-Clause
"""Robot descriptions: expands xacro, checks with urdfdom, finds extents and tool frames (pure)."""
