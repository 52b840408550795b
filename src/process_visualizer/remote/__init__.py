# SPDX-License-Identifier: BSD-3-Clause
"""The protocol between a cell and its viewers on other computers, and its flow control (no ROS)."""
