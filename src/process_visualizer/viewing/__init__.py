# SPDX-License-Identifier: BSD-3-Clause
"""Shows a cell that runs elsewhere: its own ROS master and RViz, and one connection to the cell."""
