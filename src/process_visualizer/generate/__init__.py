# SPDX-License-Identifier: BSD-3-Clause
"""A choice (cell, devices, mode) becomes a plan: launch files, RViz file, models (pure)."""
