# SPDX-License-Identifier: BSD-3-Clause
"""Robot descriptions: xacro is expanded, urdfdom checks, extents and tool frames (pure)."""
