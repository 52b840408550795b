# SPDX-License-Identifier: BSD-3-Clause
"""Alignment: the moments of two runs that correspond to each other."""
