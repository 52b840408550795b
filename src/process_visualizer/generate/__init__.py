# SPDX-License-Identifier: BSD-3-Clause
"""Turns a choice (cell, devices, mode) into a plan: launch files, RViz file, models (pure)."""
