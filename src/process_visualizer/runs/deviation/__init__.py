# SPDX-License-Identifier: BSD-3-Clause
"""Deviations of a run from good ones, and when they began."""
