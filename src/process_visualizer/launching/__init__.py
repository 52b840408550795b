# SPDX-License-Identifier: BSD-3-Clause
"""Running roslaunch as a child: its nodes are followed, and nothing is left behind (no Qt)."""
