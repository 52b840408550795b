# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of runs: models and the panel."""
