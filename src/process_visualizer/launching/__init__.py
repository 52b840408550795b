# SPDX-License-Identifier: BSD-3-Clause
"""Runs roslaunch as a child, follows its nodes, leaves nothing behind (no Qt)."""
