# SPDX-License-Identifier: BSD-3-Clause
"""The one function of ROS 2's package index that xacro 2 uses for ``$(find …)``."""
