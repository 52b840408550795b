# SPDX-License-Identifier: BSD-3-Clause
"""Runs roslaunch as a child process, watches its nodes, and leaves nothing behind (no Qt)."""
