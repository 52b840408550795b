# SPDX-License-Identifier: BSD-3-Clause
"""What a cell and its viewers on other computers say to each other, and how fast (no ROS)."""
