# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of runs with good ones, and the texts about it."""
