# SPDX-License-Identifier: BSD-3-Clause
"""Lanes: the curves of process variables below each other, and how they are chosen."""
