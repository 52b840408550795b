# SPDX-License-Identifier: BSD-3-Clause
"""roslaunch as a child process: its nodes are followed, and no process is left behind (no Qt)."""
