# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of runs, recorded or live: finding and comparing them, the ghost, and the panel."""
