# SPDX-License-Identifier: BSD-3-Clause
"""The viewer of a cell elsewhere: its own ROS master and RViz, one connection to the cell."""
