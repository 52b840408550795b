# SPDX-License-Identifier: BSD-3-Clause
"""Velocities: slopes over time, live and from a recording."""
