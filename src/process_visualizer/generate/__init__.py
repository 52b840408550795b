# SPDX-License-Identifier: BSD-3-Clause
"""From a cell and a choice to launch file, RViz file and robot descriptions (pure)."""
